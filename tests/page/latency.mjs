// Latencies out of an lcm-log: receipt minus the stamp of the sweep, per channel.
import { readFileSync } from "node:fs";

/** Receipt times by stamp [us] of each channel in `wanted`, as Map of Maps. Stamps are the first field of our types. */
export function receipts(log, wanted) {
  const bytes = readFileSync(log), found = new Map(wanted.map((name) => [name, new Map()]));
  for (let at = 0; at + 28 <= bytes.length; ) {
    const received = Number(bytes.readBigInt64BE(at + 12));
    const name = bytes.readUInt32BE(at + 20), length = bytes.readUInt32BE(at + 24), data = at + 28 + name;
    if (bytes.readUInt32BE(at) !== 0xeda1da01) throw new Error(`${log}: no event at byte ${at}`);
    if (data + length > bytes.length) break;
    const stamps = found.get(bytes.toString("latin1", at + 28, data));
    const utime = stamps && Number(bytes.readBigInt64BE(data + 8));
    if (stamps && !stamps.has(utime)) stamps.set(utime, received);
    at = data + length;
  }
  return found;
}

export function summary(values_us) {
  const sorted = [...values_us].sort((a, b) => a - b);
  const at = (share) => +(sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] / 1000).toFixed(1);
  return sorted.length ? { count: sorted.length, p50_ms: at(0.5), p90_ms: at(0.9), p99_ms: at(0.99), worst_ms: at(1) } : { count: 0 };
}

/** Stamps are simulated time: what came soonest of GROUND_TRUTH came at once. */
export function clockOffset(found) {
  let least = Infinity;
  for (const [utime, received] of found.get("GROUND_TRUTH")) least = Math.min(least, received - utime);
  return least;
}

/** Of one channel: from the stamp on, and from the moment on when the simulator itself had got that far. */
export function latencies(found, channel, during = () => true) {
  const offset = clockOffset(found), truth = [...found.get("GROUND_TRUTH")].sort((a, b) => a[0] - b[0]);
  const whole = [], own = [];
  let next = 0;
  for (const [utime, received] of [...found.get(channel)].sort((a, b) => a[0] - b[0])) {
    if (!during(received)) continue;
    whole.push(received - utime - offset);
    while (next < truth.length && truth[next][0] < utime) next++;
    if (next < truth.length) own.push(received - Math.max(truth[next][1], utime + offset));
  }
  return { from_stamp: summary(whole), from_simulator: summary(own) };
}
