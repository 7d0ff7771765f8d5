// The viewer as far as the page can tell: the bundle by HTTP, the protocol by WebSocket, two frames at most on their way.
//   node test/mock/server.mjs DIST [SCENE] [PORT]    to look at a scene by hand
import { createServer } from "node:http";
import { readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { WebSocketServer } from "ws";
import { encode } from "./encode.mjs";
import { Drive, StoredMap } from "./scenes.mjs";

export const scenes = {
  drive: () => new Drive(),
  medium: () => new Drive({ landmarks: 100_000, size: 1500, known: true, history: 20_000, touched: 100 }),
  large: () => new Drive({ landmarks: 1_000_000, size: 6000, known: true, history: 1_000_000, touched: 200, warm: 50 }),
  fast: () => new Drive({ speed: 300 }),
  log: () => new Drive({ second: true, mode: "log", warm: 900 }),
  map: () => new StoredMap(),
};

const files = { "/": ["index.html", "text/html; charset=utf-8"], "/app.js": ["app.js", "text/javascript"], "/app.css": ["app.css", "text/css"] };

/** The strictest that the page works with. */
const policy = "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'";

export class MockServer {
  constructor(dist, scene, { pause = 50 } = {}) {
    Object.assign(this, { dist, scene, clients: new Set(), seq: 0, messages: [], broken: 0 });
    this.http = createServer((request, response) => this.serve(request, response));
    this.sockets = new WebSocketServer({ server: this.http, path: "/live", maxPayload: 4096, perMessageDeflate: false });
    this.sockets.on("connection", (socket) => this.connect(socket));
    this.timer = setInterval(() => this.tick(), pause);
  }

  async listen(port = 0) {
    await new Promise((done) => this.http.listen(port, "127.0.0.1", done));
    this.port = this.http.address().port;
    this.url = `http://127.0.0.1:${this.port}/`;
    return this;
  }

  async close() {
    if (this.isClosed) return;
    this.isClosed = true;
    clearInterval(this.timer);
    for (const c of this.clients) c.socket.terminate();
    this.sockets.close();
    await new Promise((done) => this.http.close(done));
  }

  serve(request, response) {
    const [file, type] = files[request.url.split("?")[0]] ?? [];
    if (!file) return response.writeHead(404).end();
    response.writeHead(200, { "content-type": type, "cache-control": "no-store", "content-security-policy": policy }).end(readFileSync(join(this.dist, file)));
  }

  connect(socket) {
    const client = { socket, inFlight: new Map(), skipped: 0, acks: 0 };
    this.clients.add(client);
    socket.send(encode(this.scene.hello()));
    this.scene.start(client);
    socket.on("message", (data) => this.take(client, data));
    socket.on("close", () => this.clients.delete(client));
    this.send(client);
  }

  take(client, data) {
    let message;
    try {
      message = JSON.parse(data);
    } catch {
      this.broken++;
      return client.socket.close();
    }
    if (message.ack !== undefined) {
      client.acks++;
      client.shown = message.shown_ms - client.inFlight.get(message.ack);
      client.inFlight.delete(message.ack);
      return;
    }
    this.messages.push(message);
    const answer = this.scene.take(message, client);
    if (answer) client.socket.send(encode(answer));
  }

  tick() {
    if (this.isHeld) return;
    this.scene.tick();
    for (const c of this.clients) this.send(c);
    this.scene.isNews = false;
  }

  send(client) {
    if (client.inFlight.size >= 2) {
      client.skipped++;
      return;
    }
    for (const [header, arrays] of this.scene.frames(client)) {
      const wall_ms = Date.now(), seq = ++this.seq;
      client.inFlight.set(seq, wall_ms);
      client.socket.send(encode({ kind: "frame", seq, wall_ms, skipped: client.skipped, ...header }, arrays));
    }
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [dist = "out", scene = "drive", port = "8123"] = process.argv.slice(2);
  const server = await new MockServer(resolve(dist), scenes[scene]()).listen(Number(port));
  console.log(server.url);
}
