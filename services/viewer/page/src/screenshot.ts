// The map with what the page says of it, as a PNG file.
import type { Shown, Store } from "./store/store";
import type { MapView } from "./map/map";
import { clock, metres } from "./dom";
import { largestSigma } from "./store/run";
import { css, type Theme } from "./theme";
import { niceStep } from "./map/grid_layer";

export function screenshot(map: MapView, store: Store, theme: Theme, shown: Shown): void {
  const canvas = compose(map, store, theme, shown);
  canvas.toBlob((blob) => {
    if (!blob) return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `understory-${new Date().toISOString().slice(0, 19).replaceAll(":", "-")}.png`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  });
}

function compose(map: MapView, store: Store, theme: Theme, shown: Shown): HTMLCanvasElement {
  const { ratio, scale } = map.camera, { width, height } = map.canvas, head = 34 * ratio;
  const out = document.createElement("canvas"), p = theme.palette, run = store.main;
  out.width = width;
  out.height = height + head;
  const g = out.getContext("2d")!;
  g.fillStyle = css(p.background);
  g.fillRect(0, 0, out.width, out.height);
  // Drawn in the same turn: the canvas keeps no picture beyond it.
  map.draw();
  g.drawImage(map.canvas, 0, head);
  g.fillStyle = css(p.ink);
  g.font = `600 ${15 * ratio}px system-ui, sans-serif`;
  g.textBaseline = "middle";
  const pose = run?.pose, parts = [shown.word, shown.text, run ? clock(run.utime) : "", pose ? `3 sigma ${metres(3 * largestSigma(pose))}` : "", run ? `${run.landmarks.used} landmarks` : ""];
  g.fillText(parts.filter(Boolean).join("   "), 12 * ratio, head / 2, out.width - 24 * ratio);
  const step = niceStep(70 / scale), length = step * scale * ratio, y = out.height - 14 * ratio, x = out.width - 16 * ratio - length;
  g.fillRect(x, y, length, 2 * ratio);
  g.textAlign = "center";
  g.font = `${12 * ratio}px system-ui, sans-serif`;
  g.fillText(step < 1 ? `${+(step * 100).toPrecision(3)} cm` : step < 1000 ? `${step} m` : `${step / 1000} km`, x + length / 2, y - 9 * ratio);
  return out;
}
