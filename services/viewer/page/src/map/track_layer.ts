// A path as a ribbon: the line and the band of its covariance. Of a long path at most `capacity` points are drawn: those in and near
// the view, thinned where there are more. New points are added at the end; the rest is chosen anew only when the view has left it.
import * as THREE from "three";
import type { Palette, Rgb } from "../theme";
import type { Chunk, Track } from "../store/track";
import { contains, type Camera, type Rect } from "./camera";
import { addMesh, material, uColour } from "./gl";

const capacity = 32768;
const stride = 6; // x, y, sigma, status, length so far, side
const perPoint = 2 * stride;
const sides = [[0, -1], [stride, 1]];

// Two corners a point; `before` and `after` are its neighbours in the same buffer: with them the ribbon has no gaps at its joints.
// Not instanced: 32,772 instances took a rasteriser in software 0.5 s and more.
const vertex = `
in vec4 before; in vec4 at; in vec4 after; in vec2 extra;
uniform float uWidth; uniform float uSigmas; uniform float uDepth;
flat out float vStatus; out float vAcross; out float vAlong; out float vHalf;
void main() {
  vec2 from = before.w < 0.0 ? at.xy : before.xy, to = after.w < 0.0 ? at.xy : after.xy, d = to - from;
  float len = length(d);
  vec2 along = len > 0.0 ? d / len : vec2(1.0, 0.0);
  vHalf = uSigmas > 0.0 ? min(uSigmas * at.z * uScreen.z, 4000.0) : 0.5 * uWidth * uScreen.w;
  vStatus = at.w; vAcross = extra.y * (vHalf + (uSigmas > 0.0 ? 0.0 : 1.0));
  vAlong = extra.x * uScreen.z;
  gl_Position = fromPixel(toPixel(at.xy) + vec2(-along.y, along.x) * vAcross);
  gl_Position.z = uDepth;
}`;
const fragment = `
flat in float vStatus; in float vAcross; in float vAlong; in float vHalf;
uniform vec3 uLine; uniform vec3 uWarn; uniform vec3 uBad; uniform float uAlpha; uniform float uSigmas; uniform float uDash;
void main() {
  if (vStatus < 0.0) discard;
  int status = int(vStatus + 0.5);
  bool isCoasting = status == 6, isLost = status == 2 || status == 3 || status == 4 || status == 7;
  vec3 c = isLost ? uBad : isCoasting ? uWarn : uLine;
  float alpha = uAlpha, dash = uDash;
  if (uSigmas == 0.0) {
    alpha *= clamp(vHalf + 0.5 - abs(vAcross), 0.0, 1.0);
    if (isCoasting) dash = 6.0; else if (isLost) dash = 3.0;
    if (dash > 0.0 && fract(vAlong / (2.0 * dash * uScreen.w)) > 0.5) alpha = 0.0;
  }
  colour = vec4(c, alpha);
}`;

/** Two triangles between neighbours; the last corner of each is of the later point, whose status colours the piece. */
const strip = new THREE.BufferAttribute(new Uint32Array(6 * capacity).map((_, k) => {
  const i = 2 * Math.floor(k / 6);
  return i + [0, 1, 2, 1, 3, 2][k % 6];
}), 1);

interface Style { colour: Rgb; alpha: number; width: number; dash: number }

export class TrackLayer {
  private readonly data = new Float32Array((capacity + 4) * perPoint);
  private readonly buffer = new THREE.InterleavedBuffer(this.data, stride);
  private readonly geometry = new THREE.BufferGeometry();
  private readonly line: THREE.Mesh;
  private readonly band: THREE.Mesh;
  private readonly uniforms;
  private points = 0;
  private every = 1;
  private area: Rect | null = null;
  private from: Track | null = null;
  private rewritten = -1;
  private total = 0;
  private far = 0;
  private hasSigma = false;

  constructor(scene: THREE.Scene, order: number, depth: number, private readonly withBand: boolean) {
    this.buffer.setUsage(THREE.DynamicDrawUsage);
    const field = (name: string, size: number, offset: number) =>
      this.geometry.setAttribute(name, new THREE.InterleavedBufferAttribute(this.buffer, size, offset));
    field("before", 4, 0);
    field("at", 4, perPoint);
    field("extra", 2, perPoint + 4);
    field("after", 4, 2 * perPoint);
    this.geometry.setIndex(strip);
    const shared = { uLine: uColour(), uWarn: uColour(), uBad: uColour(), uDepth: { value: depth } };
    const line = { ...shared, uAlpha: { value: 1 }, uSigmas: { value: 0 }, uWidth: { value: 2.5 }, uDash: { value: 0 } };
    const band = { ...shared, uAlpha: { value: 0.16 }, uSigmas: { value: 3 }, uWidth: { value: 0 }, uDash: { value: 0 } };
    this.uniforms = { line, band };
    this.line = new THREE.Mesh(this.geometry, material(vertex, fragment, line));
    const bandMaterial = material(vertex, fragment, band);
    // Each pixel of the band once, though its pieces overlap in bends: the first one there wins.
    bandMaterial.depthTest = bandMaterial.depthWrite = true;
    bandMaterial.depthFunc = THREE.LessDepth;
    this.band = new THREE.Mesh(this.geometry, bandMaterial);
    addMesh(scene, this.band, order);
    // The line lies over the landmarks, which may hide all of the ground.
    addMesh(scene, this.line, order + 40);
  }

