// What the page costs, measured by itself: for `window.understory.stats` and the tests.
import { Ring } from "./store/ring";

export class Meter {
  readonly script = new Ring(2048); // [ms] of the main thread per picture: its messages and its drawing
  readonly panels = new Ring(512); // [ms] of the main thread per update of the panels, five a second
  readonly pixel = new Ring(512); // [ms] from a message's arrival at the viewer to the screen
  longest = 0;
  pictures = 0;
  private carried = 0;

  /** Time that the next picture is charged with. */
  charge<T>(work: () => T): T {
    const begin = performance.now();
    const result = work();
    this.carried += performance.now() - begin;
    return result;
  }

  panelTurn(work: () => void): void {
    const begin = performance.now();
    work();
    this.panels.push(performance.now() - begin);
  }

  picture(): void {
    this.script.push(this.carried);
    this.longest = Math.max(this.longest, this.carried);
    this.carried = 0;
    this.pictures++;
  }

  reset(): void {
    this.script.clear();
    this.panels.clear();
    this.pixel.clear();
    this.longest = this.pictures = this.carried = 0;
  }
}

export function heapBytes(): number | null {
  return (performance as { memory?: { usedJSHeapSize: number } }).memory?.usedJSHeapSize ?? null;
}
