// The map: draws the store, when something has changed, and tells what is under a point.
import * as THREE from "three";
import type { Theme } from "../theme";
import type { Run } from "../store/run";
import type { Store } from "../store/store";
import { there } from "../store/landmarks";
import { Camera, grow, type Rect } from "./camera";
import { Ellipses } from "./ellipses";
import { setView } from "./gl";
import { GridLayer } from "./grid_layer";
import { LandmarkLayer } from "./landmark_layer";
import { loadLayers } from "./layers";
import { Overlays, type Selection, type Spot } from "./overlays";
import { ScanLayer } from "./scan_layer";
import { TrackLayer } from "./track_layer";

const nearby = new Uint32Array(200000);

export class MapView {
  readonly camera = new Camera();
  readonly layers = loadLayers();
  isFollowing = true;
  selection: Selection | null = null;
  ruler: Spot[] = [];
  drawCalls = 0;
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly unused = new THREE.OrthographicCamera();
  private readonly gridLayer = new GridLayer(this.scene);
  private readonly landmarks = [30, 31].map((order) => new LandmarkLayer(this.scene, order, new Ellipses(this.scene, 35)));
  private readonly paths = [0, 1].map((i) => new TrackLayer(this.scene, 10 + i, 0.5 - 0.1 * i, true));
  private readonly truthPath = new TrackLayer(this.scene, 8, 0, false);
  private readonly keyframes = new TrackLayer(this.scene, 14, 0, false);
  private readonly scan = new ScanLayer(this.scene, 40);
  private readonly overlays = new Overlays(this.scene);
  private needsFit = true;

  constructor(readonly canvas: HTMLCanvasElement, private readonly store: Store, private readonly theme: Theme) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: false, powerPreference: "high-performance" });
    // The check waits for each program to be linked, one after the other, before anything is seen.
    this.renderer.debug.checkShaderErrors = new URLSearchParams(location.search).has("check");
    this.scene.matrixWorldAutoUpdate = false;
    theme.onChange(() => this.paint());
    this.paint();
  }

  paint(): void {
    const p = this.theme.palette, isMap = this.store.hello?.mode === "map";
    this.renderer.setClearColor(new THREE.Color().setRGB(...p.background, THREE.LinearSRGBColorSpace));
    this.renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    this.gridLayer.paint(p);
    this.landmarks[0].paint(p, { only: isMap && this.store.other ? p.added : null, isBase: false, tint: null });
    this.landmarks[1].paint(p, { only: isMap ? p.removed : null, isBase: true, tint: isMap ? null : p.runs[1] });
    this.paths.forEach((l, i) => l.paint(p, { colour: p.runs[i], alpha: 0.95, width: 2.6, dash: 0 }));
    this.truthPath.paint(p, { colour: p.truth, alpha: 0.55, width: 1.4, dash: 4 });
    this.keyframes.paint(p, { colour: p.ink, alpha: 0.5, width: 1.2, dash: 0 });
    this.scan.paint(p);
    this.overlays.repaint();
  }

  resize(width: number, height: number, ratio: number): void {
    Object.assign(this.camera, { width, height, ratio });
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
  }

  /** Everything comes anew: of other runs the first picture shows all; of the same ones the view stays as it was. */
  restart(isSame: boolean): void {
    this.needsFit ||= !isSame;
    this.selection = null;
    this.ruler = [];
    this.paint();
  }

  /** Returns whether another picture is needed for what did not fit into this one. */
  draw(): boolean {
    const runs = this.shownRuns(), c = this.camera, l = this.layers;
    this.aim();
    setView(c);
    this.gridLayer.update(c, l.grid);
    for (const i of [0, 1]) this.drawRun(i, runs[i]);
    if (runs[0]) {
      this.truthPath.update(runs[0].truthPath, c, l.truth, false);
      this.keyframes.update(runs[0].keyframes, c, l.keyframes, false);
      this.scan.update(runs[0], l.scan);
    }
    this.overlays.rebuild(runs, l, this.theme.palette, this.selection, this.ruler);
    this.renderer.render(this.scene, this.unused);
    this.drawCalls = this.renderer.info.render.calls;
    return this.landmarks.some((l) => l.isBehind);
  }

  shownRuns(): Run[] { return this.layers.second ? this.store.runs.slice(0, 2) : this.store.runs.slice(0, 1); }

  fit(): void {
    let r: Rect | null = null;
    for (const run of this.shownRuns()) {
      const { slots, flags, drawn } = run.landmarks;
      for (let s = 0; s < slots; s++) if (flags[s] & there) r = grow(r, drawn[4 * s], drawn[4 * s + 1]);
      for (const c of run.path.chunks) if (c.n) r = grow(r, c.minX, c.minY, c.maxX, c.maxY);
      if (run.pose) r = grow(r, run.pose.x, run.pose.y);
    }
    if (r) this.camera.fit(r);
    this.isFollowing = false;
  }

  /** The landmark nearest to a pixel, within `radius` pixels; null where there is none. */
  pick(px: number, py: number, radius = 12): Spot | null {
    const at = this.camera.toMap(px, py), reach = radius / this.camera.scale;
    let found: Spot | null = null;
    for (const run of this.shownRuns()) {
      const l = run.landmarks, n = l.grid.within(at.x - reach, at.y - reach, at.x + reach, at.y + reach, nearby);
      let best = reach * reach;
      const count = n < 0 ? l.slots : n;
      for (let i = 0; i < count; i++) {
        const s = n < 0 ? i : nearby[i], x = l.drawn[4 * s], y = l.drawn[4 * s + 1];
        const edge = Math.max(0, Math.hypot(x - at.x, y - at.y) - (l.drawn[4 * s + 2] || 0));
        if (!(l.flags[s] & there) || edge * edge >= best) continue;
        best = edge * edge;
        found = { x, y, slot: s, run: run.index };
      }
      if (found) return found;
    }
    return null;
  }

  private drawRun(i: number, run: Run | undefined): void {
    const { camera: c, layers: l } = this, isShown = run !== undefined;
    const of = run ?? this.store.runs[i];
    if (!of) return;
    this.landmarks[i].update(of.landmarks, c, isShown && l.landmarks, l.ellipses);
    this.paths[i].update(of.path, c, isShown && l.path, l.band);
  }

  private aim(): void {
    const run = this.store.main;
    if (!run) return;
    if (this.needsFit && (run.landmarks.used > 0 || run.pose)) {
      const follow = this.isFollowing && run.pose !== null;
      this.fit();
      this.isFollowing = follow;
      if (follow) this.camera.scale = Math.max(this.camera.scale, 6);
      this.needsFit = false;
    }
    if (!this.isFollowing || !run.pose) return;
    this.camera.x = run.pose.x;
    this.camera.y = run.pose.y;
  }
}
