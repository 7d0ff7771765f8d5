// What the page costs, measured by itself: for `window.understory.stats` and the tests.
import { Ring } from "./store/ring";

export class Meter {
  readonly script = new Ring(2048); // [ms] of the main thread per picture: messages, drawing, panels
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

  picture(): void {
    this.script.push(this.carried);
    this.longest = Math.max(this.longest, this.carried);
    this.carried = 0;
    this.pictures++;
  }

  reset(): void {
    this.script.clear();
    this.pixel.clear();
    this.longest = this.pictures = this.carried = 0;
  }
}

export function heapBytes(): number | null {
  return (performance as { memory?: { usedJSHeapSize: number } }).memory?.usedJSHeapSize ?? null;
}
