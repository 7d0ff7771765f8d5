// uPlot in the colours of the page.
import uPlot from "uplot";
import { css, type Rgb, type Theme } from "../theme";

export interface Line { label: string; colour: (t: Theme) => Rgb; dash?: number[]; width?: number }

export function chart(theme: Theme, lines: Line[], width: number, height: number, unit: string, leastRange = 0): uPlot {
  const muted = () => css(theme.palette.muted), grid = () => css(theme.palette.gridMajor);
  const axis = { stroke: muted, grid: { stroke: grid, width: 1 }, ticks: { show: false }, font: "11px system-ui, sans-serif", gap: 4 };
  return new uPlot({
    width, height, padding: [8, 26, 0, 0],
    legend: { show: false },
    cursor: { points: { size: 5 }, drag: { x: false, y: false }, y: false, sync: { key: "time" } },
    scales: { y: { range: (_u, min, max) => room(min, max, leastRange) } },
    axes: [
      { ...axis, size: 20, space: 70, values: (_u, ticks) => ticks.map((t) => new Date(t * 1000).toISOString().slice(11, 19)) },
      { ...axis, size: 44, space: 24, values: (_u, ticks) => ticks.map((t) => String(+t.toPrecision(6)) + (t === ticks[ticks.length - 1] && unit ? ` ${unit}` : "")) },
    ],
    series: [{}, ...lines.map((l) => ({ label: l.label, stroke: () => css(l.colour(theme)), width: l.width ?? 1.5, dash: l.dash, points: { show: false }, spanGaps: false }))],
  });
}

function room(min: number | null, max: number | null, least: number): [number, number] {
  const top = Math.max(max ?? 1, least), bottom = Math.min(0, min ?? 0);
  return [bottom, top + 0.08 * (top - bottom) || 1];
}
