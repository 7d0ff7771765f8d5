// Landmarks: one point each, in the memory that the store computes with; only blocks that changed are uploaded. Zoomed in, only those
// in and near the view are drawn, with the ellipses of their covariance.
import * as THREE from "three";
import type { Palette, Rgb } from "../theme";
import { blockSize, onlyHere, outOfUse, there, type Landmarks } from "../store/landmarks";
import { contains, type Camera, type Rect } from "./camera";
import type { Ellipses } from "./ellipses";
import { addMesh, material, uColour } from "./gl";

const nearCapacity = 20000, ellipseCapacity = 6000;
const perPicture = 48;

const vertex = `
in vec4 landmark;
uniform float uLeast; uniform vec3 uUnknown; uniform vec3 uUnlikely; uniform vec3 uDoubtful; uniform vec3 uLikely;
uniform vec3 uOnly; uniform vec4 uTint; uniform highp int uCompare;
flat out vec4 vColour; flat out float vSize; flat out int vFlags;
void main() {
  int flags = int(landmark.w * 0.5); float p = landmark.w - 2.0 * float(flags);
  bool isOnlyHere = (flags & 16) != 0;
  vFlags = flags;
  vec3 c = p > 1.25 ? uUnknown : p < 0.5 ? mix(uUnlikely, uDoubtful, 2.0 * p) : mix(uDoubtful, uLikely, 2.0 * p - 1.0);
  c = mix(c, uTint.rgb, uTint.a);
  if (uCompare > 0 && isOnlyHere) c = uOnly;
  vColour = vec4(c, 1.0);
  float size = max(uLeast * uScreen.w, 2.0 * landmark.z * uScreen.z);
  if (uCompare > 0 && isOnlyHere) size = max(size, 11.0 * uScreen.w);
  vSize = min(size, 400.0);
  gl_PointSize = vSize + 2.0;
  bool isShown = (flags & 1) != 0 && (uCompare < 2 || isOnlyHere);
  gl_Position = isShown ? fromPixel(toPixel(landmark.xy)) : vec4(2.0, 2.0, 2.0, 1.0);
}`;
const fragment = `
flat in vec4 vColour; flat in float vSize; flat in int vFlags;
uniform highp int uCompare;
void main() {
  vec2 p = (gl_PointCoord - 0.5) * (vSize + 2.0), q = abs(p);
  float r = 0.5 * vSize, d = (vFlags & 2) != 0 ? max(q.x, q.y) - 0.9 * r : length(p) - r;
  bool isOnlyHere = uCompare > 0 && (vFlags & 16) != 0;
  if (isOnlyHere) {
    // A plus, or a cross; with an edge as wide as a third of it at most.
    if (uCompare > 1) q = abs(vec2(p.x + p.y, p.x - p.y)) * 0.7071;
    d = max(min(q.x, q.y) - min(1.2 * uScreen.w, r / 3.0), max(q.x, q.y) - r);
  }
  float alpha = clamp(0.5 - d, 0.0, 1.0);
  bool isHollow = !isOnlyHere && (vFlags & 4) != 0;
  if (isHollow) alpha *= r > 2.0 ? clamp(d + 1.6 * uScreen.w, 0.0, 1.0) : 0.5;
  if (alpha < 0.01) discard;
  colour = vec4(vColour.rgb, vColour.a * alpha);
}`;

/** `only`: of two versions of a map, the colour of what the other one lacks, a plus here and a cross in the base, of which nothing else is drawn. */
export interface LandmarkStyle { only: Rgb | null; isBase: boolean; tint: Rgb | null }

export class LandmarkLayer {
  private readonly uniforms = {
    uLeast: { value: 4 }, uUnknown: uColour(), uUnlikely: uColour(), uDoubtful: uColour(), uLikely: uColour(), uOnly: uColour(),
    uTint: { value: new THREE.Vector4() }, uCompare: { value: 0 },
  };
  private readonly shader = material(vertex, fragment, this.uniforms);
  private readonly all = new THREE.Points(new THREE.BufferGeometry(), this.shader);
  private readonly near = new THREE.Points(new THREE.BufferGeometry(), this.shader);
  private attribute: THREE.BufferAttribute | null = null;
  private index = new THREE.BufferAttribute(new Uint32Array(nearCapacity), 1);
  private owner: Landmarks | null = null;
  private version = -1;
  private area: Rect | null = null;
  private count = -1; // in `near`; -1: too many, all are drawn
  private chosenScale = 0;
  private nextBlock = 0;
  /** Not all of what changed is on the GPU yet: another picture is needed. */
  isBehind = false;
  private palette!: Palette;
  private style: LandmarkStyle = { only: null, isBase: false, tint: null };

  constructor(scene: THREE.Scene, order: number, private readonly ellipses: Ellipses) {
    addMesh(scene, this.all, order);
    addMesh(scene, this.near, order);
    this.index.setUsage(THREE.DynamicDrawUsage);
  }

