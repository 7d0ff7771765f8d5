// Which landmarks are near a point, without a scan of all: slots chained per square cell, kept up to date as they move.

export const cellSize = 32; // [m]
const none = -1;

export class CellGrid {
  private heads = new Map<number, number>();
  private next = new Int32Array(0);
  private previous = new Int32Array(0);
  private cell = new Float64Array(0); // key of the slot's cell, NaN = in none

  reserve(capacity: number): void {
    const next = new Int32Array(capacity).fill(none), previous = new Int32Array(capacity).fill(none);
    const cell = new Float64Array(capacity).fill(NaN);
    next.set(this.next);
    previous.set(this.previous);
    cell.set(this.cell);
    this.next = next;
    this.previous = previous;
    this.cell = cell;
  }

  clear(): void {
    this.heads.clear();
    this.cell.fill(NaN);
  }

  put(slot: number, x: number, y: number): void {
    const key = keyOf(Math.floor(x / cellSize), Math.floor(y / cellSize));
    if (this.cell[slot] === key) return;
    this.remove(slot);
    const head = this.heads.get(key) ?? none;
    this.next[slot] = head;
    this.previous[slot] = none;
    if (head !== none) this.previous[head] = slot;
    this.heads.set(key, slot);
    this.cell[slot] = key;
  }

  remove(slot: number): void {
    const key = this.cell[slot];
    if (Number.isNaN(key)) return;
    const next = this.next[slot], previous = this.previous[slot];
    if (next !== none) this.previous[next] = previous;
    if (previous !== none) this.next[previous] = next;
    else if (next !== none) this.heads.set(key, next);
    else this.heads.delete(key);
    this.cell[slot] = NaN;
  }

  /**
   * Slots in the cells that the rectangle touches, into `out`; returns their number, or -1 when there are more than fit or more
   * cells than `maxCells`.
   */
  within(x0: number, y0: number, x1: number, y1: number, out: Uint32Array, maxCells = 6000): number {
    const i0 = Math.floor(x0 / cellSize), i1 = Math.floor(x1 / cellSize);
    const j0 = Math.floor(y0 / cellSize), j1 = Math.floor(y1 / cellSize);
    if ((i1 - i0 + 1) * (j1 - j0 + 1) > maxCells) return -1;
    let n = 0;
    for (let i = i0; i <= i1; i++) {
      for (let j = j0; j <= j1; j++) {
        for (let s = this.heads.get(keyOf(i, j)) ?? none; s !== none; s = this.next[s]) {
          if (n === out.length) return -1;
          out[n++] = s;
        }
      }
    }
    return n;
  }
}

function keyOf(i: number, j: number): number {
  return (i + 1048576) * 2097152 + (j + 1048576);
}
