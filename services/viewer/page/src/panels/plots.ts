// Whether the system is as sure as it may be (NIS, NEES within their bounds), how far off it is, and how fast.
import type uPlot from "uplot";
import { fixed, h, setText } from "../dom";
import { plotted } from "../store/run";
import type { Store } from "../store/store";
import type { Theme } from "../theme";
import { chart, type Line } from "./chart";
import type { Panel } from "./panel";

type Column = (number | null)[];
interface Plot { title: string; unit: string; lines: Line[]; digits: number; least?: number; data: (c: (name: (typeof plotted)[number]) => Column, t: Column) => Column[] }

/** Quantile of the chi-square distribution, by Wilson and Hilferty; z is that of the normal distribution. */
export function chiSquare(dof: number, z: number): number {
  const k = 2 / (9 * dof);
  return dof * Math.max(0, 1 - k + z * Math.sqrt(k)) ** 3;
}

const z95 = 1.96, poseDof = 3;
const accent = (t: Theme) => t.palette.accent, bound = (t: Theme) => t.palette.warn, quiet = (t: Theme) => t.palette.muted, second = (t: Theme) => t.palette.likely;
const bounds: Line[] = [{ label: "95 %", colour: bound, dash: [4, 4], width: 1 }, { label: "95 %", colour: bound, dash: [4, 4], width: 1 }];
const dofBound = (dof: Column, z: number) => dof.map((k) => (k ? chiSquare(k, z) : null));

const plots: Plot[] = [
  { title: "NIS, 95 % bounds", unit: "", digits: 1, lines: [{ label: "NIS", colour: accent }, ...bounds],
    data: (c) => [c("nis"), dofBound(c("nis_dof"), -z95), dofBound(c("nis_dof"), z95)] },
  { title: "NEES of the pose, 95 % bounds", unit: "", digits: 1, lines: [{ label: "NEES", colour: accent }, ...bounds],
    data: (c, t) => [c("nees"), t.map(() => chiSquare(poseDof, -z95)), t.map(() => chiSquare(poseDof, z95))] },
  { title: "Error, largest sigma", unit: "m", digits: 3, lines: [{ label: "error", colour: accent }, { label: "sigma", colour: quiet, dash: [3, 3] }],
    data: (c) => [c("error_m"), c("sigma_m")] },
  { title: "Latency of the pose, message to pixel", unit: "ms", digits: 0, lines: [{ label: "pose", colour: accent }, { label: "pixel", colour: second }],
    data: (c) => [c("latency_ms"), c("page_ms")] },
  { title: "Poses per second", unit: "Hz", digits: 1, lines: [{ label: "rate", colour: accent }], data: (c) => [c("rate_hz")] },
];
const height = 104;

export class PlotsPanel implements Panel {
  readonly id = "plots";
  readonly title = "Plots";
  readonly element = h("div", { class: "plots", "data-test": "plots" });
  private readonly charts: (uPlot | null)[] = plots.map(() => null);
  private readonly boxes = plots.map(() => h("div", { class: "plot-box" }));
  private readonly latest = plots.map(() => h("output"));
  private next = 0;
  private width = 0;

  constructor(private readonly store: Store, private readonly theme: Theme) {
    plots.forEach((p, i) => this.element.append(h("figure", { class: "plot" }, h("figcaption", {}, p.title, this.latest[i]), this.boxes[i])));
    theme.onChange(() => this.charts.forEach((c) => c?.redraw(false)));
  }

  /** One plot each time: a picture is not held up by all of them. */
  update(): void {
    const width = this.element.clientWidth - 24;
    if (width <= 0) return;
    if (width !== this.width) this.remake(width);
    this.fill(this.next);
    this.next = (this.next + 1) % plots.length;
  }

  private remake(width: number): void {
    this.width = width;
    this.charts.forEach((c, i) => {
      if (c) c.setSize({ width, height });
      else this.boxes[i].append((this.charts[i] = chart(this.theme, plots[i].lines, width, height, plots[i].unit)).root);
    });
    plots.forEach((_, i) => this.fill(i));
  }

  private fill(i: number): void {
    const table = this.store.main?.history;
    if (!table) return;
    const time = table.columns[0], columns = plots[i].data((name) => table.columns[1 + plotted.indexOf(name)], time);
    this.charts[i]?.setData([time, ...columns] as uPlot.AlignedData);
    const values = columns[0];
    setText(this.latest[i], `${fixed(values[values.length - 1], plots[i].digits)} ${plots[i].unit}`);
  }
}
