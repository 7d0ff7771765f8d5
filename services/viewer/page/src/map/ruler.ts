// Distance and bearing between two places; between two landmarks with its standard deviation.
import { fixed, metres } from "../dom";
import type { Store } from "../store/store";
import type { Spot } from "./overlays";

export function measured(store: Store, [a, b]: Spot[]): string {
  const dx = b.x - a.x, dy = b.y - a.y, distance = Math.hypot(dx, dy);
  const bearing = ((Math.atan2(dy, dx) * 180) / Math.PI + 360) % 360;
  const sigmas = a.slot >= 0 && b.slot >= 0 && distance > 0 ? combined(store, a, b, dx / distance, dy / distance) : null;
  const length = distance < 100 ? `${distance.toFixed(2)} m` : metres(distance);
  if (!sigmas) return `${length}, bearing ${fixed(bearing, 1)}\u00b0`;
  const turn = (sigmas[1] / distance) * (180 / Math.PI);
  return `${length} \u00b1 ${metres(sigmas[0])}, bearing ${fixed(bearing, 1)}\u00b0 \u00b1 ${fixed(turn, 2)}\u00b0 (1 sigma)`;
}

/** Along and across the line, as if the two were independent: landmarks near each other are surer than this. */
function combined(store: Store, a: Spot, b: Spot, ux: number, uy: number): [number, number] {
  let along = 0, across = 0;
  for (const s of [a, b]) {
    const c = store.runs[s.run].landmarks.covariance, [xx, xy, yy] = c.subarray(3 * s.slot, 3 * s.slot + 3);
    along += ux * ux * xx + 2 * ux * uy * xy + uy * uy * yy;
    across += uy * uy * xx - 2 * ux * uy * xy + ux * ux * yy;
  }
  return [Math.sqrt(Math.max(0, along)), Math.sqrt(Math.max(0, across))];
}
