// A log is played: the slider is its time; space stops and goes on, arrows jump.
import { clock, duration, h, icon, setText } from "../dom";
import type { Store } from "../store/store";

const rates = [0.25, 0.5, 1, 2, 4, 8, 16, 32];
/** While the slider is dragged the viewer is asked for a place at most this often [ms]. */
const pause = 120;

export class PlayerBar {
  readonly element: HTMLElement;
  private readonly button = h("button", { class: "tool play", "aria-label": "play or pause", "data-test": "play", click: () => this.toggle() });
  private readonly slider = h("input", { type: "range", min: 0, max: 1, step: "any", "aria-label": "time of the log", "data-test": "scrubber" });
  private readonly time = h("output", { class: "player-time", "data-test": "player-time" });
  private readonly rate = h("select", { "aria-label": "rate", "data-test": "rate", change: () => this.send({ play: { is_playing: this.isPlaying, rate: Number(this.rate.value) } }) },
    ...rates.map((r) => h("option", { value: r }, `${r} \u00d7`)));
  private isDragged = false;
  private sent = 0;
  private icon = "";

  constructor(private readonly store: Store, private readonly send: (m: unknown) => void) {
    this.element = h("div", { class: "player", "data-test": "player", hidden: true }, this.button, this.slider, this.time, this.rate);
    this.slider.addEventListener("input", () => {
      this.isDragged = true;
      if (performance.now() - this.sent > pause) this.seek(Number(this.slider.value));
    });
    this.slider.addEventListener("change", () => {
      this.isDragged = false;
      this.seek(Number(this.slider.value));
    });
  }

  update(): void {
    const p = this.store.player;
    this.element.hidden = this.store.hello?.mode !== "log" || !p;
    if (!p || this.element.hidden) return;
    this.slider.min = "0";
    this.slider.max = String((p.to - p.from) / 1e6);
    if (!this.isDragged) this.slider.value = String((p.utime - p.from) / 1e6);
    this.slider.style.setProperty("--share", `${(100 * (p.utime - p.from)) / Math.max(1, p.to - p.from)}%`);
    setText(this.time, `${clock(p.utime)}  ${duration((p.utime - p.from) / 1e6)} of ${duration((p.to - p.from) / 1e6)}`);
    const wanted = p.is_playing ? "pause" : "play";
    if (wanted !== this.icon) this.button.replaceChildren(icon((this.icon = wanted)));
    if (document.activeElement !== this.rate) this.rate.value = String(rates.reduce((a, b) => (Math.abs(b - p.rate) < Math.abs(a - p.rate) ? b : a)));
  }

  /** Returns whether the key was meant for it. */
  key(e: KeyboardEvent): boolean {
    const p = this.store.player;
    if (this.element.hidden || !p) return false;
    if (e.key === " ") this.toggle();
    else if (e.key === "ArrowLeft" || e.key === "ArrowRight") this.seek((p.utime - p.from) / 1e6 + (e.key === "ArrowLeft" ? -1 : 1) * (e.shiftKey ? 60 : 5));
    else return false;
    return true;
  }

  private get isPlaying(): boolean { return this.store.player?.is_playing ?? false; }
  private toggle(): void { this.send({ play: { is_playing: !this.isPlaying, rate: this.store.player?.rate ?? 1 } }); }

  private seek(seconds: number): void {
    const p = this.store.player!;
    this.sent = performance.now();
    this.send({ seek: Math.round(Math.min(p.to, Math.max(p.from, p.from + seconds * 1e6))) });
  }
}
