// What the page may cost: calls, time of the main thread, memory. Rasterising is not counted: here it is done in software.
import { cpus, loadavg } from "node:os";
import { must, open, pictures, state, stats, until } from "./browser.mjs";

const limits = { drawCalls: 20, scriptMs: 4 };

async function measured({ browser, serve }, scene, prepare, wanted = 40) {
  const server = await serve(scene), page = await open(browser, server.url, { query: "" });
  await pictures(page, 5);
  await page.waitForTimeout(1500);
  await prepare?.(page);
  await page.waitForTimeout(1000);
  // The best of three spans: another program on this computer can only add to the time.
  let best = null;
  for (let i = 0; i < 3; i++) {
    await page.evaluate(() => window.understory.resetStats());
    await until("pictures", async () => (await stats(page)).pictures >= wanted, 180_000, 200);
    const s = await stats(page);
    if (!best || s.scriptMs.p95 < best.scriptMs.p95) best = s;
    if (best.scriptMs.p95 <= limits.scriptMs) break;
  }
  return { best, page };
}

function told(s) {
  const f = (v) => v.toFixed(1);
  return `${s.landmarks} landmarks, ${s.pathPoints} points of paths: ${s.drawCalls} calls; script ${f(s.scriptMs.p50)} / ${f(s.scriptMs.p95)} ms (p50 / p95), ` +
    `panels ${f(s.panelMs.p95)} ms (p95), message to pixel ${f(s.pixelMs.p50)} / ${f(s.pixelMs.p99)} ms (p50 / p99), heap ${(s.heap / 1e6).toFixed(0)} MB`;
}

function within(s, landmarks, points) {
  must(s.landmarks >= landmarks && s.pathPoints >= points, `only ${s.landmarks} landmarks and ${s.pathPoints} points`);
  must(s.drawCalls <= limits.drawCalls, `${s.drawCalls} draw calls`);
  if (s.scriptMs.p95 <= limits.scriptMs) return told(s);
  // Where others want the processor too, their turns are in the 95th percentile; half of the pictures are free of them.
  const isBusy = loadavg()[0] > cpus().length;
  must(isBusy && s.scriptMs.p50 <= limits.scriptMs, `script ${s.scriptMs.p95.toFixed(1)} ms (p95)`);
  return `computer busy (load ${loadavg()[0].toFixed(0)} on ${cpus().length} cores), p50 held to the limit; ${told(s)}`;
}

export const budget = {
  "200 landmarks within the budget": async (t) => within((await measured(t, "drive")).best, 20, 300),
  "100,000 landmarks within the budget": async (t) => within((await measured(t, "medium")).best, 100_000, 20_000),
  "1,000,000 landmarks and poses within the budget, followed": async (t) => within((await measured(t, "large")).best, 1_000_000, 1_000_000),
  "1,000,000 landmarks and poses within the budget, all in view": async (t) => within((await measured(t, "large", (page) => page.evaluate(() => window.understory.fit()))).best, 1_000_000, 1_000_000),

  "no picture when nothing has changed": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 5);
    server.isHeld = true;
    await page.waitForTimeout(800);
    const before = (await stats(page)).pictures;
    await page.waitForTimeout(2000);
    const more = (await stats(page)).pictures - before;
    must(more === 0, `${more} pictures of nothing new`);
    return "none in 2 s";
  },

  "the heap does not grow with the hours": async ({ browser, serve }) => {
    const server = await serve("fast"), page = await open(browser, server.url, { query: "" });
    await pictures(page, 5);
    const heap = async () => page.evaluate(() => { window.gc?.(); window.gc?.(); return performance.memory.usedJSHeapSize; });
    const hours = async () => { const s = await state(page); return [s.utime / 3.6e9, s.runs[0].path]; };
    // Path and truth are kept, 24 bytes a point, up to a bound; what grows beyond that would be a leak.
    const [t0, p0] = await hours();
    await until("the first hours", async () => (await hours())[0] - t0 > 3, 180_000, 500);
    const [t1, p1] = await hours(), h1 = await heap();
    await until("more hours", async () => (await hours())[0] - t1 > 3, 180_000, 500);
    const [t2, p2] = await hours(), h2 = await heap(), ofPath = 2 * 24 * (p2 - p1), rest = h2 - h1 - ofPath;
    must(rest < 4e6, `the heap grew by ${(rest / 1e6).toFixed(1)} MB beyond the path`);
    return `${(t1 - t0).toFixed(1)} h: ${(h1 / 1e6).toFixed(1)} MB, ${(t2 - t0).toFixed(1)} h: ${(h2 / 1e6).toFixed(1)} MB (${p2 - p0} poses more)`;
  },
};
