// Binds connection, store, map and panels.
import { Comparison } from "./compare";
import { Connection } from "./connection";
import { Layout } from "./layout";
import { listen } from "./map/gestures";
import { wantedOverlays } from "./map/layers";
import { MapView } from "./map/map";
import { MapTools } from "./map/tools";
import { h } from "./dom";
import { HealthPanel } from "./panels/health";
import { LogPanel } from "./panels/log";
import { NumbersPanel } from "./panels/numbers";
import { PlayerBar } from "./panels/player";
import { PlotsPanel } from "./panels/plots";
import { RevisionsPanel } from "./panels/revisions";
import { StoryPanel } from "./panels/story";
import { VerdictBanner } from "./panels/verdict";
import type { Message, StoryAnswer } from "./protocol";
import { screenshot } from "./screenshot";
import { Meter } from "./stats";
import { Store } from "./store/store";
import { Theme } from "./theme";

/** Texts need no more pictures per second than this. */
const panelPause = 200;

export class App {
  readonly store = new Store();
  readonly theme = new Theme();
  readonly meter = new Meter();
  readonly comparison = new Comparison();
  readonly map: MapView;
  readonly tools: MapTools;
  readonly verdict: VerdictBanner;
  readonly story: StoryPanel;
  readonly connection: Connection;
  private readonly revisions: RevisionsPanel;
  private readonly layout: Layout;
  private readonly player: PlayerBar;
  private isScheduled = false;
  private newest = 0; // wall_ms of the newest frame that is not on the screen yet
  private request = 0;
  private asked: { request: number; x: number; y: number; slot: number; run: number } | null = null;

