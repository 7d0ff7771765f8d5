// A ROS 1 bag (not packed) as MCAP files and as CDR messages: node ros1_to_mcap.mjs BAG BEGIN
// Writes BEGIN_zstd.mcap, _lz4, _none, _bare (no index, no summary), _unchunked, _ros1, and BEGIN.cdr.
import { createRequire } from "module";
import fs from "fs";

const require = createRequire(process.cwd() + "/");
const { Bag } = require("@foxglove/rosbag");
const { FileReader } = require("@foxglove/rosbag/node");
const { MessageReader } = require("@foxglove/rosmsg-serialization");
const { parse } = require("@foxglove/rosmsg");
const { MessageWriter } = require("@foxglove/rosmsg2-serialization");
const { ros2humble } = require("@foxglove/rosmsg-msgs-common");
const { McapWriter } = require("@mcap/core");
const Zstd = require("@foxglove/wasm-zstd");
const lz4 = require("lz4js");

const ros2Name = (type) => (type.includes("/msg/") ? type : type.replace("/", "/msg/"));

// The definition of a type of ROS 2 and of those in it, the root first.
function definitionsOf(type) {
  const names = new Set();
  const list = [];
  const add = (name) => {
    if (names.has(name)) return;
    names.add(name);
    const found = ros2humble[name] ?? ros2humble[name.replace("/msg/", "/")];
    const fields = found.definitions.map((f) => (f.isComplex ? { ...f, type: ros2Name(f.type) } : f));
    list.push({ name, definitions: fields });
    for (const field of fields) if (field.isComplex) add(field.type);
  };
  add(ros2Name(type));
  return list;
}

// A message of ROS 1 as one of ROS 2: stamps have other names.
function toRos2(value) {
  if (ArrayBuffer.isView(value) || value === null || typeof value !== "object") return value;
  if (Array.isArray(value)) return value.map(toRos2);
  if ("nsec" in value && "sec" in value) return { sec: value.sec, nanosec: value.nsec };
  return Object.fromEntries(Object.entries(value).map(([key, field]) => [key, toRos2(field)]));
}

class File {
  constructor(path) { this.file = fs.openSync(path, "w"); this.size = 0n; }
  async write(bytes) { fs.writeSync(this.file, bytes); this.size += BigInt(bytes.byteLength); }
  position() { return this.size; }
}

await Zstd.isLoaded;
const [source, begin] = process.argv.slice(2);
const zstd = (bytes) => ({ compression: "zstd", compressedData: Zstd.compress(bytes, 3) });
const bare = { useStatistics: false, useSummaryOffsets: false, useChunkIndex: false, repeatSchemas: false, repeatChannels: false,
               useMessageIndex: false, useAttachmentIndex: false, useMetadataIndex: false };
const forms = {
  zstd: { compressChunk: zstd }, none: {}, bare: { compressChunk: zstd, ...bare }, unchunked: { useChunks: false },
  lz4: { compressChunk: (bytes) => ({ compression: "lz4", compressedData: lz4.compress(bytes) }) }, ros1: {},
};
const files = [];
for (const [name, options] of Object.entries(forms)) {
  const writer = new McapWriter({ writable: new File(`${begin}_${name}.mcap`), ...options });
  const isRos1 = name === "ros1";
  await writer.start({ profile: isRos1 ? "ros1" : "ros2", library: "@mcap/core" });
  files.push({ writer, isRos1, channels: new Map() });
}

const cdrFile = fs.openSync(`${begin}.cdr`, "w");
const bag = new Bag(new FileReader(source));
await bag.open();
const types = new Map();
for await (const { topic, connectionId, data, timestamp } of bag.messageIterator({})) {
  const { type, messageDefinition } = bag.connections.get(connectionId);
  if (!types.has(type)) {
    types.set(type, { reader: new MessageReader(parse(messageDefinition)), writer: new MessageWriter(definitionsOf(type)) });
  }
  const { reader, writer } = types.get(type);
  const cdr = writer.writeMessage(toRos2(reader.readMessage(data)));
  const time = BigInt(timestamp.sec) * 1000000000n + BigInt(timestamp.nsec);

  for (const file of files) {
    if (!file.channels.has(topic)) {
      const schemaId = await file.writer.registerSchema({
        name: file.isRos1 ? type : ros2Name(type), encoding: file.isRos1 ? "ros1msg" : "ros2msg",
        data: new TextEncoder().encode(messageDefinition) });
      file.channels.set(topic, await file.writer.registerChannel({
        schemaId, topic, messageEncoding: file.isRos1 ? "ros1" : "cdr", metadata: new Map() }));
    }
    await file.writer.addMessage({ channelId: file.channels.get(topic), sequence: 0, logTime: time, publishTime: time,
                                   data: file.isRos1 ? data : cdr });
  }
  fs.writeSync(cdrFile, JSON.stringify({ topic, type: ros2Name(type), t: time.toString(), n: cdr.byteLength }) + "\n");
  fs.writeSync(cdrFile, cdr);
}
for (const { writer } of files) await writer.end();
