// The landmarks of one run, by slot, in typed arrays that double when they are full. What the GPU draws (`drawn`: x, y, radius,
// code) is the same memory that the page computes with; blocks of slots that changed are marked, so that only these are uploaded.
import type { Arrays, Numbers } from "../protocol";
import { CellGrid } from "./cell_grid";

export const there = 1, isCorner = 2, outOfUse = 4, ofGivenMap = 8;
/** Not of the protocol: in a comparison of two versions, the other one does not have it. */
export const onlyHere = 16;
export const blockSize = 512;

export class Landmarks {
  slots = 0;
  used = 0;
  unused = 0;
  capacity = 0;
  /** x, y [m], radius [m], code = 2 * flags + probability (1.5 = unknown). */
  drawn = new Float32Array(0);
  covariance = new Float32Array(0); // xx, xy, yy
  probability = new Float32Array(0);
  idLow = new Uint32Array(0);
  idHigh = new Uint32Array(0);
  seen = new Uint32Array(0);
  flags = new Uint8Array(0);
  readonly grid = new CellGrid();
  /** Grows with each change; whoever draws compares. */
  version = 0;
  dirty = new Uint8Array(0);

  clear(): void {
    this.flags.fill(0);
    this.grid.clear();
    this.slots = this.used = this.unused = 0;
    this.dirty.fill(1);
    this.version++;
  }

  apply(head: { slots: number; used: number; unused: number }, arrays: Arrays): void {
    this.reserve(head.slots);
    this.slots = Math.max(this.slots, head.slots);
    this.used = head.used;
    this.unused = head.unused;
    if (arrays.slot) this.setAll(arrays.slot as Uint32Array, arrays);
    this.version++;
  }

  idOf(slot: number): string {
    return ((BigInt(this.idHigh[slot]) << 32n) | BigInt(this.idLow[slot])).toString();
  }

  /** -1: no such landmark. Scans; for a click or a test, not for every picture. */
  slotOf(id: string): number {
    const value = BigInt(id), low = Number(value & 0xffffffffn), high = Number(value >> 32n);
    for (let s = 0; s < this.slots; s++) {
      if (this.idLow[s] === low && this.idHigh[s] === high && this.flags[s] & there) return s;
    }
    return -1;
  }

  setOnlyHere(slot: number, value: boolean): void {
    const flags = value ? this.flags[slot] | onlyHere : this.flags[slot] & ~onlyHere;
    if (flags === this.flags[slot]) return;
    this.flags[slot] = flags;
    this.encode(slot);
  }

  private setAll(slots: Uint32Array, arrays: Arrays): void {
    const { x, y, cxx, cxy, cyy, radius, probability, seen, flags, id_low, id_high } = arrays as Record<string, Numbers>;
    for (let i = 0; i < slots.length; i++) {
      const s = slots[i];
      if (s >= this.capacity) continue;
      this.flags[s] = flags[i];
      this.drawn[4 * s] = x[i];
      this.drawn[4 * s + 1] = y[i];
      this.drawn[4 * s + 2] = radius[i];
      this.covariance[3 * s] = cxx[i];
      this.covariance[3 * s + 1] = cxy[i];
      this.covariance[3 * s + 2] = cyy[i];
      this.probability[s] = probability[i];
      this.idLow[s] = id_low[i];
      this.idHigh[s] = id_high[i];
      this.seen[s] = seen[i];
      this.encode(s);
      if (this.flags[s] & there) this.grid.put(s, x[i], y[i]);
      else this.grid.remove(s);
    }
  }

  private encode(slot: number): void {
    const p = this.probability[slot];
    this.drawn[4 * slot + 3] = 2 * this.flags[slot] + (Number.isNaN(p) ? 1.5 : Math.min(1, Math.max(0, p)));
    this.dirty[(slot / blockSize) | 0] = 1;
  }

  private reserve(slots: number): void {
    if (slots <= this.capacity) return;
    let capacity = Math.max(1024, this.capacity);
    while (capacity < slots) capacity *= 2;
    const grown = <T extends Float32Array | Uint32Array | Uint8Array>(old: T, make: T): T => (make.set(old), make);
    this.drawn = grown(this.drawn, new Float32Array(4 * capacity));
    this.covariance = grown(this.covariance, new Float32Array(3 * capacity));
    this.probability = grown(this.probability, new Float32Array(capacity));
    this.idLow = grown(this.idLow, new Uint32Array(capacity));
    this.idHigh = grown(this.idHigh, new Uint32Array(capacity));
    this.seen = grown(this.seen, new Uint32Array(capacity));
    this.flags = grown(this.flags, new Uint8Array(capacity));
    this.dirty = new Uint8Array(Math.ceil(capacity / blockSize)).fill(1);
    this.grid.reserve(capacity);
    this.capacity = capacity;
  }
}
