// Straight lines of a width in pixels, solid or dashed: matches, closures, borders, rays, edges of hierarchies.
import type * as THREE from "three";
import { Batch, material, type Colour } from "./gl";

const vertex = `
in vec2 corner; in vec4 ends; in vec4 tint; in vec2 style;
out vec4 vTint; out float vAcross; out float vAlong; flat out vec2 vStyle;
void main() {
  vec2 a = toPixel(ends.xy), b = toPixel(ends.zw), d = b - a;
  float len = length(d), half_ = 0.5 * style.x * uScreen.w + 1.0;
  vec2 along = len > 0.0 ? d / len : vec2(1.0, 0.0);
  vAcross = corner.y * half_; vAlong = corner.x * len; vTint = tint; vStyle = style * uScreen.w;
  gl_Position = fromPixel(mix(a, b, corner.x) + vec2(-along.y, along.x) * vAcross);
}`;
const fragment = `
in vec4 vTint; in float vAcross; in float vAlong; flat in vec2 vStyle;
void main() {
  float alpha = clamp(0.5 * vStyle.x + 0.5 - abs(vAcross), 0.0, 1.0);
  if (vStyle.y > 0.0 && fract(vAlong / (2.0 * vStyle.y)) > 0.5) discard;
  colour = vec4(vTint.rgb, vTint.a * alpha);
}`;

export class Segments extends Batch {
  constructor(scene: THREE.Scene, order: number) {
    super(scene, order, material(vertex, fragment), [["ends", 4], ["tint", 4], ["style", 2]]);
  }

  line(ax: number, ay: number, bx: number, by: number, c: Colour, alpha = 1, width = 1.5, dash = 0): void {
    const o = this.place(), d = this.data;
    d[o] = ax; d[o + 1] = ay; d[o + 2] = bx; d[o + 3] = by;
    d[o + 4] = c[0]; d[o + 5] = c[1]; d[o + 6] = c[2]; d[o + 7] = alpha;
    d[o + 8] = width; d[o + 9] = dash;
  }
}
