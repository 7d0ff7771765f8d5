// Histories of fixed length: the page may stay open for weeks.

/** The latest `capacity` numbers, with quantiles. */
export class Ring {
  readonly values: Float64Array;
  private readonly sorted: Float64Array;
  private next = 0;
  length = 0;

  constructor(readonly capacity: number) {
    this.values = new Float64Array(capacity);
    this.sorted = new Float64Array(capacity);
  }

  push(value: number): void {
    this.values[this.next] = value;
    this.next = (this.next + 1) % this.capacity;
    if (this.length < this.capacity) this.length++;
  }

  clear(): void {
    this.next = this.length = 0;
  }

  /** NaN where there is nothing yet. */
  quantiles(...shares: number[]): number[] {
    if (this.length === 0) return shares.map(() => NaN);
    const part = this.sorted.subarray(0, this.length);
    part.set(this.values.subarray(0, this.length));
    part.sort();
    return shares.map((s) => part[Math.min(this.length - 1, Math.floor(s * this.length))]);
  }
}

/** Rows of numbers over time, for the plots: `columns[0]` is the time. */
export class TimeTable {
  readonly columns: (number | null)[][];

  constructor(readonly capacity: number, width: number) {
    this.columns = Array.from({ length: width }, () => []);
  }

  /** A row that goes back in time (a jump in the log) empties the table. */
  push(row: (number | null)[]): void {
    const times = this.columns[0];
    const last = times[times.length - 1];
    if (last !== undefined && last !== null && row[0]! < last) this.clear();
    if (last === row[0]) this.columns.forEach((c) => c.pop());
    // A quarter is dropped at once, so that a push does not move the whole table every time.
    if (times.length >= this.capacity) this.columns.forEach((c) => c.splice(0, this.capacity >> 2));
    this.columns.forEach((c, i) => c.push(row[i]));
  }

  clear(): void {
    this.columns.forEach((c) => (c.length = 0));
  }
}
