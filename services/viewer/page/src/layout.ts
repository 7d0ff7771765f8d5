// Wide: map beside two docks. Narrow: map above one dock with all panels.
import { h } from "./dom";
import { Dock, type Panel } from "./panels/panel";

export interface Panels { numbers: Panel; health: Panel; plots: Panel; log: Panel; story: Panel; revisions: Panel }

export class Layout {
  readonly stage = h("section", { class: "stage" });
  readonly element: HTMLElement;
  private readonly upper = new Dock("upper");
  private readonly lower = new Dock("lower");
  private readonly strip = h("section", { class: "strip" });
  private readonly narrow = matchMedia("(max-width: 900px)");

  constructor(banner: HTMLElement, private readonly panels: Panels, private readonly hasRevisions: () => boolean) {
    this.element = h("div", { class: "page" }, banner, this.stage, h("aside", { class: "side" }, this.strip, this.upper.element, this.lower.element));
    this.narrow.addEventListener("change", () => this.arrange());
    this.arrange();
  }

  arrange(): void {
    const { numbers, health, plots, log, story, revisions } = this.panels, versions = this.hasRevisions() ? [revisions] : [];
    this.strip.hidden = this.narrow.matches;
    if (this.narrow.matches) {
      this.lower.set([]);
      this.upper.set(versions.length ? [...versions, numbers, story] : [health, numbers, plots, log, story]);
    } else {
      this.strip.replaceChildren(numbers.element);
      this.upper.set(versions.length ? [...versions, story] : [health, story]);
      // Of a stored map there is nothing to plot.
      this.lower.set(versions.length ? [] : [plots, log]);
    }
  }

  show(panel: Panel): void {
    if (!this.upper.show(panel)) this.lower.show(panel);
  }

  update(): void {
    if (!this.narrow.matches) this.panels.numbers.update();
    this.upper.update();
    this.lower.update();
  }
}
