// Which landmarks only one of two versions of a map has: by their ids, which never change.
import { there, type Landmarks } from "./store/landmarks";

export class Comparison {
  added = 0;
  removed = 0;
  private seen = "";

  /** Marks what is only in `now` and only in `base`; returns whether anything was done. */
  update(now: Landmarks, base: Landmarks): boolean {
    const key = `${now.version} ${base.version}`;
    if (key === this.seen) return false;
    this.added = mark(now, base);
    this.removed = mark(base, now);
    // Marking itself is a change, of the picture alone.
    now.version++;
    base.version++;
    this.seen = `${now.version} ${base.version}`;
    return true;
  }
}

function mark(of: Landmarks, against: Landmarks): number {
  const ids = new Map<number, Set<number>>();
  for (let s = 0; s < against.slots; s++) {
    if (!(against.flags[s] & there)) continue;
    const lows = ids.get(against.idHigh[s]);
    if (lows) lows.add(against.idLow[s]);
    else ids.set(against.idHigh[s], new Set([against.idLow[s]]));
  }
  let n = 0;
  for (let s = 0; s < of.slots; s++) {
    if (!(of.flags[s] & there)) continue;
    const isOnly = !ids.get(of.idHigh[s])?.has(of.idLow[s]);
    of.setOnlyHere(s, isOnly);
    if (isOnly) n++;
  }
  return n;
}
