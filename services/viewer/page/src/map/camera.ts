// The view from above: which point of the map is in the middle, and how many pixels a metre has.

export interface Rect { x0: number; y0: number; x1: number; y1: number }
const minScale = 1e-4, maxScale = 4000;

export class Camera {
  x = 0;
  y = 0;
  scale = 8; // CSS pixels per metre
  width = 1;
  height = 1;
  ratio = 1; // device pixels per CSS pixel

  toMap(px: number, py: number): { x: number; y: number } {
    return { x: this.x + (px - this.width / 2) / this.scale, y: this.y - (py - this.height / 2) / this.scale };
  }

  toScreen(x: number, y: number): { x: number; y: number } {
    return { x: (x - this.x) * this.scale + this.width / 2, y: this.height / 2 - (y - this.y) * this.scale };
  }

  pan(dx: number, dy: number): void {
    this.x -= dx / this.scale;
    this.y += dy / this.scale;
  }

  /** What is under the pixel stays there. */
  zoom(factor: number, px: number, py: number): void {
    const before = this.toMap(px, py);
    this.scale = Math.min(maxScale, Math.max(minScale, this.scale * factor));
    const after = this.toMap(px, py);
    this.x += before.x - after.x;
    this.y += before.y - after.y;
  }

  fit(r: Rect): void {
    this.x = (r.x0 + r.x1) / 2;
    this.y = (r.y0 + r.y1) / 2;
    const margin = 0.9;
    this.scale = Math.min(40, margin * Math.min(this.width / Math.max(1, r.x1 - r.x0), this.height / Math.max(1, r.y1 - r.y0)));
  }

  /** What is seen, larger by `margin` of its size on each side. */
  seen(margin = 0): Rect {
    const w = this.width * (0.5 + margin) / this.scale, h = this.height * (0.5 + margin) / this.scale;
    return { x0: this.x - w, y0: this.y - h, x1: this.x + w, y1: this.y + h };
  }
}

export function contains(outer: Rect, inner: Rect): boolean {
  return outer.x0 <= inner.x0 && outer.y0 <= inner.y0 && outer.x1 >= inner.x1 && outer.y1 >= inner.y1;
}

export function grow(r: Rect | null, x0: number, y0: number, x1 = x0, y1 = y0): Rect {
  if (!r) return { x0, y0, x1, y1 };
  return { x0: Math.min(r.x0, x0), y0: Math.min(r.y0, y0), x1: Math.max(r.x1, x1), y1: Math.max(r.y1, y1) };
}
