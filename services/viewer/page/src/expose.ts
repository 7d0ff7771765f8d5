// `window.understory`: what tests and the curious ask the page.
import type { App } from "./app";
import { heapBytes } from "./stats";

export function expose(app: App): void {
  const api = {
    state: () => state(app),
    get stats() { return stats(app); },
    resetStats: () => app.meter.reset(),
    select: (id: string, run = 0) => app.selectLandmark(id, run),
    clearSelection: () => app.closeStory(),
    view: (x: number, y: number, scale: number) => {
      app.tools.follow(false);
      Object.assign(app.map.camera, { x, y, scale });
      app.redraw();
    },
    fit: () => app.tools.fit(),
    screenOf: (x: number, y: number) => app.map.camera.toScreen(x, y),
    redraw: () => app.redraw(),
    palette: () => {
      const { likely, unknown, added, removed } = app.theme.palette;
      return { likely, unknown, added, removed };
    },
  };
  (window as unknown as { understory: typeof api }).understory = api;
}

function state(app: App) {
  const { store } = app, run = store.main;
  return {
    connection: app.connection.state, mode: store.hello?.mode ?? null, verdict: app.verdict.shown,
    pose: run?.pose ?? null, utime: run?.utime ?? 0, numbers: run?.numbers ?? {}, player: store.player, revision: run?.revision ?? null,
    processes: (run?.processes ?? []).map((p) => ({ name: p.name, state: p.state })),
    runs: store.runs.map((r) => ({
      name: r.name, frames: r.frames, landmarks: r.landmarks.used, unused: r.landmarks.unused, path: r.path.total, keyframes: r.keyframes.total,
      closures: r.closures.length, submaps: r.submaps.length, edges: r.hierarchy.a.length, log: r.log.length,
    })),
    camera: { x: app.map.camera.x, y: app.map.camera.y, scale: app.map.camera.scale }, following: app.map.isFollowing,
    story: app.story.element.querySelector("h2")?.textContent ?? null, difference: { added: app.comparison.added, removed: app.comparison.removed },
  };
}

function stats(app: App) {
  const [p50, p95] = app.meter.script.quantiles(0.5, 0.95), [m50, m99] = app.meter.pixel.quantiles(0.5, 0.99);
  return {
    panelMs: { p95: app.meter.panels.quantiles(0.95)[0] },
    drawCalls: app.map.drawCalls, scriptMs: { p50, p95, max: app.meter.longest }, pixelMs: { p50: m50, p99: m99 },
    landmarks: app.store.runs.reduce((n, r) => n + r.landmarks.used, 0), pathPoints: app.store.runs.reduce((n, r) => n + r.path.length, 0),
    pictures: app.meter.pictures, heap: heapBytes(), bytes: app.connection.bytes, refused: app.connection.refused,
  };
}
