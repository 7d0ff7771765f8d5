// The versions of a stored map: which one is shown, and against which its differences are.
import { count, h } from "../dom";
import type { Store } from "../store/store";
import type { Panel } from "./panel";

export class RevisionsPanel implements Panel {
  readonly id = "revisions";
  readonly title = "Versions";
  readonly element = h("div", { class: "revisions", "data-test": "revisions" });
  private shown = "";
  private version = -1;
  private base = -1;

  constructor(private readonly store: Store, private readonly send: (m: unknown) => void, private readonly difference: () => { added: number; removed: number }) {}

  update(): void {
    const revisions = this.store.hello?.revisions ?? [], now = this.store.main?.revision;
    if (now) ({ version: this.version, base: this.base } = now);
    const d = this.difference(), key = JSON.stringify([revisions.length, this.version, this.base, d]);
    if (key === this.shown) return;
    this.shown = key;
    const head = h("p", { class: "difference" }, "Version ", h("b", {}, this.version < 0 ? "?" : this.version), " against ", h("b", {}, this.base < 0 ? "?" : this.base), ": ",
      h("span", { class: "added", "data-test": "added" }, `${count(d.added)} added`), ", ", h("span", { class: "removed", "data-test": "removed" }, `${count(d.removed)} removed`));
    const rows = [...revisions].reverse().map((r) => h("tr", { class: r.version === this.version ? "chosen" : "" },
      h("td", {}, this.radio("version", r.version, this.version)), h("td", {}, this.radio("base", r.version, this.base)),
      h("td", { class: "right" }, r.version), h("td", {}, h("div", {}, r.text), h("time", {}, new Date(r.utime / 1000).toISOString().slice(0, 16).replace("T", " "))), h("td", { class: "right" }, count(r.landmarks))));
    this.element.replaceChildren(head, h("table", { class: "table" }, h("thead", {}, h("tr", {}, ...["Show", "Base", "No.", "What", "Landmarks"].map((t, i) => h("th", { class: i === 2 || i === 4 ? "right" : "" }, t)))), h("tbody", {}, ...rows)));
  }

  private radio(name: "version" | "base", value: number, chosen: number): HTMLElement {
    return h("input", { type: "radio", name: `revision-${name}`, "aria-label": `${name} ${value}`, "data-test": `${name}-${value}`, checked: value === chosen, change: () => {
      this[name] = value;
      this.send({ revision: this.version, base: this.base });
    } });
  }
}
