// Buttons, scale bar, legend and readouts that lie on the map.
import { clock, fixed, h, icon, metres, setText } from "../dom";
import { largestSigma } from "../store/run";
import type { Store } from "../store/store";
import type { Theme } from "../theme";
import { niceStep } from "./grid_layer";
import { keepLayers, layerNames, type LayerName } from "./layers";
import type { MapView } from "./map";
import { measured } from "./ruler";

export interface Actions { redraw(): void; layersChanged(): void; screenshot(): void }

export class MapTools {
  readonly element = h("div", { class: "map-tools" });
  isMeasuring = false;
  private readonly buttons: Record<string, HTMLButtonElement> = {};
  private readonly menu = h("div", { class: "menu", hidden: true, "data-test": "layers-menu" });
  private readonly scaleBar = h("div", { class: "scale-bar" }, h("span"));
  private readonly readout = h("div", { class: "readout", "data-test": "readout", hidden: true });
  private readonly difference = h("div", { class: "readout second", "data-test": "difference", hidden: true });
  private readonly about = h("span", { "data-test": "about" });
  private readonly legend = h("div", { class: "legend" });
  private legendOf = "";

  constructor(private readonly map: MapView, private readonly store: Store, private readonly theme: Theme, private readonly actions: Actions) {
    const bar = h("div", { class: "toolbar" },
      this.button("follow", "Follow the vehicle (f)", () => this.follow(!map.isFollowing)),
      this.button("fit", "Show everything (a)", () => this.fit()),
      this.button("measure", "Measure (m)", () => this.measure(!this.isMeasuring)),
      this.button("layers", "Layers (l)", () => this.openMenu(this.menu.hidden)),
      this.button("shot", "Screenshot (s)", () => actions.screenshot()),
      this.button("theme", "Light or dark (t)", () => theme.toggle()));
    this.fillMenu();
    this.element.append(h("div", { class: "title" }, h("b", {}, "Understory"), this.about), bar, this.menu, h("div", { class: "readouts" }, this.readout, this.difference), h("div", { class: "map-foot" }, this.legend, this.scaleBar));
    this.follow(map.isFollowing);
  }

  follow(value: boolean): void {
    this.map.isFollowing = value;
    this.buttons.follow.setAttribute("aria-pressed", String(value));
    this.actions.redraw();
  }

  fit(): void {
    this.map.fit();
    this.follow(false);
  }

  measure(value: boolean): void {
    this.isMeasuring = value;
    this.map.ruler = [];
    this.buttons.measure.setAttribute("aria-pressed", String(value));
    this.map.canvas.style.cursor = value ? "crosshair" : "";
    this.actions.redraw();
  }

  openMenu(value: boolean): void {
    this.menu.hidden = !value;
    this.buttons.layers.setAttribute("aria-pressed", String(value));
  }

  /** A click while measuring: to the landmark there, or to the place. */
  measureAt(px: number, py: number): void {
    const found = this.map.pick(px, py), at = this.map.camera.toMap(px, py);
    if (this.map.ruler.length === 2) this.map.ruler = [];
    this.map.ruler.push(found ?? { ...at, slot: -1, run: 0 });
    this.actions.redraw();
  }

  key(key: string): boolean {
    const actions: Record<string, () => void> = {
      f: () => this.follow(!this.map.isFollowing), a: () => this.fit(), m: () => this.measure(!this.isMeasuring), l: () => this.openMenu(this.menu.hidden),
      s: () => this.actions.screenshot(), t: () => this.theme.toggle(),
    };
    actions[key]?.();
    return key in actions;
  }

  update(): void {
    const c = this.map.camera, step = niceStep(70 / c.scale);
    this.scaleBar.style.width = `${(step * c.scale).toFixed(1)}px`;
    setText(this.scaleBar.firstElementChild!, step < 1 ? `${+(step * 100).toPrecision(3)} cm` : step < 1000 ? `${step} m` : `${step / 1000} km`);
    const run = this.store.main, hello = this.store.hello;
    this.buttons.follow.hidden = hello?.mode === "map";
    setText(this.about, run && hello ? [run.name, hello.mode === "map" ? "" : clock(run.utime)].filter(Boolean).join("  \u00b7  ") : "");
    this.updateReadouts();
    this.updateLegend();
  }

  private updateReadouts(): void {
    const { ruler } = this.map;
    this.readout.hidden = !this.isMeasuring;
    if (this.isMeasuring) setText(this.readout, ruler.length === 2 ? measured(this.store, ruler) : ruler.length ? "Click the second place." : "Click two places or landmarks.");
    const a = this.store.main?.pose, b = this.store.other?.pose;
    this.difference.hidden = !(a && b && this.map.layers.second && this.store.hello?.mode !== "map");
    if (this.difference.hidden || !a || !b) return;
    const turn = Math.atan2(Math.sin(b.theta - a.theta), Math.cos(b.theta - a.theta)) * (180 / Math.PI);
    setText(this.difference, `${this.store.other!.name} \u2212 ${this.store.main!.name}: ${metres(Math.hypot(b.x - a.x, b.y - a.y))}, ${fixed(turn, 2)}\u00b0 ` +
      `(3 sigma ${metres(3 * largestSigma(a))} and ${metres(3 * largestSigma(b))})`);
  }

  private updateLegend(): void {
    const isMap = this.store.hello?.mode === "map", names = this.map.shownRuns().map((r) => r.name), revision = this.store.main?.revision;
    const isCompared = isMap && names.length > 1 && revision?.version !== revision?.base;
    const key = `${isMap} ${isCompared} ${names}`;
    if (key === this.legendOf) return;
    this.legendOf = key;
    const entry = (css: string, text: string) => h("span", { class: "legend-entry" }, h("i", { class: css }), text);
    const runs = names.length > 1 && !isMap ? names.map((n, i) => entry(`line run-${i}`, n)) : [];
    const sign = (css: string, text: string, what: string) => h("span", { class: "legend-entry" }, h("b", { class: css }, text), what);
    const versions = isCompared ? [sign("added", "+", "only in this version"), sign("removed", "\u00d7", "only in the base")] : [];
    const marks = [h("span", { class: "legend-entry" }, "exists: 0", h("i", { class: "ramp" }), "1"), entry("dot unknown", "unknown"), entry("dot hollow", "out of use")];
    this.legend.replaceChildren(...runs, ...versions, ...marks);
  }

  private button(name: string, title: string, act: () => void): HTMLButtonElement {
    return (this.buttons[name] = h("button", { class: "tool", title, "aria-label": title, "data-test": `tool-${name}`, click: act }, icon(name)));
  }

  private fillMenu(): void {
    for (const name of Object.keys(layerNames) as LayerName[]) {
      const box = h("input", { type: "checkbox", checked: this.map.layers[name], "data-test": `layer-${name}`, change: () => {
        this.map.layers[name] = box.checked;
        keepLayers(this.map.layers);
        this.actions.layersChanged();
      } });
      this.menu.append(h("label", {}, box, layerNames[name]));
    }
  }
}
