// Counts and shares that need no plot.
import { count, dash, fixed, h, metres, setText } from "../dom";
import type { Store } from "../store/store";
import type { Panel } from "./panel";

type Row = [id: string, label: string, value: () => string, isBad?: () => boolean];

/** What means something of a map that nothing drives in. */
const ofMap = ["landmarks", "unused"];

export class NumbersPanel implements Panel {
  readonly id = "numbers";
  readonly title = "Numbers";
  readonly element = h("dl", { class: "numbers", "data-test": "numbers" });
  private readonly cells: HTMLElement[];
  private readonly rows: Row[];

  constructor(private readonly store: Store, skipped: () => number, pixel: () => [number, number]) {
    const n = () => store.main?.numbers ?? {};
    const share = (v: unknown) => (typeof v === "number" ? `${(100 * v).toFixed(0)} %` : dash);
    this.rows = [
      ["landmarks", "Landmarks in use", () => (store.main ? count(store.main.landmarks.used - store.main.landmarks.unused) : dash)],
      ["unused", "Out of use", () => (store.main ? count(store.main.landmarks.unused) : dash)],
      ["error", "Error", () => `${metres(n().error_m as number)}`],
      ["error-deg", "Error of heading", () => (typeof n().error_deg === "number" ? `${fixed(n().error_deg, 2)}\u00b0` : dash)],
      ["missing", "Expected, not seen", () => share(n().missing_share)],
      ["new", "Seen, not in the map", () => share(n().new_share)],
      ["mapping", "Mapping needed", () => (n().is_mapping_needed === undefined || n().is_mapping_needed === null ? dash : n().is_mapping_needed ? "yes" : "no"),
        () => n().is_mapping_needed === true],
      ["latency", "Latency of the pose", () => (typeof n().latency_ms === "number" ? `${fixed(n().latency_ms, 1)} ms` : dash)],
      ["pixel", "Message to pixel", () => pixel().map((v) => fixed(v, 0)).join(" / ") + " ms"],
      ["clients", "Clients, skipped", () => `${fixed(n().clients, 0)}, ${count(skipped())}`],
      ["map", "Map, submap", () => (store.main?.pose ? `${store.main.pose.map_id}, ${store.main.pose.submap_id}` : dash)],
      ["path", "Poses of the path", () => (store.main ? count(store.main.path.total) : dash)],
    ];
    this.cells = this.rows.map(([id, label]) => {
      const value = h("dd", { "data-test": `number-${id}` });
      this.element.append(h("div", { class: "number" }, h("dt", {}, label), value));
      return value;
    });
  }

  update(): void {
    const isMap = this.store.hello?.mode === "map";
    this.rows.forEach(([id, , value, isBad], i) => {
      this.cells[i].parentElement!.hidden = isMap && !ofMap.includes(id);
      setText(this.cells[i], value());
      this.cells[i].classList.toggle("warn", isBad?.() ?? false);
    });
  }
}
