// One line per process; what is not well is opened by itself, with its reasons.
import { count, dash, duration, fixed, h, setText } from "../dom";
import type { Process } from "../protocol";
import type { Store } from "../store/store";
import type { Panel } from "./panel";

interface Row { line: HTMLTableRowElement; cells: HTMLElement[]; more: HTMLTableRowElement; body: HTMLElement; shown: string }

export class HealthPanel implements Panel {
  readonly id = "health";
  readonly title = "Processes";
  readonly element: HTMLElement;
  private readonly body = h("tbody");
  private readonly empty = h("p", { class: "empty" }, "No process was heard yet.");
  private readonly rows = new Map<string, Row>();
  private order = "";
  private readonly opened = new Map<string, boolean>();

  constructor(private readonly store: Store) {
    const head = ["Process", "State", "Hz", "p50 ms", "p99 ms", "MB"].map((t, i) => h("th", { class: i > 1 ? "right" : "" }, t));
    this.element = h("div", { class: "health" }, this.empty, h("table", { class: "table", "data-test": "health" }, h("thead", {}, h("tr", {}, ...head)), this.body));
  }

  badge(): string {
    const n = (this.store.main?.processes ?? []).filter((p) => p.state !== "ok" && p.state !== "starting").length;
    return n ? String(n) : "";
  }

  update(): void {
    const processes = this.store.main?.processes ?? [];
    this.empty.hidden = processes.length > 0;
    const names = new Set(processes.map((p) => p.name));
    for (const [name, row] of this.rows) {
      if (names.has(name)) continue;
      row.line.remove();
      row.more.remove();
      this.rows.delete(name);
    }
    for (const p of processes) this.updateRow(this.rows.get(p.name) ?? this.add(p.name), p);
    this.sort(processes);
  }

  /** What needs a person stands first; the others in the order of the viewer. */
  private sort(processes: Process[]): void {
    const order = processes.map((p) => p.name);
    order.sort((a, b) => urgency(processes, a) - urgency(processes, b));
    const key = order.join();
    if (key === this.order) return;
    this.order = key;
    for (const name of order) this.body.append(this.rows.get(name)!.line, this.rows.get(name)!.more);
  }

  private add(name: string): Row {
    const cells: HTMLElement[] = [h("td", { class: "name" }), h("td"), ...[0, 0, 0, 0].map(() => h("td", { class: "right" }))];
    const pill = h("span", { class: "pill" });
    cells[1].append(pill);
    cells[1] = pill;
    const toggle = () => {
      this.opened.set(name, this.rows.get(name)!.more.hidden);
      this.update();
    };
    const line = h("tr", { class: "process", "data-test": `process-${name}`, tabindex: 0, click: toggle, keydown: (e) => (e as KeyboardEvent).key === "Enter" && toggle() });
    line.append(...cells.map((c) => (c === pill ? pill.parentElement! : c)));
    const body = h("td", { colspan: 6 }), more = h("tr", { class: "more", hidden: true }, body);
    this.body.append(line, more);
    const row = { line, cells, more, body, shown: "" };
    this.rows.set(name, row);
    return row;
  }

  private updateRow(row: Row, p: Process): void {
    row.line.dataset.state = p.state;
    const rates = p.channels.filter((c) => c.is_output), of = rates.length ? rates : p.channels;
    const rate = of.reduce((most, c) => Math.max(most, c.rate_hz), 0);
    const state = p.state === "silent" ? `silent ${duration(p.silent_s)}` : p.state;
    const texts = [p.name, state, fixed(rate, rate < 10 ? 1 : 0), fixed(p.latency_p50_us / 1000, 1), fixed(p.latency_p99_us / 1000, 1), fixed(p.rss_bytes / 1e6, 0)];
    texts.forEach((t, i) => setText(row.cells[i], t));
    const isIll = p.state === "silent" || p.state === "degraded" || p.state === "error";
    row.more.hidden = !(this.opened.get(p.name) ?? (isIll && (p.reasons.length > 0 || p.last_error !== "")));
    if (row.more.hidden) return;
    const key = JSON.stringify([p.reasons, p.last_error, p.channels, p.uptime_s, p.cpu_share]);
    if (key !== row.shown) row.body.replaceChildren(...details(p));
    row.shown = key;
  }
}

function urgency(processes: Process[], name: string): number {
  const at = ["silent", "error", "degraded"].indexOf(processes.find((p) => p.name === name)!.state);
  return at < 0 ? 3 : at;
}

function details(p: Process): Node[] {
  const reasons = p.reasons.map(([channel, reason, n]) => h("li", {}, h("b", {}, reason), ` ${channel || dash} `, h("span", { class: "times" }, `\u00d7 ${count(n)}`)));
  const error = p.last_error ? h("p", { class: "error-text" }, h("b", {}, p.last_error_code), ` ${p.last_error}`) : null;
  const channels = p.channels.map((c) => {
    const harm = [c.lost && `${count(c.lost)} lost`, c.malformed && `${count(c.malformed)} refused`, c.dropped && `${count(c.dropped)} dropped`].filter(Boolean);
    return h("li", { class: harm.length ? "warn" : "" }, h("i", {}, c.is_output ? "out" : "in"), ` ${c.channel} `, h("span", { class: "times" }, [`${fixed(c.rate_hz, 1)} Hz`, ...harm].join(", ")));
  });
  const facts = `up ${duration(p.uptime_s)}, version ${p.version}, ${count(p.handled)} handled` +
    (p.cpu_share === null ? "" : `, ${fixed(100 * p.cpu_share, 0)} % of a core`) + `, p90 ${fixed(p.latency_p90_us / 1000, 1)} ms, longest ${fixed(p.latency_max_us / 1000, 1)} ms`;
  return [...(error ? [error] : []), ...(reasons.length ? [h("ul", { class: "reasons" }, ...reasons)] : []), h("ul", { class: "channels" }, ...channels), h("p", { class: "facts" }, facts)];
}
