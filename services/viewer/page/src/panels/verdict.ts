// What a driver must know, legible at two metres.
import { duration, fixed, h, metres, setText } from "../dom";
import { largestSigma } from "../store/run";
import { shownVerdict, type Shown, type Store } from "../store/store";

const marks: Record<Shown["state"], string> = {
  ok: "M5 12.500l4.500 4.500L19 7.500", unsure: "M12 5v8M12 17.500v.5", lost: "M6 6l12 12M18 6 6 18", silent: "M6 6l12 12M18 6 6 18",
  waiting: "M6 12h.01M12 12h.01M18 12h.01", offline: "M5 5l14 14M4 12a11 11 0 0 1 5-3M20 12a11 11 0 0 0-6-3.300M9 16a5 5 0 0 1 5-.5",
};

export class VerdictBanner {
  readonly element: HTMLElement;
  shown: Shown = { state: "waiting", word: "WAITING", text: "" };
  private readonly word = h("div", { class: "verdict-word", "data-test": "verdict-word" });
  private readonly text = h("div", { class: "verdict-text", "data-test": "verdict-text" });
  private readonly since = h("div", { class: "verdict-since" });
  private readonly figures = ["accuracy", "rate", "speed"].map((name) => ({
    value: h("div", { class: "figure-value", "data-test": `figure-${name}` }), label: h("div", { class: "figure-label" }),
  }));
  private readonly path: Element;

  constructor(private readonly store: Store, private readonly isOpen: () => boolean) {
    const mark = document.createElement("span");
    mark.className = "verdict-mark";
    mark.innerHTML = '<svg viewBox="0 0 24 24" aria-hidden="true"><path/></svg>';
    this.path = mark.querySelector("path")!;
    const figures = this.figures.map((f) => h("div", { class: "figure" }, f.value, f.label));
    this.element = h("header", { class: "verdict", "data-test": "verdict", role: "status", "aria-live": "polite" },
      mark, this.word, h("div", { class: "verdict-words" }, this.text, this.since), h("div", { class: "figures" }, ...figures));
  }

  update(): void {
    const shown = shownVerdict(this.store, this.isOpen(), Date.now());
    if (shown.state !== this.shown.state || !this.element.dataset.state) {
      this.element.dataset.state = shown.state;
      this.path.setAttribute("d", marks[shown.state]);
      document.title = `${shown.word} \u00b7 Understory`;
    }
    this.shown = shown;
    setText(this.word, shown.word);
    setText(this.text, shown.text);
    this.updateFigures();
  }

  private updateFigures(): void {
    const run = this.store.main, verdict = run?.verdict, pose = run?.pose;
    const age = run && verdict ? (run.utime - verdict.since_utime) / 1e6 : 0;
    const details = pose && pose.status !== this.shown.state ? [pose.status] : [];
    if (pose?.is_provisional) details.push("provisional");
    if (age >= 1 && this.shown.state === verdict?.state) details.push(`for ${duration(age)}`);
    setText(this.since, details.join(" \u00b7 "));
    this.element.classList.toggle("without-figures", !pose);
    const values: [string, string][] = [
      [pose ? metres(3 * largestSigma(pose)) : "\u2013", "3 sigma"],
      [pose ? `${fixed((3 * 180 / Math.PI) * Math.sqrt(Math.max(0, pose.covariance[8])), 1)}\u00b0` : "\u2013", "heading, 3 sigma"],
      [fixed(run?.numbers.rate_hz, 1), "poses per second"],
    ];
    values.forEach(([value, label], i) => {
      setText(this.figures[i].value, value);
      setText(this.figures[i].label, label);
    });
  }
}
