// What all layers share: the view as uniforms, materials without depth, and batches of instanced quads.
import * as THREE from "three";
import type { Rgb } from "../theme";
import type { Camera } from "./camera";

/** Middle of the view [m], clip units per metre. */
export const uView = { value: new THREE.Vector4(0, 0, 1, 1) };
/** Size of the canvas, device pixels per metre, device pixels per CSS pixel. */
export const uScreen = { value: new THREE.Vector4(1, 1, 1, 1) };

export function setView(c: Camera): void {
  uView.value.set(c.x, c.y, (2 * c.scale) / c.width, (2 * c.scale) / c.height);
  uScreen.value.set(c.width * c.ratio, c.height * c.ratio, c.scale * c.ratio, c.ratio);
}

const head = `precision highp float;
uniform vec4 uView; uniform vec4 uScreen;
`;
const vertexHead = `${head}
vec2 toPixel(vec2 p) { return (p - uView.xy) * uScreen.z; }
vec4 fromPixel(vec2 p) { return vec4(p * 2.0 / uScreen.xy, 0.0, 1.0); }
`;

export function material(vertex: string, fragment: string, uniforms: Record<string, THREE.IUniform> = {}): THREE.RawShaderMaterial {
  return new THREE.RawShaderMaterial({
    glslVersion: THREE.GLSL3, vertexShader: vertexHead + vertex, fragmentShader: head + "out vec4 colour;\n" + fragment,
    uniforms: { uView, uScreen, ...uniforms }, transparent: true, depthTest: false, depthWrite: false, side: THREE.DoubleSide,
  });
}

export function uColour(): THREE.IUniform<THREE.Vector3> { return { value: new THREE.Vector3() }; }

/** Corners (0 | 1, -1 | 1) of a quad, for instances. */
export function quad(): THREE.InstancedBufferGeometry {
  const g = new THREE.InstancedBufferGeometry();
  g.setAttribute("corner", new THREE.BufferAttribute(new Float32Array([0, -1, 1, -1, 0, 1, 1, 1]), 2));
  g.setIndex([0, 1, 2, 2, 1, 3]);
  return g;
}

export function addMesh(scene: THREE.Scene, object: THREE.Object3D, order: number): void {
  object.frustumCulled = false;
  object.matrixAutoUpdate = false;
  object.visible = false;
  object.renderOrder = order;
  scene.add(object);
}

/** Instances whose floats lie side by side in one buffer, filled anew when what they show has changed. */
export class Batch {
  readonly mesh: THREE.Mesh<THREE.InstancedBufferGeometry, THREE.RawShaderMaterial>;
  private readonly stride: number;
  protected data!: Float32Array;
  private buffer!: THREE.InstancedInterleavedBuffer;
  private at = 0;

  constructor(scene: THREE.Scene, order: number, shader: THREE.RawShaderMaterial, private readonly fields: [string, number][], capacity = 256) {
    this.stride = fields.reduce((n, f) => n + f[1], 0);
    this.mesh = new THREE.Mesh(quad(), shader);
    addMesh(scene, this.mesh, order);
    this.allocate(capacity);
    this.end();
  }

  begin(): void { this.at = 0; }

  /** Where the floats of one more instance go in `data`. */
  protected place(): number {
    if ((this.at + 1) * this.stride > this.data.length) this.double();
    return this.at++ * this.stride;
  }

  end(): void {
    const g = this.mesh.geometry;
    g.instanceCount = this.at;
    this.mesh.visible = this.at > 0;
    this.buffer.clearUpdateRanges();
    if (this.at) this.buffer.addUpdateRange(0, this.at * this.stride);
    this.buffer.needsUpdate = true;
  }

  get count(): number { return this.at; }

  private double(): void {
    const old = this.data;
    this.allocate((2 * old.length) / this.stride);
    this.data.set(old);
  }

  private allocate(capacity: number): void {
    this.mesh.geometry.dispose();
    this.mesh.geometry = quad();
    this.data = new Float32Array(capacity * this.stride);
    this.buffer = new THREE.InstancedInterleavedBuffer(this.data, this.stride);
    this.buffer.setUsage(THREE.DynamicDrawUsage);
    let offset = 0;
    for (const [name, size] of this.fields) {
      this.mesh.geometry.setAttribute(name, new THREE.InterleavedBufferAttribute(this.buffer, size, offset));
      offset += size;
    }
  }
}

export type Colour = Rgb;