  paint(p: Palette, style: LandmarkStyle): void {
    const u = this.uniforms;
    u.uUnknown.value.set(...p.unknown);
    u.uUnlikely.value.set(...p.unlikely);
    u.uDoubtful.value.set(...p.doubtful);
    u.uLikely.value.set(...p.likely);
    u.uCompare.value = style.only ? (style.isBase ? 2 : 1) : 0;
    if (style.only) u.uOnly.value.set(...style.only);
    if (style.tint) u.uTint.value.set(...style.tint, 0.85);
    else u.uTint.value.set(0, 0, 0, 0);
    this.palette = p;
    this.style = style;
    this.area = null;
  }

  update(landmarks: Landmarks, camera: Camera, isShown: boolean, areEllipsesShown: boolean): void {
    this.all.visible = this.near.visible = false;
    this.ellipses.mesh.visible = false;
    if (!isShown || landmarks.slots === 0) return;
    if (landmarks !== this.owner || landmarks.capacity * 4 !== this.attribute?.array.length) this.take(landmarks);
    const hasChanged = landmarks.version !== this.version;
    if (hasChanged || this.isBehind) this.upload(landmarks);
    // Zoomed in far enough, fewer are in view and more ellipses are large enough to be seen.
    const isNearer = camera.scale > 2 * this.chosenScale;
    const areNearChanged = hasChanged && this.count >= 0;
    if (areNearChanged || isNearer || !this.area || !contains(this.area, camera.seen())) this.choose(landmarks, camera);

    const shown = this.count < 0 ? landmarks.used : Math.max(1, this.count / 2.5);
    const spacing = Math.sqrt((camera.width * camera.height) / Math.max(1, shown));
    this.uniforms.uLeast.value = Math.min(7, Math.max(1.5, 0.3 * spacing));
    this.all.geometry.setDrawRange(0, landmarks.slots);
    this.all.visible = this.count < 0;
    this.near.visible = this.count > 0;
    this.ellipses.mesh.visible = areEllipsesShown && this.count > 0;
  }

  private take(landmarks: Landmarks): void {
    this.all.geometry.dispose();
    this.near.geometry.dispose();
    this.all.geometry = new THREE.BufferGeometry();
    this.near.geometry = new THREE.BufferGeometry();
    this.attribute = new THREE.BufferAttribute(landmarks.drawn, 4);
    this.attribute.setUsage(THREE.DynamicDrawUsage);
    this.all.geometry.setAttribute("landmark", this.attribute);
    this.near.geometry.setAttribute("landmark", this.attribute);
    this.near.geometry.setIndex(this.index);
    this.owner = landmarks;
    this.version = -1;
    this.area = null;
    // The new buffer is uploaded whole.
    landmarks.dirty.fill(0);
  }

  /** At most `perPicture` blocks: a change of the whole map comes over some pictures and holds up none. */
  private upload(landmarks: Landmarks): void {
    const blocks = Math.ceil(landmarks.slots / blockSize);
    let left = perPicture;
    for (let k = 0; k < blocks && left > 0; k++, this.nextBlock++) {
      if (this.nextBlock >= blocks) this.nextBlock = 0;
      if (!landmarks.dirty[this.nextBlock]) continue;
      landmarks.dirty[this.nextBlock] = 0;
      left--;
      this.attribute!.addUpdateRange(4 * this.nextBlock * blockSize, 4 * Math.min(blockSize, landmarks.capacity - this.nextBlock * blockSize));
    }
    this.attribute!.needsUpdate = true;
    this.isBehind = left === 0;
    this.version = landmarks.version;
  }

  private choose(landmarks: Landmarks, camera: Camera): void {
    this.area = camera.seen(0.3);
    this.chosenScale = camera.scale;
    const { x0, y0, x1, y1 } = this.area;
    const slots = this.index.array as Uint32Array;
    this.count = landmarks.grid.within(x0, y0, x1, y1, slots);
    if (this.count < 0) return;
    this.near.geometry.setDrawRange(0, this.count);
    this.index.clearUpdateRanges();
    this.index.addUpdateRange(0, Math.max(1, this.count));
    this.index.needsUpdate = true;
    this.ellipses.begin();
    for (let i = 0; i < this.count && this.ellipses.count < ellipseCapacity; i++) this.addEllipse(landmarks, slots[i], camera.scale);
    this.ellipses.end();
  }

  private addEllipse(l: Landmarks, s: number, scale: number): void {
    const xx = l.covariance[3 * s], xy = l.covariance[3 * s + 1], yy = l.covariance[3 * s + 2];
    // Smaller than this it has faded out at twice the scale, too, when the next choice is made.
    if (!(l.flags[s] & there) || !(Math.max(xx, yy) * scale * scale > 0.25)) return;
    const { only, isBase, tint } = this.style, isOnlyHere = only !== null && (l.flags[s] & onlyHere) !== 0;
    if (isBase && only && !isOnlyHere) return;
    const p = l.probability[s], q = this.palette;
    const c = (isOnlyHere ? only : tint) ?? (Number.isNaN(p) ? q.unknown : p < 0.35 ? q.unlikely : p < 0.75 ? q.doubtful : q.likely);
    this.ellipses.ellipse(l.drawn[4 * s], l.drawn[4 * s + 1], xx, xy, yy, c, l.flags[s] & outOfUse ? 0.4 : 0.75);
  }
}
