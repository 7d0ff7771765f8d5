// Why the system believes what it believes of one landmark, or how one pose came about.
import type uPlot from "uplot";
import { clock, fixed, h } from "../dom";
import type { Story } from "../protocol";
import type { Theme } from "../theme";
import { chart } from "./chart";
import type { Panel } from "./panel";

export class StoryPanel implements Panel {
  readonly id = "story";
  readonly title = "Story";
  readonly element = h("div", { class: "story", "data-test": "story" });
  private charts: { plot: uPlot; box: HTMLElement }[] = [];

  constructor(private readonly theme: Theme, private readonly onClose: () => void) {
    this.clear();
    theme.onChange(() => this.charts.forEach((c) => c.plot.redraw(false)));
  }

  clear(): void { this.say("Click a landmark or a place on the path: what it is, how it came about and from where it was seen."); }

  say(text: string): void {
    this.drop();
    this.element.replaceChildren(h("p", { class: "empty" }, text));
  }

  show(story: Story): void {
    this.drop();
    const parts: (Node | null)[] = [
      h("div", { class: "story-head" }, h("h2", { "data-test": "story-title" }, story.title ?? "Story"), h("button", { class: "quiet", "aria-label": "close", click: () => this.onClose() }, "\u00d7")),
      story.facts?.length ? h("dl", { class: "facts-list" }, ...story.facts.flatMap(([n, v]) => [h("dt", {}, n), h("dd", {}, String(v))])) : null,
      ...(story.series ?? []).filter((s) => s.t.length > 0).map((s) => this.series(s)),
      story.steps?.length ? this.steps(story.steps) : null,
      story.events?.length ? h("section", {}, h("h3", {}, "Events"), h("ol", { class: "events" }, ...story.events.map(([t, text]) => h("li", {}, h("time", {}, clock(t)), h("span", {}, text))))) : null,
      story.seen_from?.length ? h("p", { class: "facts" }, `Seen from ${story.seen_from.length} places: the rays on the map.`) : null,
    ];
    this.element.replaceChildren(...parts.filter((p): p is Node => p !== null));
    this.update();
  }

  update(): void {
    for (const c of this.charts) {
      const width = c.box.clientWidth;
      if (width > 0 && width !== c.plot.width) c.plot.setSize({ width, height: 120 });
    }
  }

  private series(s: NonNullable<Story["series"]>[number]): HTMLElement {
    const isShare = s.unit === "" || s.unit === "1", plot = chart(this.theme, [{ label: s.name, colour: (t) => t.palette.accent, width: 2 }], 380, 120, s.unit, isShare ? 1 : 0);
    plot.setData([s.t.map((t) => t / 1e6), s.v] as uPlot.AlignedData);
    const box = h("div", { class: "plot-box" }, plot.root);
    this.charts.push({ plot, box });
    return h("figure", { class: "plot" }, h("figcaption", {}, s.name, h("output", {}, `${fixed(s.v[s.v.length - 1], 3)} ${s.unit}`)), box);
  }

  private steps(steps: NonNullable<Story["steps"]>): HTMLElement {
    const whole = steps.reduce((sum, s) => sum + s.ms, 0) || 1;
    const rows = steps.map((s) => h("li", {},
      h("div", { class: "step-head" }, h("b", {}, s.name), h("span", { class: "times" }, `${fixed(s.ms, 2)} ms`)),
      bar(s.ms / whole), h("p", {}, s.text)));
    return h("section", {}, h("h3", {}, `Steps, ${fixed(whole, 1)} ms`), h("ol", { class: "steps", "data-test": "story-steps" }, ...rows));
  }

  private drop(): void {
    this.charts.forEach((c) => c.plot.destroy());
    this.charts = [];
  }
}

/** Set by script, not by an attribute, which a strict content security policy forbids. */
function bar(share: number): HTMLElement {
  const i = h("i");
  i.style.width = `${(100 * share).toFixed(1)}%`;
  return h("div", { class: "step-bar" }, i);
}
