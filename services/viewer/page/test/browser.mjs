// The browser, and what the checks ask it.
import { existsSync } from "node:fs";

const places = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
export const executable = places.find((p) => p && existsSync(p));
const flags = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--headless=new", "--enable-precise-memory-info", "--js-flags=--expose-gc"];

export async function launch() {
  const { chromium } = await import("playwright-core");
  return chromium.launch({ executablePath: executable, args: flags });
}

/** A page that is open on `url`; what it throws or reports as an error is kept in `page.faults`. */
export async function open(browser, url, { width = 1280, height = 800, theme = "dark", query = "check" } = {}) {
  const context = await browser.newContext({ viewport: { width, height }, acceptDownloads: true });
  const page = await context.newPage();
  page.faults = [];
  page.on("pageerror", (e) => page.faults.push(String(e.stack ?? e)));
  page.on("console", (m) => m.type() === "error" && !/ERR_CONNECTION|WebSocket connection/.test(m.text()) && page.faults.push(m.text()));
  await page.goto(`${url}?${query}&theme=${theme}`);
  return page;
}

export const state = (page) => page.evaluate(() => window.understory.state());
export const stats = (page) => page.evaluate(() => window.understory.stats);
export const text = (page, name) => page.locator(`[data-test="${name}"]`).first().textContent();

export async function until(what, condition, limitMs = 20_000, pauseMs = 50) {
  const begin = Date.now();
  for (;;) {
    const value = await condition();
    if (value) return { value, ms: Date.now() - begin };
    if (Date.now() - begin > limitMs) throw new Error(`${what}: not within ${limitMs} ms`);
    await new Promise((done) => setTimeout(done, pauseMs));
  }
}

export const pictures = (page, n) => until(`${n} pictures`, async () => (await stats(page)).pictures >= n, 120_000, 100);

/** What `look(pixels)` gives in the page of a screenshot of the map, RGBA bytes. */
async function ofMap(page, look) {
  const png = await page.locator('[data-test="map"]').screenshot();
  const decode = async (data) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const g = new OffscreenCanvas(image.width, image.height).getContext("2d");
    g.drawImage(image, 0, 0);
    return g.getImageData(0, 0, image.width, image.height).data;
  };
  return page.evaluate(`(${decode})("${png.toString("base64")}").then(${look})`);
}

/** Number of colours, and the share of pixels that differ from the most frequent one, in a screenshot of the map. */
export const colours = (page) =>
  ofMap(page, (data) => {
    const pixels = new Uint32Array(data.buffer), counts = new Map();
    for (const p of pixels) counts.set(p, (counts.get(p) ?? 0) + 1);
    return { colours: counts.size, share: 1 - Math.max(...counts.values()) / pixels.length };
  });

/** Of the pixels of the map, the share in a colour of landmarks, by its name in the palette; a pixel at an edge is none. */
export const paints = (page) =>
  ofMap(page, (pixels) => {
    const palette = window.understory.palette(), shares = {};
    for (const [name, colour] of Object.entries(palette)) {
      let n = 0;
      for (let i = 0; i < pixels.length; i += 4) if (colour.every((c, k) => Math.abs(pixels[i + k] - 255 * c) < 14)) n++;
      shares[name] = n / (pixels.length / 4);
    }
    return { shares, palette: JSON.stringify(palette) };
  });

export function must(condition, text) {
  if (!condition) throw new Error(text);
}
