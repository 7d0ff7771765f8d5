// What is few and changes often: vehicles, detections, matches, closures, borders, the chosen thing, the ruler.
import type * as THREE from "three";
import type { Palette, Rgb } from "../theme";
import { mapCovariance, type Run } from "../store/run";
import { Ellipses } from "./ellipses";
import type { Layers } from "./layers";
import { Marks, shape } from "./marks";
import { Segments } from "./segments";
import type { Planar } from "../protocol";

export interface Spot { x: number; y: number; slot: number; run: number }
export interface Selection extends Spot { rays: [number, number][] }

export class Overlays {
  readonly below: Segments; // borders and edges, under the landmarks
  readonly hierarchy: Segments;
  readonly above: Segments;
  readonly marks: Marks;
  readonly ellipses: Ellipses;
  private hierarchyOf: Run | null = null;
  private hierarchyVersion = -1;

  constructor(scene: THREE.Scene) {
    this.hierarchy = new Segments(scene, 1);
    this.below = new Segments(scene, 2);
    this.above = new Segments(scene, 60);
    this.ellipses = new Ellipses(scene, 65);
    this.marks = new Marks(scene, 70);
  }

  rebuild(runs: Run[], layers: Layers, p: Palette, selection: Selection | null, ruler: Spot[]): void {
    for (const b of [this.below, this.above, this.marks, this.ellipses]) b.begin();
    for (const run of runs) {
      if (layers.submaps) this.submaps(run, p);
      if (layers.closures) this.closures(run, p);
      if (layers.matches) this.matches(run, p);
      if (layers.vehicle) this.vehicle(run, p, layers);
    }
    if (layers.truth && runs[0]?.truth) this.truth(runs[0].truth, p);
    if (selection) this.selection(selection, p);
    this.ruler(ruler, p);
    for (const b of [this.below, this.above, this.marks, this.ellipses]) b.end();
    if (runs[0]) this.edges(runs[0], layers.hierarchy, p);
  }

  repaint(): void { this.hierarchyVersion = -1; }

  private submaps(run: Run, p: Palette): void {
    const active = run.pose?.submap_id;
    for (const s of run.submaps) {
      const isActive = s.id === active;
      for (let i = 0; i < s.outline.length; i++) {
        const a = s.outline[i], b = s.outline[(i + 1) % s.outline.length];
        this.below.line(a[0], a[1], b[0], b[1], p.submap, isActive ? 0.9 : 0.6, isActive ? 1.8 : 1.2, isActive ? 0 : 5);
      }
      this.marks.mark(shape.square, s.x, s.y, 3, 0, p.submap, 0.8, s.theta);
    }
  }

  private closures(run: Run, p: Palette): void {
    const colours: Record<string, [Rgb, number]> = {
      accepted: [p.likely, 0], waiting: [p.warn, 4], refused: [p.bad, 3], revoked: [p.muted, 3], sent: [p.warn, 0],
    };
    for (const c of run.closures) {
      const [colour, dash] = colours[c.status] ?? [p.muted, 3];
      this.above.line(c.from[0], c.from[1], c.to[0], c.to[1], colour, 0.75, 1.6, dash);
      this.marks.mark(shape.diamond, c.from[0], c.from[1], 5, 0, colour);
      this.marks.mark(shape.diamond, c.to[0], c.to[1], 5, 0, colour);
    }
  }

  private matches(run: Run, p: Palette): void {
    const m = run.matches, d = run.landmarks.drawn;
    if (!m) return;
    for (const s of run.matchSlots) this.above.line(m.x, m.y, d[4 * s], d[4 * s + 1], p.runs[run.index % 2], 0.45, 1.2);
    for (const s of run.unseenSlots) {
      this.above.line(m.x, m.y, d[4 * s], d[4 * s + 1], p.bad, 0.4, 1, 3);
      this.marks.mark(shape.cross, d[4 * s], d[4 * s + 1], 7, 0.3, p.bad);
    }
  }

  private vehicle(run: Run, p: Palette, layers: Layers): void {
    const pose = run.pose;
    if (!pose) return;
    const isLost = run.verdict?.state === "lost" || pose.status === "lost";
    const colour = isLost ? p.bad : pose.status === "coasting" ? p.warn : p.runs[run.index % 2];
    if (layers.detections) this.detections(run, p);
    this.ellipses.ellipse(pose.x, pose.y, ...mapCovariance(pose), colour);
    const heading = 3 * Math.sqrt(Math.max(0, pose.covariance[8]));
    if (heading > 0.005) this.marks.mark(shape.fan, pose.x, pose.y, 60, 0, colour, 0.45, pose.theta, Math.min(3.14, heading));
    this.marks.mark(shape.disk, pose.x, pose.y, 15, 0.3, colour, 0.18);
    this.marks.mark(shape.arrow, pose.x, pose.y, 13, 0.3, colour, 1, pose.theta);
  }

  private detections(run: Run, p: Palette): void {
    const pose = run.pose!, c = Math.cos(pose.theta), s = Math.sin(pose.theta), d = run.detections;
    for (let i = 0; i < d.x.length; i++) {
      const x = pose.x + c * d.x[i] - s * d.y[i], y = pose.y + s * d.x[i] + c * d.y[i];
      this.marks.mark(d.kind[i] ? shape.square : shape.ring, x, y, 5, d.radius[i] || 0, p.detection, 0.5);
    }
  }

  private truth(t: Planar, p: Palette): void {
    this.marks.mark(shape.arrow, t.x, t.y, 10, 0.2, p.truth, 0.55, t.theta);
  }

  private selection(s: Selection, p: Palette): void {
    for (const [x, y] of s.rays) {
      this.above.line(x, y, s.x, s.y, p.ink, 0.35, 1);
      this.marks.mark(shape.disk, x, y, 2, 0, p.ink, 0.6);
    }
    this.marks.mark(shape.ring, s.x, s.y, 12, 0.4, p.ink);
  }

  private ruler(spots: Spot[], p: Palette): void {
    for (const s of spots) this.marks.mark(shape.cross, s.x, s.y, 6, 0, p.ink);
    if (spots.length === 2) this.above.line(spots[0].x, spots[0].y, spots[1].x, spots[1].y, p.ink, 1, 1.6, 6);
  }

  private edges(run: Run, isShown: boolean, p: Palette): void {
    if (isShown && (run !== this.hierarchyOf || run.version.hierarchy !== this.hierarchyVersion)) {
      const { a, b, level } = run.hierarchy, d = run.landmarks.drawn;
      this.hierarchy.begin();
      for (let i = 0; i < a.length; i++) {
        const s = 4 * a[i], t = 4 * b[i], isPolygon = level[i] > 0;
        this.hierarchy.line(d[s], d[s + 1], d[t], d[t + 1], p.hierarchy[isPolygon ? 1 : 0], 0.8, isPolygon ? 1.8 : 1);
      }
      this.hierarchy.end();
      this.hierarchyOf = run;
      this.hierarchyVersion = run.version.hierarchy;
    }
    this.hierarchy.mesh.visible = isShown && this.hierarchy.count > 0;
  }
}
