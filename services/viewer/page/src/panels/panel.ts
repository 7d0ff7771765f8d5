// A panel is an element with a title that brings itself up to date when it is told to; docks show one of their panels at a time.
import { h } from "../dom";

export interface Panel {
  readonly id: string;
  readonly title: string;
  readonly element: HTMLElement;
  /** Called a few times a second while it is shown. */
  update(): void;
  /** Said behind the title, e.g. how many processes are not well; empty: nothing. */
  badge?(): string;
}

export class Dock {
  readonly element = h("section", { class: "dock" });
  private readonly tabs = h("nav", { class: "tabs", role: "tablist" });
  private readonly body = h("div", { class: "dock-body" });
  private panels: Panel[] = [];
  private buttons = new Map<Panel, HTMLButtonElement>();
  shown: Panel | null = null;

  constructor(name: string) {
    this.element.dataset.dock = name;
    this.element.append(this.tabs, this.body);
  }

  set(panels: Panel[]): void {
    this.panels = panels;
    this.buttons = new Map(panels.map((p) => [p, this.button(p)]));
    this.tabs.replaceChildren(...this.buttons.values());
    this.element.hidden = panels.length === 0;
    const keep = panels.find((p) => p === this.shown) ?? panels[0];
    if (keep) this.show(keep);
    else this.body.replaceChildren();
  }

  show(panel: Panel): boolean {
    if (!this.panels.includes(panel)) return false;
    this.shown = panel;
    if (this.body.firstChild !== panel.element) this.body.replaceChildren(panel.element);
    for (const [p, b] of this.buttons) b.setAttribute("aria-selected", String(p === panel));
    panel.update();
    return true;
  }

  update(): void {
    this.shown?.update();
    for (const [p, b] of this.buttons) {
      const text = p.badge?.() ?? "";
      const badge = b.lastElementChild as HTMLElement;
      if (badge.textContent !== text) {
        badge.textContent = text;
        badge.hidden = text === "";
      }
    }
  }

  private button(panel: Panel): HTMLButtonElement {
    return h("button", { role: "tab", "data-test": `tab-${panel.id}`, click: () => this.show(panel) }, panel.title, h("span", { class: "badge", hidden: true }));
  }
}
