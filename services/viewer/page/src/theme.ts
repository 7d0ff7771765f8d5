// Colours of the map, and which theme is on. The page's own colours are in style.css; both follow one switch.

export type Rgb = [number, number, number];
export interface Palette {
  background: Rgb; gridMinor: Rgb; gridMajor: Rgb; ink: Rgb; muted: Rgb; accent: Rgb; runs: Rgb[]; truth: Rgb;
  unknown: Rgb; unlikely: Rgb; doubtful: Rgb; likely: Rgb; warn: Rgb; bad: Rgb; added: Rgb; removed: Rgb; scan: Rgb;
  hierarchy: Rgb[]; submap: Rgb; detection: Rgb;
}

function rgb(hex: string): Rgb {
  const n = parseInt(hex.slice(1), 16);
  return [(n >> 16) / 255, ((n >> 8) & 255) / 255, (n & 255) / 255];
}
export function css([r, g, b]: Rgb): string { return `rgb(${Math.round(r * 255)} ${Math.round(g * 255)} ${Math.round(b * 255)})`; }

// Existence goes from amber over magenta to blue: told apart with each of the common colour deficiencies, and never grey, which is
// for what is unknown.
const dark: Palette = {
  background: rgb("#0e1311"), gridMinor: rgb("#171e1b"), gridMajor: rgb("#232c28"), ink: rgb("#e8eeea"), muted: rgb("#87958d"),
  accent: rgb("#3fd0a0"), runs: [rgb("#3fd0a0"), rgb("#c8a6ff")], truth: rgb("#d7dedA"), unknown: rgb("#8a948e"),
  unlikely: rgb("#ffb000"), doubtful: rgb("#e8478c"), likely: rgb("#6a9bff"), warn: rgb("#f5b942"), bad: rgb("#ff5d55"),
  added: rgb("#4fdc8f"), removed: rgb("#ff5d55"), scan: rgb("#b6c4bc"), hierarchy: [rgb("#3a4f6b"), rgb("#8f7bd6")],
  submap: rgb("#6f8a7c"), detection: rgb("#ffffff"),
};
const light: Palette = {
  background: rgb("#f8f9f6"), gridMinor: rgb("#eff1ec"), gridMajor: rgb("#dfe3dc"), ink: rgb("#17201b"), muted: rgb("#6a766f"),
  accent: rgb("#07795a"), runs: [rgb("#07795a"), rgb("#7a3fd0")], truth: rgb("#2a332e"), unknown: rgb("#98a19b"),
  unlikely: rgb("#e68a00"), doubtful: rgb("#c9246b"), likely: rgb("#2458c9"), warn: rgb("#b87400"), bad: rgb("#c8201b"),
  added: rgb("#07795a"), removed: rgb("#c8201b"), scan: rgb("#5c6a62"), hierarchy: [rgb("#b9c8dc"), rgb("#7a62c9")],
  submap: rgb("#7f9488"), detection: rgb("#17201b"),
};

export class Theme {
  private chosen: string | null;
  private readonly system = matchMedia("(prefers-color-scheme: dark)");
  private readonly listeners: (() => void)[] = [];

  constructor() {
    const wanted = new URLSearchParams(location.search).get("theme");
    this.chosen = wanted === "dark" || wanted === "light" ? wanted : localStorage.getItem("theme");
    this.system.addEventListener("change", () => this.tell());
    this.tell();
  }

  get isDark(): boolean { return this.chosen ? this.chosen === "dark" : this.system.matches; }
  get palette(): Palette { return this.isDark ? dark : light; }

  toggle(): void {
    this.chosen = this.isDark ? "light" : "dark";
    localStorage.setItem("theme", this.chosen);
    this.tell();
  }

  onChange(listener: () => void): void { this.listeners.push(listener); }

  private tell(): void {
    document.documentElement.dataset.theme = this.isDark ? "dark" : "light";
    this.listeners.forEach((l) => l());
  }
}
