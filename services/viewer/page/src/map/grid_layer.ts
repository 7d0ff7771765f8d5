// Lines every 1, 2 or 5 times a power of ten metres; computed per pixel, so no lines are stored.
import * as THREE from "three";
import type { Palette } from "../theme";
import type { Camera } from "./camera";
import { addMesh, material } from "./gl";

const vertex = `in vec2 corner; void main() { gl_Position = vec4(corner, 0.0, 1.0); }`;
const fragment = `
uniform float uSpacing; uniform vec3 uMinor; uniform vec3 uMajor; uniform vec2 uOrigin;
float near(vec2 p, float step_) {
  vec2 d = abs(p - step_ * round(p / step_)) * uScreen.z;
  return 1.0 - smoothstep(0.5, 1.0, min(d.x, d.y));
}
void main() {
  vec2 p = uOrigin + (gl_FragCoord.xy - 0.5 * uScreen.xy) / uScreen.z;
  float major = near(p, 5.0 * uSpacing), minor = near(p, uSpacing);
  float alpha = max(major, minor);
  if (alpha < 0.01) discard;
  colour = vec4(major > 0.0 ? uMajor : uMinor, alpha);
}`;

export class GridLayer {
  private readonly mesh: THREE.Mesh;
  private readonly uniforms = {
    uSpacing: { value: 1 }, uOrigin: { value: new THREE.Vector2() },
    uMinor: { value: new THREE.Vector3() }, uMajor: { value: new THREE.Vector3() },
  };

  constructor(scene: THREE.Scene) {
    const g = new THREE.BufferGeometry();
    g.setAttribute("corner", new THREE.BufferAttribute(new Float32Array([-1, -1, 3, -1, -1, 3]), 2));
    g.setDrawRange(0, 3);
    this.mesh = new THREE.Mesh(g, material(vertex, fragment, this.uniforms));
    addMesh(scene, this.mesh, 0);
  }

  paint(p: Palette): void {
    this.uniforms.uMinor.value.set(...p.gridMinor);
    this.uniforms.uMajor.value.set(...p.gridMajor);
  }

  update(camera: Camera, isShown: boolean): void {
    this.mesh.visible = isShown;
    this.uniforms.uSpacing.value = niceStep(24 / camera.scale);
    // The origin is brought near zero, where a float has digits left for the lines.
    const period = 5 * this.uniforms.uSpacing.value;
    this.uniforms.uOrigin.value.set(camera.x % period, camera.y % period);
  }
}

/** The smallest of 1, 2, 5, 10, ... that is not less than `least`. */
export function niceStep(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  const digit = least / power;
  return power * (digit <= 1 ? 1 : digit <= 2 ? 2 : digit <= 5 ? 5 : 10);
}
