// @mcap/core reads the file in both ways, and every message agrees with its schema.
"use strict";
const assert = require("node:assert");
const { openIndexed, streamed } = require("./mcap_file");
const { validate } = require("./schemas");

const text = new TextDecoder();

/** From front to back: messages by channel, in the order of the file. */
async function readStream(path) {
  const schemas = new Map();
  const channels = new Map();
  const found = { messages: 0, chunkless: 0, byTopic: new Map(), end: 0 };
  for await (const record of streamed(path)) {
    if (record.type === "Schema") schemas.set(record.id, { name: record.name, schema: JSON.parse(text.decode(record.data)) });
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Footer") found.end += 1;
    if (record.type !== "Message") continue;
    const channel = channels.get(record.channelId);
    const { name, schema } = schemas.get(channel.schemaId);
    assert.equal(channel.messageEncoding, "json");
    validate(name, schema, JSON.parse(text.decode(record.data)));
    assert.equal(record.sequence, found.byTopic.get(channel.topic) ?? 0);
    found.byTopic.set(channel.topic, record.sequence + 1);
    found.messages += 1;
  }
  assert.equal(found.end, 1);
  return found;
}

/** By the index: in order of time, all of them, and those of one topic and a stretch of time. */
async function checkIndex(path, stream) {
  const reader = await openIndexed(path);
  assert.equal(reader.statistics.messageCount, BigInt(stream.messages));
  assert.ok(reader.chunkIndexes.length > 0);
  let last = 0n;
  const times = [];
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    assert.ok(message.logTime >= last, "order of time");
    last = message.logTime;
    if (reader.channelsById.get(message.channelId).topic === "/pose") times.push(message.logTime);
  }
  assert.equal(last, reader.statistics.messageEndTime);

  const [startTime, endTime] = [times[20], times[60]];
  let some = 0;
  for await (const message of reader.readMessages({ topics: ["/pose"], startTime, endTime })) {
    assert.equal(message.logTime, times[20 + some]);
    some += 1;
  }
  assert.equal(some, 41);
}

async function main() {
  const path = process.argv[2];
  const stream = await readStream(path);
  assert.equal(stream.byTopic.size, 23); // All but the pose of a reference system.
  await checkIndex(path, stream);
  console.log(`mcap: ${stream.messages} messages of ${stream.byTopic.size} topics agree with their schemas`);
}

main();
