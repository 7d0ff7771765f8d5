// What the processes said to a person; the newest at the bottom, kept in view unless one scrolls back.
import { clock, h } from "../dom";
import type { LogLine } from "../protocol";
import type { Store } from "../store/store";
import type { Panel } from "./panel";

const levels = ["debug", "info", "warning", "error"] as const;

export class LogPanel implements Panel {
  readonly id = "log";
  readonly title = "Log";
  readonly element: HTMLElement;
  private readonly list = h("ol", { class: "log", "data-test": "log" });
  private least = 1;
  private wanted = "";
  private shown = "";

  constructor(private readonly store: Store) {
    const level = h("select", { "aria-label": "least level", "data-test": "log-level", change: () => this.filter(level.selectedIndex, this.wanted) },
      ...levels.map((l, i) => h("option", { selected: i === this.least }, i === 0 ? "all levels" : i === 3 ? "errors" : `${l}s and up`.replace("infos", "info"))));
    const search = h("input", { type: "search", placeholder: "Filter", "aria-label": "filter", input: () => this.filter(this.least, search.value.toLowerCase()) });
    this.element = h("div", { class: "log-panel" }, h("div", { class: "bar" }, level, search), this.list);
  }

  badge(): string {
    const n = (this.store.main?.log ?? []).filter((l) => l.level === "error").length;
    return n ? String(n) : "";
  }

  update(): void {
    const run = this.store.main, key = `${run?.logVersion}|${this.least}|${this.wanted}`;
    if (!run || key === this.shown) return;
    this.shown = key;
    const isAtEnd = this.list.scrollTop + this.list.clientHeight >= this.list.scrollHeight - 30;
    const lines = run.log.filter((l) => levels.indexOf(l.level) >= this.least && (!this.wanted || `${l.process} ${l.code} ${l.channel} ${l.text}`.toLowerCase().includes(this.wanted)));
    this.list.replaceChildren(...lines.slice(-200).map(line));
    if (isAtEnd) this.list.scrollTop = this.list.scrollHeight;
  }

  private filter(least: number, wanted: string): void {
    this.least = least;
    this.wanted = wanted;
    this.update();
  }
}

function line(l: LogLine): HTMLElement {
  return h("li", { class: `level-${l.level}` }, h("time", {}, clock(l.utime)), h("b", {}, l.process), h("span", { class: "log-text" }, l.text, " ", h("i", {}, [l.channel, l.code].filter(Boolean).join(" "))));
}
