// The makers' client connects with both names of the protocol, subscribes to everything, and what it
// gets agrees with the advertised schemas.
"use strict";
const assert = require("node:assert");
const { spawn } = require("node:child_process");
const { once } = require("node:events");
const { createInterface } = require("node:readline");
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");
const { validate } = require("./schemas");

const [peer, log] = process.argv.slice(2);
const wantedMessages = 3000;
const wantedTopics = 23; // All but the pose of a reference system.

function receive(client, socket) {
  const channels = new Map();
  const bySubscription = new Map();
  const seen = { messages: 0, topics: new Set(), statuses: [] };
  return new Promise((resolve, reject) => {
    client.on("error", reject);
    client.on("close", () => reject(new Error(`closed after ${seen.messages} messages`)));
    client.on("serverInfo", (info) => assert.deepEqual(info.capabilities, []));
    client.on("status", (status) => seen.statuses.push(status));
    client.on("advertise", (list) => {
      for (const channel of list) {
        channels.set(channel.id, { ...channel, parsed: JSON.parse(channel.schema) });
        bySubscription.set(client.subscribe(channel.id), channel.id);
      }
      client.getParameters([], "none"); // Not offered: answered, and nothing else happens.
    });
    client.on("message", ({ subscriptionId, timestamp, data }) => {
      const channel = channels.get(bySubscription.get(subscriptionId));
      try {
        validate(channel.schemaName, channel.parsed, JSON.parse(new TextDecoder().decode(data)));
        assert.ok(timestamp > 1_600_000_000_000_000_000n);
      } catch (error) {
        reject(error);
      }
      seen.messages += 1;
      seen.topics.add(channel.topic);
      if (seen.messages >= wantedMessages && seen.topics.size === wantedTopics) resolve({ ...seen, channels: channels.size });
    });
    socket.on("unexpected-response", (_, response) => reject(new Error(`status ${response.statusCode}`)));
  });
}

async function check(subprotocol) {
  const server = spawn(peer, ["serve", log], { stdio: ["ignore", "pipe", "inherit"] });
  try {
    const [port] = await once(createInterface({ input: server.stdout }), "line");
    const socket = new WebSocket(`ws://127.0.0.1:${port}/foxglove`, [subprotocol]);
    const client = new FoxgloveClient({ ws: socket });
    const seen = await receive(client, socket);
    assert.equal(socket.protocol, subprotocol);
    assert.equal(seen.channels, 24);
    assert.equal(seen.statuses.length, 1);
    console.log(`${subprotocol}: ${seen.messages} messages of ${seen.topics.size} topics`);
    socket.terminate();
  } finally {
    server.kill();
  }
}

async function main() {
  for (const subprotocol of ["foxglove.websocket.v1", "foxglove.sdk.v1"]) await check(subprotocol);
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