  constructor(root: HTMLElement) {
    const { store, theme, meter } = this, canvas = h("canvas", { class: "map", "data-test": "map", "aria-label": "map" });
    const send = (m: unknown) => void this.connection.send(m);
    this.map = new MapView(canvas, store, theme);
    this.verdict = new VerdictBanner(store, () => this.connection?.state === "open");
    this.story = new StoryPanel(theme, () => this.closeStory());
    this.player = new PlayerBar(store, send);
    this.revisions = new RevisionsPanel(store, send, () => this.comparison);
    const pixel = () => meter.pixel.quantiles(0.5, 0.99) as [number, number];
    this.layout = new Layout(this.verdict.element, {
      numbers: new NumbersPanel(store, () => store.main?.skipped ?? 0, pixel), health: new HealthPanel(store), plots: new PlotsPanel(store, theme),
      log: new LogPanel(store), story: this.story, revisions: this.revisions,
    }, () => store.hello?.mode === "map");
    this.tools = new MapTools(this.map, store, theme, {
      redraw: () => this.redraw(), layersChanged: () => this.layersChanged(), screenshot: () => screenshot(this.map, store, theme, this.verdict.shown),
    });
    this.layout.stage.append(canvas, this.tools.element, this.player.element);
    root.append(this.layout.element);
    this.connection = new Connection(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`, (m) => meter.charge(() => this.take(m)), (s) => this.linkChanged(s));
    this.listen(canvas);
  }

  redraw(): void {
    if (this.isScheduled) return;
    this.isScheduled = true;
    requestAnimationFrame(() => this.picture());
  }

  selectLandmark(id: string, run: number): boolean {
    const l = this.store.runs[run]?.landmarks, slot = l?.slotOf(id) ?? -1;
    if (slot < 0) return false;
    this.askLandmark(slot, run);
    return true;
  }

  closeStory(): void {
    this.map.selection = null;
    this.asked = null;
    this.story.clear();
    this.redraw();
  }

  private picture(): void {
    this.isScheduled = false;
    this.meter.charge(() => {
      if (this.map.draw()) this.redraw();
      this.tools.update();
      this.verdict.update();
    });
    this.meter.picture();
    const shown = performance.timeOrigin + performance.now();
    if (this.newest) this.meter.pixel.push(shown - this.newest);
    this.newest = 0;
    this.connection.acknowledge(Math.round(shown));
  }

  private take({ header, arrays }: Message): void {
    if (header.kind === "hello") {
      const isSame = JSON.stringify(this.store.hello?.runs) === JSON.stringify(header.runs);
      this.store.greet(header);
      this.map.restart(isSame);
      this.layout.arrange();
      if (header.mode === "map") this.layout.show(this.revisions);
      this.connection.send({ overlays: wantedOverlays(this.map.layers) });
    } else if (header.kind === "frame") {
      this.store.apply(header, arrays);
      this.connection.willShow(header.seq);
      this.newest = header.wall_ms;
      if (this.store.hello?.mode === "map" && this.store.main && this.store.other) this.comparison.update(this.store.main.landmarks, this.store.other.landmarks);
      this.followSelection();
    } else if (header.kind === "story") this.answer(header);
    this.redraw();
  }

  private linkChanged(state: string): void {
    document.documentElement.dataset.link = state;
    this.meter.charge(() => this.verdict.update());
  }

  private layersChanged(): void {
    this.connection.send({ overlays: wantedOverlays(this.map.layers) });
    this.redraw();
  }

  private click(px: number, py: number): void {
    if (this.tools.isMeasuring) return this.tools.measureAt(px, py);
    this.tools.openMenu(false);
    const found = this.map.pick(px, py);
    if (found) return this.askLandmark(found.slot, found.run);
    const at = this.map.camera.toMap(px, py);
    for (const run of this.map.shownRuns()) {
      const pose = run.path.nearest(at.x, at.y, 12 / this.map.camera.scale);
      if (pose && pose.utime > 0) return this.ask({ ask: "pose", utime: pose.utime, run: run.index }, { ...pose, slot: -1, run: run.index });
    }
    this.closeStory();
  }

  private askLandmark(slot: number, run: number): void {
    const l = this.store.runs[run].landmarks;
    this.ask({ ask: "landmark", id: l.idOf(slot), run }, { x: l.drawn[4 * slot], y: l.drawn[4 * slot + 1], slot, run });
  }

  private ask(question: object, place: { x: number; y: number; slot: number; run: number }): void {
    this.asked = { ...place, request: ++this.request };
    this.map.selection = { ...place, rays: [] };
    this.story.say("Asked \u2026");
    this.layout.show(this.story);
    this.connection.send({ ...question, request: this.request });
    this.redraw();
  }

  private answer(a: StoryAnswer): void {
    if (a.request !== this.asked?.request) return;
    if (!a.ok || !a.story) return this.story.say(a.error || "Nothing is known of it.");
    this.story.show(a.story);
    if (this.map.selection) this.map.selection.rays = a.story.seen_from ?? [];
  }

  /** The ring stays on a landmark that moves. */
  private followSelection(): void {
    const s = this.map.selection;
    if (!s || s.slot < 0) return;
    const { drawn } = this.store.runs[s.run].landmarks;
    [s.x, s.y] = [drawn[4 * s.slot], drawn[4 * s.slot + 1]];
  }

  private listen(canvas: HTMLCanvasElement): void {
    listen(this.map, () => this.redraw(), (x, y) => this.click(x, y), () => this.tools.follow(false));
    new ResizeObserver(() => {
      this.map.resize(canvas.clientWidth, canvas.clientHeight, Math.min(2, devicePixelRatio));
      this.redraw();
    }).observe(canvas);
    this.theme.onChange(() => this.redraw());
    setInterval(() => this.meter.panelTurn(() => this.panels()), panelPause);
    addEventListener("keydown", (e) => {
      if (isForControl(e) || e.ctrlKey || e.metaKey || e.altKey) return;
      if (e.key === "Escape") this.escape();
      else if (!this.player.key(e) && !this.tools.key(e.key)) return;
      e.preventDefault();
    });
  }

  private escape(): void {
    this.tools.measure(false);
    this.tools.openMenu(false);
    this.closeStory();
  }

  private panels(): void {
    this.verdict.update();
    this.player.update();
    this.layout.update();
  }
}

/** Whether the key means something to the control that has the focus. */
function isForControl(e: KeyboardEvent): boolean {
  const t = e.target;
  if (t instanceof HTMLSelectElement) return true;
  if (!(t instanceof HTMLInputElement) || t.type === "range") return false;
  return t.type === "search" || e.key === " " || e.key.startsWith("Arrow");
}
