// What a server may have to show. A scene: hello(), start(client), tick(), frames(client), take(message, client).
// A client remembers what it was sent (`client.sent`), so that one that missed pictures gets everything in between.
import * as part from "./frames.mjs";
import { World } from "./world.mjs";

const merge = (...parts) => parts.reduce(([h, a], p) => (Array.isArray(p) ? [{ ...h, ...p[0] }, { ...a, ...p[1] }] : [{ ...h, ...p }, a]), [{}, {}]);

/** A drive that is seen live. */
export class Drive {
  constructor({ landmarks = 200, size = 160, known = false, history = 0, speed = 1, touched = 0, warm = 400, second = false, mode = "live" } = {}) {
    Object.assign(this, { speed, touched, mode, ill: {}, verdict: null, logged: 0 });
    this.worlds = [new World({ landmarks, size, known })];
    if (second) this.worlds.push(new World({ landmarks, size, known, seed: 1, offset: 0.8 }));
    for (const w of this.worlds) {
      if (history) synthesise(w, history);
      for (let i = 0; i < warm; i++) w.advance();
      w.counts = { used: w.count, unused: w.unused };
    }
    this.changes = this.worlds.map(() => []); // of each world: [number of the tick, slots]
    this.ticks = 0;
    this.log = [];
    for (let i = 0; i < 14; i++) this.say();
    this.player = mode === "log" ? { utime: 0, from: this.worlds[0].utime - 40_000_000, to: this.worlds[0].utime + 600_000_000, rate: 1, is_playing: true } : null;
  }

  hello() {
    const runs = this.worlds.map((_, i) => ({ name: ["this drive", "the same, without loop closures"][i], colour_index: i }));
    if (this.mode === "log") runs[0].name = "reference";
    return { kind: "hello", version: "mock", mode: this.mode, runs, foxglove: true, ...(this.player ? { log: { from: this.player.from, to: this.player.to } } : {}) };
  }

  start(client) { client.sent = this.worlds.map(() => ({ tick: -1, path: 0, keyframe: 0, log: 0, isNew: true })); }

  tick() {
    this.ticks++;
    if (this.player && !this.player.is_playing) return;
    const steps = this.speed * (this.player?.rate >= 1 ? this.player.rate : 1);
    this.worlds.forEach((w, i) => {
      for (let k = 0; k < steps; k++) w.advance(this.status ?? 5);
      for (let k = 0; k < this.touched; k++) {
        const s = Math.floor(w.random.uniform() * w.n);
        w.x[s] += 0.02 * w.random.normal();
        w.changed.add(s);
      }
      if (w.n < 5000) w.counts = { used: w.count, unused: w.unused };
      this.changes[i].push([this.ticks, [...w.changed]]);
      w.changed.clear();
      if (this.changes[i].length > 400) this.changes[i].shift();
    });
    if (this.player) this.player.utime = this.worlds[0].utime;
    if (this.ticks % 15 === 0) this.say();
  }

  say() {
    this.log.push(part.logLine(this.worlds[0], this.logged++));
    if (this.log.length > 500) this.log.shift();
  }

  frames(client) { return this.worlds.map((w, i) => this.frame(w, i, client)); }

  frame(w, i, client) {
    const sent = client.sent[i], parts = [{ utime: w.utime }, part.pose(w), part.paths(w, sent.path, sent.keyframe), part.seen(w), part.numbers(w)];
    const slots = sent.isNew ? null : this.changes[i].filter(([t]) => t > sent.tick).flatMap(([, s]) => s);
    if (slots === null || slots.length) parts.push(part.landmarks(w, slots && [...new Set(slots)], w.counts));
    if (sent.isNew) parts.push(part.overlays(w), { reset: true });
    if (sent.isNew || this.ticks % 10 === 0 || this.isNews) parts.push(part.processes(w, this.ill));
    if (client.overlays?.includes("hierarchy") && (!sent.edges || this.ticks - sent.edges > 20)) {
      parts.push(part.hierarchy(w));
      sent.edges = this.ticks;
    }
    const lines = this.logged - sent.log;
    if (i === 0 && lines > 0) parts.push({ log: this.log.slice(-lines) });
    if (this.player) parts.push({ player: this.player });
    parts.push({ verdict: this.verdict ?? (w.status === 6 ? { state: "unsure", text: "By odometry alone: too few landmarks match.", since_utime: w.utime - 4_000_000 } : { state: "ok", text: "Localised in the map.", since_utime: w.utime - 95_000_000 }) });
    Object.assign(sent, { tick: this.ticks, path: w.path.x.length, keyframe: w.keyframes.x.length, log: this.logged, isNew: false });
    return merge({ run: i }, ...parts);
  }

  take(message, client) {
    if (message.overlays) client.overlays = message.overlays;
    if (message.play && this.player) Object.assign(this.player, message.play);
    if (message.seek && this.player) this.seek = message.seek;
    if (message.ask) return { kind: "story", request: message.request, ok: true, story: part.story(this.worlds[message.run ?? 0], message) };
    return null;
  }

  /** Told to every client with the next frame. */
  setIll(name, state) { this.ill[name] = state; this.isNews = true; }

  setLost(isLost) {
    this.status = isLost ? 7 : undefined;
    this.verdict = isLost ? { state: "lost", text: "Lost: no landmark of the map matches. Stop.", since_utime: this.worlds[0].utime } : null;
  }
}

/** A path of many poses at once: rings that wander over the map. */
function synthesise(w, n) {
  const { x, y, theta, sigma, status, utime } = w.path;
  for (let i = 0; i < n; i++) {
    const a = i * 0.00004, r = w.size * (0.1 + 0.35 * (i / n));
    x.push(r * Math.cos(a * 9)); y.push(r * Math.sin(a * 9) * 0.9); theta.push(a); sigma.push(0.1 + 0.05 * Math.sin(i * 0.001)); status.push(i % 40000 > 38000 ? 6 : 5); utime.push(w.utime - (n - i) * 1e5);
    w.truth.x.push(x[i]); w.truth.y.push(y[i]);
  }
}

/** A stored map of four versions. */
export class StoredMap {
  constructor({ landmarks = 900 } = {}) {
    this.world = new World({ landmarks, size: 260, known: true });
    this.world.advance();
    this.revisions = [1, 2, 3, 4].map((version) => ({ version, utime: this.world.utime - (4 - version) * 86400e6 * 9, text: ["survey of the stand", "drive of the morning", "two trunks of the survey taken back", "drive after the storm"][version - 1], landmarks: landmarks - 40 * (4 - version) }));
    this.shown = { version: 4, base: 3 };
  }

  hello() { return { kind: "hello", version: "mock", mode: "map", runs: [{ name: "version", colour_index: 0 }, { name: "base", colour_index: 1 }], revisions: this.revisions }; }
  start(client) { client.isTold = false; }
  tick() {}

  frames(client) {
    if (client.isTold) return [];
    client.isTold = true;
    return [this.shown.version, this.shown.base].map((v, i) => merge({ run: i, reset: true, utime: this.world.utime, revision: this.shown }, this.landmarksOf(v)));
  }

  /** Each version has a few more landmarks, and lacks some of before. */
  landmarksOf(v) {
    const w = this.world, has = (i) => i < w.n - 40 * (4 - v) && (i * 7919) % 61 !== v;
    return part.landmarks(w, [...Array(w.n).keys()].filter(has));
  }

  take(message, client) {
    if (message.revision) {
      this.shown = { version: message.revision, base: message.base };
      client.isTold = false;
    }
    return message.ask ? { kind: "story", request: message.request, ok: true, story: part.story(this.world, message) } : null;
  }
}
