// Covariance ellipses of 3 sigma. The axes follow from the covariance in the shader; an ellipse of a few pixels fades out.
import type * as THREE from "three";
import { Batch, material, type Colour } from "./gl";

const vertex = `
in vec2 corner; in vec2 place; in vec3 cov; in vec4 tint;
out vec2 vAt; out vec4 vTint; flat out vec2 vAxes;
void main() {
  float mean = 0.5 * (cov.x + cov.z), spread = length(vec2(0.5 * (cov.x - cov.z), cov.y));
  vec2 axes = 3.0 * sqrt(max(vec2(mean + spread, mean - spread), 0.0)) * uScreen.z;
  float turn = 0.5 * atan(2.0 * cov.y, cov.x - cov.z);
  vec2 at = vec2(corner.x * 2.0 - 1.0, corner.y) * (axes + 2.0);
  vAt = at; vAxes = max(axes, 0.5);
  vTint = vec4(tint.rgb, tint.a * smoothstep(3.0, 7.0, axes.x / uScreen.w));
  float c = cos(turn), s = sin(turn);
  gl_Position = vTint.a > 0.0 ? fromPixel(toPixel(place) + vec2(c * at.x - s * at.y, s * at.x + c * at.y)) : vec4(2.0, 2.0, 2.0, 1.0);
}`;
const fragment = `
in vec2 vAt; in vec4 vTint; flat in vec2 vAxes;
void main() {
  vec2 q = vAt / vAxes;
  float k = length(q), slope = length(q / vAxes) / max(k, 1e-6);
  float d = (k - 1.0) / max(slope, 1e-6);
  float line = clamp(1.1 * uScreen.w - abs(d), 0.0, 1.0), fill = d < 0.0 ? 0.10 : 0.0;
  float alpha = max(line * 0.9, fill);
  if (alpha < 0.01) discard;
  colour = vec4(vTint.rgb, vTint.a * alpha);
}`;

export class Ellipses extends Batch {
  constructor(scene: THREE.Scene, order: number) {
    super(scene, order, material(vertex, fragment), [["place", 2], ["cov", 3], ["tint", 4]], 1024);
  }

  ellipse(x: number, y: number, xx: number, xy: number, yy: number, c: Colour, alpha = 1): void {
    const o = this.place(), d = this.data;
    d[o] = x; d[o + 1] = y; d[o + 2] = xx; d[o + 3] = xy; d[o + 4] = yy;
    d[o + 5] = c[0]; d[o + 6] = c[1]; d[o + 7] = c[2]; d[o + 8] = alpha;
  }
}
