// The binary messages of services/viewer/protocol.md, decoded without copying: the arrays are views into the message.

export type Numbers = Uint8Array | Uint32Array | Float32Array | Float64Array;
export type Arrays = Record<string, Numbers | undefined>;

export interface Revision { version: number; utime: number; text: string; landmarks: number }
export interface Hello {
  kind: "hello"; version: string; mode: "live" | "log" | "map";
  runs: { name: string; colour_index: number }[];
  log?: { from: number; to: number }; revisions?: Revision[]; foxglove?: boolean;
}
export interface Pose {
  utime: number; map_id: number; x: number; y: number; theta: number; covariance: number[]; status: string;
  is_sure: boolean; is_provisional: boolean; submap_id: number; correction_version: number;
}
export type VerdictState = "waiting" | "ok" | "unsure" | "lost" | "silent";
export interface Verdict { state: VerdictState; text: string; since_utime: number }
export interface Planar { x: number; y: number; theta: number }
export interface Range { first: number; total: number }
export interface Matches extends Planar { keyframe_seq: number; status: string; reason: string; expected: number }
export interface Submap extends Planar { id: number; outline: [number, number][] }
export interface Closure {
  id: number; source: string; status: string; reason: string; from: [number, number]; to: [number, number];
}
export interface Channel {
  channel: string; is_output: boolean; rate_hz: number; messages: number; lost: number; malformed: number;
  dropped: number; last_utime: number;
}
export interface Process {
  name: string; state: string; silent_s: number; uptime_s: number; version: string;
  latency_p50_us: number; latency_p90_us: number; latency_p99_us: number; latency_max_us: number;
  rss_bytes: number; cpu_share: number | null; handled: number; message_utime: number;
  last_error_code: string; last_error: string; reasons: [string, string, number][]; channels: Channel[];
}
export type NumberName = "error_m" | "error_deg" | "nees" | "nis" | "nis_dof" | "rate_hz" | "latency_ms" |
  "missing_share" | "new_share" | "is_mapping_needed" | "clients" | "page_ms" | "page_p99_ms";
export type NumberValues = Partial<Record<NumberName, number | boolean | null>>;
export interface LogLine {
  utime: number; process: string; level: "debug" | "info" | "warning" | "error"; channel: string; code: string;
  text: string;
}
export interface PlayerState { utime: number; from: number; to: number; rate: number; is_playing: boolean }
export interface Frame {
  kind: "frame"; run: number; seq: number; wall_ms: number; skipped: number;
  reset?: boolean; utime?: number;
  landmarks?: { slots: number; used: number; unused: number };
  path?: Range; keyframes?: Range; truth_path?: Range;
  pose?: Pose | null; verdict?: Verdict; truth?: Planar | null; scan?: { utime: number } | null;
  matches?: Matches | null; hierarchy?: { levels: number } | null; submaps?: Submap[]; closures?: Closure[];
  processes?: Process[]; numbers?: NumberValues; log?: LogLine[]; player?: PlayerState;
  revision?: { version: number; base: number };
}
export interface Story {
  title?: string; facts?: [string, string | number][]; events?: [number, string][];
  series?: { name: string; unit: string; t: number[]; v: (number | null)[] }[];
  seen_from?: [number, number][]; steps?: { name: string; text: string; ms: number }[];
}
export interface StoryAnswer { kind: "story"; request: number; ok: boolean; error?: string; story?: Story }
export interface Message { header: Hello | Frame | StoryAnswer; arrays: Arrays }

const text = new TextDecoder();

const views = {
  u8: (b: ArrayBuffer, at: number, n: number) => new Uint8Array(b, at, n),
  u32: (b: ArrayBuffer, at: number, n: number) => new Uint32Array(b, at, n),
  f32: (b: ArrayBuffer, at: number, n: number) => new Float32Array(b, at, n),
  f64: (b: ArrayBuffer, at: number, n: number) => new Float64Array(b, at, n),
};
const widths = { u8: 1, u32: 4, f32: 4, f64: 8 };

/** Throws RangeError or SyntaxError when the message is not of the protocol. */
export function decode(buffer: ArrayBuffer): Message {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(text.decode(new Uint8Array(buffer, 4, length)));
  const arrays: Arrays = {};
  let at = 4 + length;

  for (const [name, type, count] of (header.arrays ?? []) as [string, keyof typeof views, number][]) {
    at = (at + 7) & ~7;
    if (!(type in views)) throw new RangeError(`array ${name} has the unknown type ${type}`);
    arrays[name] = views[type](buffer, at, count);
    at += widths[type] * count;
  }
  return { header, arrays };
}
