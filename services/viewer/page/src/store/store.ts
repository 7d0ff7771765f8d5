// Everything the page knows, and who wants to hear of it.
import type { Arrays, Frame, Hello, PlayerState, VerdictState } from "../protocol";
import { Run } from "./run";

export class Store {
  hello: Hello | null = null;
  runs: Run[] = [];
  player: PlayerState | null = null;
  /** Wall clock of the newest frame [ms]. */
  heard = 0;

  greet(hello: Hello): void {
    this.hello = hello;
    this.runs = hello.runs.map((r, i) => new Run(i, r.name, r.colour_index));
    this.player = null;
  }

  /** Returns the run that the frame is of, or null when it is of none. */
  apply(frame: Frame, arrays: Arrays): Run | null {
    const run = this.runs[frame.run];
    if (!run) return null;
    this.heard = Date.now();
    if (frame.player) this.player = frame.player;
    run.apply(frame, arrays);
    return run;
  }

  get main(): Run | null { return this.runs[0] ?? null; }
  get other(): Run | null { return this.runs[1] ?? null; }
}

export interface Shown { state: VerdictState | "offline"; word: string; text: string }

const words: Record<Shown["state"], string> = {
  ok: "OK", unsure: "UNSURE", lost: "LOST", silent: "SILENT", waiting: "WAITING", offline: "NO CONNECTION",
};
/** In a live drive health comes once a second: without any frame for longer, what is shown is old, whatever it says. */
const staleMs = 3000;

function describe(store: Store): string {
  const shown = store.main?.revision?.version, revision = store.hello?.revisions?.find((r) => r.version === shown);
  return revision ? `Version ${revision.version}: ${revision.text}` : "Nothing drives here.";
}

/** The verdict as a driver is to see it: what is old or cut off is never shown as fine. */
export function shownVerdict(store: Store, isOpen: boolean, now: number): Shown {
  const verdict = store.main?.verdict;
  const make = (state: Shown["state"], text: string) => ({ state, word: words[state], text });
  if (!isOpen) return make("offline", "The viewer does not answer. What is shown is old.");
  if (!store.hello || !store.main?.frames) return make("waiting", "Connected, nothing received yet.");
  if (store.hello.mode === "live" && now - store.heard > staleMs && document.visibilityState === "visible") {
    return make("silent", `Nothing from the viewer for ${Math.round((now - store.heard) / 1000)} s.`);
  }
  if (store.hello.mode === "map") return { state: "waiting", word: "STORED MAP", text: describe(store) };
  if (!verdict) return make("waiting", "No verdict yet.");
  return make(verdict.state, verdict.text);
}