  paint(p: Palette, style: Style): void {
    const { line } = this.uniforms;
    line.uLine.value.set(...style.colour);
    line.uWarn.value.set(...p.warn);
    line.uBad.value.set(...p.bad);
    line.uAlpha.value = style.alpha;
    line.uWidth.value = style.width;
    line.uDash.value = style.dash;
  }

  /** Returns the number of points drawn. */
  update(track: Track, camera: Camera, isShown: boolean, isBandShown: boolean): number {
    this.line.visible = this.band.visible = false;
    if (!isShown) return 0;
    if (this.isStale(track, camera)) this.choose(track, camera);
    else if (track.total !== this.total) this.append(track, camera);
    this.line.visible = this.points > 1;
    this.band.visible = this.line.visible && isBandShown && this.withBand && this.hasSigma;
    return this.points;
  }

  private isStale(track: Track, camera: Camera): boolean {
    if (track !== this.from || track.rewritten !== this.rewritten || track.total < this.total) return true;
    if (track.total === 0) return false;
    if (!this.area || !contains(this.area, camera.seen())) return true;
    // Zoomed in far enough for a thinned path to be drawn whole.
    return this.every > 1 && camera.width / camera.scale < 0.3 * (this.area.x1 - this.area.x0);
  }

  private choose(track: Track, camera: Camera): void {
    const area = camera.seen(0.6);
    const chunks = track.chunks.filter((c) => c.maxX >= area.x0 && c.minX <= area.x1 && c.maxY >= area.y0 && c.minY <= area.y1);
    const wanted = chunks.reduce((n, c) => n + c.n + 1, 0);
    this.every = 1;
    while (wanted / this.every > capacity - 2 * chunks.length - 1024) this.every *= 2;
    this.from = track;
    this.rewritten = track.rewritten;
    this.area = area;
    this.points = 0;
    this.far = 0;
    this.hasSigma = false;
    let end = -1;
    for (const c of chunks) {
      if (end >= 0 && c.start !== end) this.put(c.data[0], c.data[1], 0, -1);
      this.take(c, 0);
      end = c.end;
    }
    this.total = track.total;
    this.upload(0);
  }

  private append(track: Track, camera: Camera): void {
    const first = this.points;
    for (const c of track.chunks) {
      if (c.end <= this.total) continue;
      this.take(c, Math.max(0, Math.ceil((this.total - c.start) / c.step)));
    }
    this.total = track.total;
    if (this.points >= capacity - 256) this.choose(track, camera);
    else this.upload(first);
  }

  private take(c: Chunk, begin: number): void {
    const step = Math.max(1, Math.round(this.every / c.step));
    for (let i = Math.ceil(begin / step) * step; i < c.n && this.points < capacity; i += step) {
      this.put(c.data[4 * i], c.data[4 * i + 1], c.data[4 * i + 2], c.data[4 * i + 3]);
    }
  }

  /** A status below 0 breaks the line before the point; the next one is to be at the same place. */
  private put(x: number, y: number, sigma: number, status: number): void {
    const d = this.data, at = (this.points + 1) * perPoint;
    if (this.points) this.far += Math.hypot(x - d[at - perPoint], y - d[at - perPoint + 1]);
    for (const [k, side] of sides) {
      const o = at + k;
      d[o] = x;
      d[o + 1] = y;
      d[o + 2] = sigma;
      d[o + 3] = status;
      d[o + 4] = this.far;
      d[o + 5] = side;
    }
    if (sigma > 0) this.hasSigma = true;
    this.points++;
  }

  private upload(first: number): void {
    // The ends have no neighbour: a broken point stands for it.
    for (const [k] of sides) this.data[k + 3] = this.data[(this.points + 1) * perPoint + k + 3] = -1;
    this.geometry.setDrawRange(0, 6 * Math.max(0, this.points - 1));
    const begin = first * perPoint;
    this.buffer.addUpdateRange(begin, (this.points + 2) * perPoint - begin);
    this.buffer.needsUpdate = true;
  }
}
