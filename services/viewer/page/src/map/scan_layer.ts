// The points of the newest scan, in the frame of the vehicle; the pose is applied on the GPU.
import * as THREE from "three";
import type { Palette } from "../theme";
import type { Run } from "../store/run";
import { addMesh, material, uColour } from "./gl";

const vertex = `
in vec3 point; uniform vec4 uPose; out float vHeight;
void main() {
  vec2 p = uPose.xy + vec2(uPose.z * point.x - uPose.w * point.y, uPose.w * point.x + uPose.z * point.y);
  vHeight = point.z;
  gl_PointSize = clamp(0.08 * uScreen.z, 1.5, 3.0) * uScreen.w;
  gl_Position = fromPixel(toPixel(p));
}`;
const fragment = `
in float vHeight; uniform vec3 uColour;
void main() { colour = vec4(uColour, clamp(0.45 + 0.15 * vHeight, 0.25, 0.8)); }`;

export class ScanLayer {
  private readonly uniforms = { uPose: { value: new THREE.Vector4(0, 0, 1, 0) }, uColour: uColour() };
  private readonly points = new THREE.Points(new THREE.BufferGeometry(), material(vertex, fragment, this.uniforms));
  private data = new Float32Array(0);
  private attribute: THREE.BufferAttribute | null = null;
  private version = -1;
  private from: Run | null = null;

  constructor(scene: THREE.Scene, order: number) { addMesh(scene, this.points, order); }

  paint(p: Palette): void { this.uniforms.uColour.value.set(...p.scan); }

  update(run: Run, isShown: boolean): void {
    const n = run.scan.x.length;
    this.points.visible = isShown && n > 0 && run.pose !== null;
    if (!this.points.visible) return;
    const pose = run.pose!;
    this.uniforms.uPose.value.set(pose.x, pose.y, Math.cos(pose.theta), Math.sin(pose.theta));
    if (run === this.from && run.version.scan === this.version) return;
    this.from = run;
    this.version = run.version.scan;
    this.reserve(n);
    for (let i = 0; i < n; i++) {
      this.data[3 * i] = run.scan.x[i];
      this.data[3 * i + 1] = run.scan.y[i];
      this.data[3 * i + 2] = run.scan.z[i] ?? 0;
    }
    this.attribute!.addUpdateRange(0, 3 * n);
    this.attribute!.needsUpdate = true;
    this.points.geometry.setDrawRange(0, n);
  }

  private reserve(n: number): void {
    if (this.data.length >= 3 * n) return;
    this.data = new Float32Array(3 * Math.max(2048, 2 ** Math.ceil(Math.log2(n))));
    this.points.geometry.dispose();
    this.points.geometry = new THREE.BufferGeometry();
    this.attribute = new THREE.BufferAttribute(this.data, 3);
    this.attribute.setUsage(THREE.DynamicDrawUsage);
    this.points.geometry.setAttribute("point", this.attribute);
  }
}
