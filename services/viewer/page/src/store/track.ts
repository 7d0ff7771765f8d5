// A path of any length in bounded memory: chunks of points with their bounds. When there are too many chunks, neighbours among the
// oldest are thinned to one, so old parts get coarser and the newest stay whole.
import type { Numbers } from "../protocol";

export const chunkSize = 4096;
const maxChunks = 512;

export class Chunk {
  n = 0;
  minX = Infinity; maxX = -Infinity; minY = Infinity; maxY = -Infinity;
  readonly data: Float32Array; // x, y [m], sigma [m], status
  readonly utime: Float64Array;
  /** Points `start`, `start + step`, ... of the path. */
  constructor(readonly start: number, readonly step: number) {
    this.data = new Float32Array(4 * chunkSize);
    this.utime = new Float64Array(chunkSize);
  }

  push(x: number, y: number, sigma: number, status: number, utime: number): void {
    const at = 4 * this.n;
    this.data[at] = x;
    this.data[at + 1] = y;
    this.data[at + 2] = sigma;
    this.data[at + 3] = status;
    this.utime[this.n++] = utime;
    if (x < this.minX) this.minX = x;
    if (x > this.maxX) this.maxX = x;
    if (y < this.minY) this.minY = y;
    if (y > this.maxY) this.maxY = y;
  }

  get end(): number { return this.start + this.n * this.step; }
}

export class Track {
  chunks: Chunk[] = [];
  total = 0;
  /** Grows when points that were there change; `total` alone grows when points are added. */
  rewritten = 0;
  maxSigma = 0;

  clear(): void {
    this.chunks = [];
    this.total = 0;
    this.rewritten++;
  }

  /** Replaces everything from index `first` on. */
  replace(first: number, x: Numbers, y: Numbers, sigma?: Numbers, status?: Numbers, utime?: Numbers): void {
    if (first < this.total) this.cut(first);
    let index = Math.max(first, this.total);
    for (let i = 0; i < x.length; i++, index++) {
      this.chunkFor(index).push(x[i], y[i], sigma ? sigma[i] : 0, status ? status[i] : 5, utime ? utime[i] : 0);
    }
    this.total = index;
    while (this.chunks.length > maxChunks) this.thin();
  }

  /** Nearest point within `radius`, or null. */
  nearest(x: number, y: number, radius: number): { x: number; y: number; utime: number } | null {
    let best = radius * radius, found = null;
    for (const c of this.chunks) {
      if (x < c.minX - radius || x > c.maxX + radius || y < c.minY - radius || y > c.maxY + radius) continue;
      for (let i = 0; i < c.n; i++) {
        const dx = c.data[4 * i] - x, dy = c.data[4 * i + 1] - y, d = dx * dx + dy * dy;
        if (d < best) {
          best = d;
          found = { x: c.data[4 * i], y: c.data[4 * i + 1], utime: c.utime[i] };
        }
      }
    }
    return found;
  }

  get length(): number { return this.chunks.reduce((n, c) => n + c.n, 0); }

  private chunkFor(index: number): Chunk {
    const last = this.chunks[this.chunks.length - 1];
    if (last && last.step === 1 && last.n < chunkSize && last.end === index) return last;
    const chunk = new Chunk(index, 1);
    this.chunks.push(chunk);
    return chunk;
  }

  private cut(first: number): void {
    while (this.chunks.length && this.chunks[this.chunks.length - 1].start >= first) this.chunks.pop();
    const last = this.chunks[this.chunks.length - 1];
    if (last && last.end > first) last.n = Math.ceil((first - last.start) / last.step);
    this.total = first;
    this.rewritten++;
  }

  /** Joins the first two neighbours of the same step, at half their density. */
  private thin(): void {
    let at = 0;
    while (at + 2 < this.chunks.length && this.chunks[at].step !== this.chunks[at + 1].step) at++;
    const [a, b] = [this.chunks[at], this.chunks[at + 1]];
    const joined = new Chunk(a.start, 2 * Math.max(a.step, b.step));
    for (const c of [a, b]) {
      for (let i = 0; i < c.n && joined.n < chunkSize; i += 2) {
        const [x, y, sigma, status] = c.data.subarray(4 * i, 4 * i + 4);
        joined.push(x, y, sigma, status, c.utime[i]);
      }
    }
    this.chunks.splice(at, 2, joined);
    this.rewritten++;
  }
}
