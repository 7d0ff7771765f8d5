// A message of the protocol from its header and arrays: {name: typed array}.
const types = new Map([[Uint8Array, "u8"], [Uint32Array, "u32"], [Float32Array, "f32"], [Float64Array, "f64"]]);

export function encode(header, arrays = {}) {
  const list = Object.entries(arrays);
  const text = Buffer.from(JSON.stringify({ ...header, arrays: list.map(([name, a]) => [name, types.get(a.constructor), a.length]) }));
  const padded = Math.ceil((4 + text.length) / 8) * 8 - 4;
  let size = 4 + padded;
  const places = list.map(([, a]) => {
    const at = Math.ceil(size / 8) * 8;
    size = at + a.byteLength;
    return at;
  });

  const out = Buffer.alloc(size);
  out.writeUInt32LE(padded, 0);
  out.fill(" ", 4, 4 + padded);
  text.copy(out, 4);
  list.forEach(([, a], i) => Buffer.from(a.buffer, a.byteOffset, a.byteLength).copy(out, places[i]));
  return out;
}
