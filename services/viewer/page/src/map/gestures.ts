// Mouse, wheel and fingers on the map.
import type { MapView } from "./map";

/** A press that moved less than this is a click [px]. */
const slack = 5;

export function listen(map: MapView, redraw: () => void, onClick: (px: number, py: number) => void, onPan: () => void): void {
  const canvas = map.canvas, fingers = new Map<number, { x: number; y: number }>();
  let moved = 0;

  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, { x: e.offsetX, y: e.offsetY });
    if (fingers.size === 1) moved = 0;
  });

  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const now = { x: e.offsetX, y: e.offsetY };
    moved += Math.abs(now.x - before.x) + Math.abs(now.y - before.y);
    if (fingers.size === 2) pinch(map, fingers, e.pointerId, now);
    else if (moved > slack) {
      map.camera.pan(now.x - before.x, now.y - before.y);
      if (map.isFollowing) onPan();
    }
    fingers.set(e.pointerId, now);
    redraw();
  });

  const release = (e: PointerEvent) => {
    if (!fingers.delete(e.pointerId)) return;
    if (e.type === "pointerup" && moved <= slack && fingers.size === 0) onClick(e.offsetX, e.offsetY);
  };
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);

  canvas.addEventListener("wheel", (e) => {
    e.preventDefault();
    const lines = e.deltaMode === 1 ? 16 : 1;
    const factor = Math.exp(-Math.max(-300, Math.min(300, e.deltaY * lines)) * 0.0016);
    // Followed, the vehicle stays in the middle whatever is under the cursor.
    if (map.isFollowing) map.camera.zoom(factor, map.camera.width / 2, map.camera.height / 2);
    else map.camera.zoom(factor, e.offsetX, e.offsetY);
    redraw();
  }, { passive: false });
}

function pinch(map: MapView, fingers: Map<number, { x: number; y: number }>, id: number, now: { x: number; y: number }): void {
  const before = fingers.get(id)!, other = [...fingers].find(([k]) => k !== id)![1];
  const was = Math.hypot(before.x - other.x, before.y - other.y), is = Math.hypot(now.x - other.x, now.y - other.y);
  if (was > 0 && is > 0) map.camera.zoom(is / was, (now.x + other.x) / 2, (now.y + other.y) / 2);
  map.camera.pan((now.x - before.x) / 2, (now.y - before.y) / 2);
}
