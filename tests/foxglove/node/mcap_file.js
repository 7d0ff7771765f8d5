// An MCAP file as @mcap/core reads it.
"use strict";
const { readFileSync } = require("node:fs");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const zstd = require("@foxglove/wasm-zstd");

/** For chunks; wants zstd to be loaded. */
const decompressHandlers = { zstd: (packed, size) => zstd.decompress(packed, Number(size)) };

/** A file in memory, as the indexed reader wants it. */
class Bytes {
  constructor(path) {
    this.bytes = readFileSync(path);
  }
  async size() {
    return BigInt(this.bytes.byteLength);
  }
  async read(offset, length) {
    return new Uint8Array(this.bytes.subarray(Number(offset), Number(offset + length)));
  }
}

/** By the index at its end. */
async function openIndexed(path) {
  await zstd.isLoaded;
  return McapIndexedReader.Initialize({ readable: new Bytes(path), decompressHandlers });
}

/** All records from front to back, checksums compared; in pieces, as from a network. */
async function* streamed(path) {
  await zstd.isLoaded;
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const bytes = readFileSync(path);
  for (let at = 0; at < bytes.byteLength; at += 10007) {
    reader.append(new Uint8Array(bytes.subarray(at, at + 10007)));
    for (let record = reader.nextRecord(); record; record = reader.nextRecord()) yield record;
  }
  if (!reader.done()) throw new Error("the file ends too early");
}

module.exports = { openIndexed, streamed };
