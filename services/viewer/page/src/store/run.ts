// What the page knows of one run: a frame replaces the fields that it has.
import type * as P from "../protocol";
import { Landmarks } from "./landmarks";
import { TimeTable } from "./ring";
import { Track } from "./track";

export interface Scan { x: Float32Array; y: Float32Array; z: Float32Array }
export interface Detections { x: Float32Array; y: Float32Array; radius: Float32Array; kind: Uint8Array }
export interface Hierarchy { a: Uint32Array; b: Uint32Array; level: Uint8Array }

/** Columns of `Run.history` after the time. */
export const plotted = ["error_m", "nees", "nis", "nis_dof", "latency_ms", "rate_hz", "sigma_m", "page_ms"] as const;
export const logLength = 500;

const noFloats = new Float32Array(0), noSlots = new Uint32Array(0), noBytes = new Uint8Array(0);

export class Run {
  utime = 0;
  frames = 0;
  skipped = 0;
  readonly landmarks = new Landmarks();
  readonly path = new Track();
  readonly keyframes = new Track();
  readonly truthPath = new Track();
  pose: P.Pose | null = null;
  verdict: P.Verdict | null = null;
  truth: P.Planar | null = null;
  scan: Scan = { x: noFloats, y: noFloats, z: noFloats };
  detections: Detections = { x: noFloats, y: noFloats, radius: noFloats, kind: noBytes };
  matches: P.Matches | null = null;
  matchSlots: Uint32Array = noSlots;
  unseenSlots: Uint32Array = noSlots;
  hierarchy: Hierarchy = { a: noSlots, b: noSlots, level: noBytes };
  submaps: P.Submap[] = [];
  closures: P.Closure[] = [];
  processes: P.Process[] = [];
  processesHeard = 0;
  numbers: P.NumberValues = {};
  log: P.LogLine[] = [];
  logVersion = 0;
  revision: { version: number; base: number } | null = null;
  readonly history = new TimeTable(1200, 1 + plotted.length);
  /** Counts of changes of what the map draws, each compared by its layer. */
  readonly version = { pose: 0, scan: 0, matches: 0, hierarchy: 0, overlays: 0 };

  constructor(readonly index: number, readonly name: string, readonly colourIndex: number) {}

  apply(frame: P.Frame, arrays: P.Arrays): void {
    if (frame.reset) this.reset();
    this.frames++;
    this.skipped = frame.skipped;
    if (frame.utime !== undefined) this.utime = frame.utime;
    if (frame.landmarks) this.landmarks.apply(frame.landmarks, arrays);
    this.applyPaths(frame, arrays);
    this.applyPose(frame);
    this.applySeen(frame, arrays);
    this.applyOverlays(frame, arrays);
    this.applyHealth(frame);
  }

  private applyPaths(frame: P.Frame, a: P.Arrays): void {
    if (frame.path && a.path_x && a.path_y) {
      this.path.replace(frame.path.first, a.path_x, a.path_y, a.path_sigma, a.path_status, a.path_utime);
    }
    if (frame.keyframes && a.keyframe_x && a.keyframe_y) {
      this.keyframes.replace(frame.keyframes.first, a.keyframe_x, a.keyframe_y, undefined, undefined, a.keyframe_utime);
    }
    if (frame.truth_path && a.truth_x && a.truth_y) {
      this.truthPath.replace(frame.truth_path.first, a.truth_x, a.truth_y);
    }
  }

  private applyPose(frame: P.Frame): void {
    if (frame.pose !== undefined) this.pose = frame.pose;
    if (frame.truth !== undefined) this.truth = frame.truth;
    if (frame.pose !== undefined || frame.truth !== undefined) this.version.pose++;
    if (frame.verdict) this.verdict = frame.verdict;
  }

  private applySeen(frame: P.Frame, a: P.Arrays): void {
    if (frame.scan !== undefined) {
      // Copies: a view would keep the whole message, and with it a large map, alive.
      this.scan = { x: floats(a.scan_x), y: floats(a.scan_y), z: floats(a.scan_z) };
      this.detections = {
        x: floats(a.detection_x), y: floats(a.detection_y), radius: floats(a.detection_radius),
        kind: (a.detection_kind as Uint8Array | undefined)?.slice() ?? noBytes,
      };
      this.version.scan++;
    }
    if (frame.matches !== undefined) {
      this.matches = frame.matches;
      this.matchSlots = slots(a.match_slot);
      this.unseenSlots = slots(a.unseen_slot);
      this.version.matches++;
    }
  }

  private applyOverlays(frame: P.Frame, a: P.Arrays): void {
    if (frame.hierarchy !== undefined) {
      const level = (a.edge_level as Uint8Array | undefined)?.slice() ?? noBytes;
      this.hierarchy = { a: slots(a.edge_a), b: slots(a.edge_b), level };
      this.version.hierarchy++;
    }
    if (frame.submaps) this.submaps = frame.submaps;
    if (frame.closures) this.closures = frame.closures;
    if (frame.submaps || frame.closures) this.version.overlays++;
    if (frame.revision) this.revision = frame.revision;
  }

  private applyHealth(frame: P.Frame): void {
    if (frame.processes) {
      this.processes = frame.processes;
      this.processesHeard = Date.now();
    }
    if (frame.log?.length) {
      this.log.push(...frame.log.slice(-logLength));
      if (this.log.length > logLength) this.log.splice(0, this.log.length - logLength);
      this.logVersion++;
    }
    if (!frame.numbers) return;
    this.numbers = { ...this.numbers, ...frame.numbers };
    const row = plotted.map((name) => {
      if (name === "sigma_m") return this.pose ? largestSigma(this.pose) : null;
      return asNumber(this.numbers[name]);
    });
    this.history.push([this.utime / 1e6, ...row]);
  }

  private reset(): void {
    this.landmarks.clear();
    this.path.clear();
    this.keyframes.clear();
    this.truthPath.clear();
    this.pose = this.truth = this.matches = null;
    this.scan = { x: noFloats, y: noFloats, z: noFloats };
    this.detections = { x: noFloats, y: noFloats, radius: noFloats, kind: noBytes };
    this.matchSlots = this.unseenSlots = noSlots;
    this.hierarchy = { a: noSlots, b: noSlots, level: noBytes };
    this.submaps = [];
    this.closures = [];
    this.history.clear();
    for (const k of Object.keys(this.version) as (keyof Run["version"])[]) this.version[k]++;
  }
}

function floats(a: P.Numbers | undefined): Float32Array { return (a as Float32Array | undefined)?.slice() ?? noFloats; }
function slots(a: P.Numbers | undefined): Uint32Array { return (a as Uint32Array | undefined)?.slice() ?? noSlots; }
function asNumber(v: number | boolean | null | undefined): number | null { return typeof v === "number" ? v : null; }

/** x y covariance in the frame of the map, from the pose's own, which is in the frame of the vehicle. */
export function mapCovariance(pose: P.Pose): [number, number, number] {
  const [a, b, , , d] = pose.covariance, c = Math.cos(pose.theta), s = Math.sin(pose.theta);
  return [c * c * a - 2 * c * s * b + s * s * d, c * s * (a - d) + (c * c - s * s) * b, s * s * a + 2 * c * s * b + c * c * d];
}

/** Largest standard deviation of a 2 x 2 covariance [m]. */
export function largestOf(xx: number, xy: number, yy: number): number {
  return Math.sqrt(Math.max(0, (xx + yy) / 2 + Math.hypot((xx - yy) / 2, xy)));
}

export function largestSigma(pose: P.Pose): number { return largestOf(pose.covariance[0], pose.covariance[1], pose.covariance[4]); }
