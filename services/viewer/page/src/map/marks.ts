// Markers of few instances: the vehicle, detections, what was expected and not seen, what is chosen or measured.
import type * as THREE from "three";
import { Batch, material, type Colour } from "./gl";

export const shape = { disk: 0, ring: 1, cross: 2, arrow: 3, square: 4, fan: 5, diamond: 6 } as const;

const vertex = `
in vec2 corner; in vec2 place; in vec2 turn; in vec2 size; in vec4 tint; in vec2 look;
out vec2 vAt; out vec4 vTint; flat out vec3 vLook;
void main() {
  float radius = size.x * uScreen.w + size.y * uScreen.z, reach = radius + 2.0;
  vec2 at = vec2(corner.x * 2.0 - 1.0, corner.y) * reach;
  vAt = at; vTint = tint; vLook = vec3(look, radius);
  vec2 p = toPixel(place) + vec2(turn.x * at.x - turn.y * at.y, turn.y * at.x + turn.x * at.y);
  gl_Position = fromPixel(p);
}`;
// Signed distances in pixels, negative inside; the arrow looks along x.
const fragment = `
in vec2 vAt; in vec4 vTint; flat in vec3 vLook;
float stroke() { return 1.1 * uScreen.w; }
void main() {
  float kind = vLook.x, r = vLook.z, d, fade = 1.0;
  vec2 p = vAt, q = abs(vAt);
  if (kind < 0.5) d = length(p) - r;
  else if (kind < 1.5) d = abs(length(p) - r) - stroke();
  else if (kind < 2.5) { d = abs(q.x - q.y) * 0.7071 - stroke(); d = max(d, max(q.x, q.y) - r); }
  else if (kind < 3.5) {
    float edge = dot(vec2(p.x - r, q.y), vec2(0.42, 0.91));
    float notch = 0.55 * r - p.x - r - 0.9 * q.y + 0.15 * r;
    d = max(edge, notch);
  }
  else if (kind < 4.5) d = abs(max(q.x, q.y) - r) - stroke();
  else if (kind < 5.5) {
    float a = atan(p.y, p.x);
    d = max(length(p) - r, (abs(a) - vLook.y) * length(p)); fade = 1.0 - clamp(length(p) / r, 0.0, 1.0);
  }
  else d = abs(q.x + q.y - r) * 0.7071 - stroke();
  float alpha = clamp(0.5 - d, 0.0, 1.0) * fade;
  if (alpha < 0.01) discard;
  colour = vec4(vTint.rgb, vTint.a * alpha);
}`;

export class Marks extends Batch {
  constructor(scene: THREE.Scene, order: number) {
    super(scene, order, material(vertex, fragment), [["place", 2], ["turn", 2], ["size", 2], ["tint", 4], ["look", 2]]);
  }

  /** Radius = `px` CSS pixels + `m` metres. */
  mark(kind: number, x: number, y: number, px: number, m: number, c: Colour, alpha = 1, theta = 0, opening = 0): void {
    const o = this.place(), d = this.data;
    d[o] = x; d[o + 1] = y; d[o + 2] = Math.cos(theta); d[o + 3] = Math.sin(theta); d[o + 4] = px; d[o + 5] = m;
    d[o + 6] = c[0]; d[o + 7] = c[1]; d[o + 8] = c[2]; d[o + 9] = alpha; d[o + 10] = kind; d[o + 11] = opening;
  }
}
