// Lines every 1, 2 or 5 times a power of ten metres, those of the view alone: a shader over every pixel would cost a browser that
// rasterises in software a fifth of its time.
import type * as THREE from "three";
import type { Palette, Rgb } from "../theme";
import type { Camera } from "./camera";
import { Segments } from "./segments";

const majorEvery = 5;

export class GridLayer {
  private readonly lines: Segments;
  private minor: Rgb = [0, 0, 0];
  private major: Rgb = [0, 0, 0];

  constructor(scene: THREE.Scene) { this.lines = new Segments(scene, 0); }

  paint(p: Palette): void {
    this.minor = p.gridMinor;
    this.major = p.gridMajor;
  }

  update(camera: Camera, isShown: boolean): void {
    this.lines.begin();
    if (isShown) {
      const spacing = niceStep(24 / camera.scale);
      // Across the minor lines the major ones are seen whole.
      this.rule(camera, spacing, false);
      this.rule(camera, spacing, true);
    }
    this.lines.end();
  }

  private rule(camera: Camera, spacing: number, isMajor: boolean): void {
    const { x0, y0, x1, y1 } = camera.seen(), colour = isMajor ? this.major : this.minor;
    for (let k = Math.ceil(x0 / spacing); k * spacing <= x1; k++) if ((k % majorEvery === 0) === isMajor) this.lines.line(k * spacing, y0, k * spacing, y1, colour, 1, 1);
    for (let k = Math.ceil(y0 / spacing); k * spacing <= y1; k++) if ((k % majorEvery === 0) === isMajor) this.lines.line(x0, k * spacing, x1, k * spacing, colour, 1, 1);
  }
}

/** The smallest of 1, 2, 5, 10, ... that is not less than `least`. */
export function niceStep(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  const digit = least / power;
  return power * (digit <= 1 ? 1 : digit <= 2 ? 2 : digit <= 5 ? 5 : 10);
}
