// Counts and shares that need no plot.
import { count, dash, fixed, h, metres, setText } from "../dom";
import type { Store } from "../store/store";
import type { Panel } from "./panel";

interface Row { id: string; label: string; about?: string; value: () => string; isBad?: () => boolean }

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
    const main = () => store.main, matches = () => store.main?.matches;
    this.rows = [
      { id: "landmarks", label: "Landmarks in use", value: () => (main() ? count(main()!.landmarks.used - main()!.landmarks.unused) : dash) },
      { id: "unused", label: "Out of use", value: () => (main() ? count(main()!.landmarks.unused) : dash) },
      { id: "error", label: "Error", value: () => metres(n().error_m as number) },
      { id: "error-deg", label: "Error of heading", value: () => (typeof n().error_deg === "number" ? `${fixed(n().error_deg, 2)}\u00b0` : dash) },
      { id: "unseen", label: "Expected, not seen", about: "Of the landmarks in use that the last keyframe should have seen: the crosses on the map.",
        value: () => (matches() ? `${count(main()!.unseenSlots.length)} of ${count(matches()!.expected)}` : dash) },
      { id: "missing", label: "Map: gone", about: "Of the landmarks of the map that were looked for on the last metres of path (need.window_m): never seen there, beyond what the detector misses anyhow.",
        value: () => share(n().missing_share) },
      { id: "new", label: "Map: new", about: "Of the landmarks that were seen on the last metres of path (need.window_m): new to the map. On a first drive all are.", value: () => share(n().new_share) },
      { id: "mapping", label: "Mapping needed", about: "Whether a map of an earlier drive has changed so much (gone and new together) that it should be mapped again.",
        value: () => (typeof n().is_mapping_needed === "boolean" ? (n().is_mapping_needed ? "yes" : "no") : dash), isBad: () => n().is_mapping_needed === true },
      { id: "latency", label: "Latency of the pose", value: () => (typeof n().latency_ms === "number" ? `${fixed(n().latency_ms, 1)} ms` : dash) },
      { id: "pixel", label: "Message to pixel", value: () => pixel().map((v) => fixed(v, 0)).join(" / ") + " ms" },
      { id: "clients", label: "Clients, skipped", value: () => `${fixed(n().clients, 0)}, ${count(skipped())}` },
      { id: "map", label: "Map, submap", value: () => (main()?.pose ? `${main()!.pose!.map_id}, ${main()!.pose!.submap_id}` : dash) },
      { id: "path", label: "Poses of the path", value: () => (main() ? count(main()!.path.total) : dash) },
    ];
    this.cells = this.rows.map(({ id, label, about }) => {
      const value = h("dd", { "data-test": `number-${id}` });
      this.element.append(h("div", { class: "number", title: about }, h("dt", {}, label), value));
      return value;
    });
  }

  update(): void {
    const isMap = this.store.hello?.mode === "map";
    this.rows.forEach(({ id, value, isBad }, i) => {
      this.cells[i].parentElement!.hidden = isMap && !ofMap.includes(id);
      setText(this.cells[i], value());
      this.cells[i].classList.toggle("warn", isBad?.() ?? false);
    });
  }
}
