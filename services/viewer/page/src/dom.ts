// Elements and numbers, in as few words as the panels need.

type Child = Node | string | number | null | undefined | false;
type Attributes = Record<string, string | number | boolean | EventListener | undefined>;

export function h<K extends keyof HTMLElementTagNameMap>(tag: K, attributes: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const e = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") e.addEventListener(name, value);
    else if (value === true) e.setAttribute(name, "");
    else if (value !== false && value !== undefined) e.setAttribute(name, String(value));
  }
  for (const c of children) if (c !== null && c !== undefined && c !== false) e.append(c instanceof Node ? c : String(c));
  return e;
}

/** Writes only what differs: a text that is set again is laid out again. */
export function setText(e: Element, text: string): void {
  if (e.textContent !== text) e.textContent = text;
}

export const dash = "\u2013";

export function fixed(v: number | boolean | null | undefined, digits: number): string {
  return typeof v === "number" && Number.isFinite(v) ? v.toFixed(digits) : dash;
}

/** A length with the unit in which it reads best. */
export function metres(v: number | null | undefined): string {
  if (typeof v !== "number" || !Number.isFinite(v)) return dash;
  const a = Math.abs(v);
  return a < 1 ? `${(v * 100).toFixed(a < 0.1 ? 1 : 0)} cm` : a < 100 ? `${v.toFixed(2)} m` : a < 10000 ? `${v.toFixed(0)} m` : `${(v / 1000).toFixed(1)} km`;
}

export function duration(seconds: number): string {
  const s = Math.max(0, Math.floor(seconds));
  if (s < 60) return `${s} s`;
  if (s < 3600) return `${Math.floor(s / 60)} min ${String(s % 60).padStart(2, "0")} s`;
  if (s < 86400) return `${Math.floor(s / 3600)} h ${String(Math.floor((s % 3600) / 60)).padStart(2, "0")} min`;
  return `${Math.floor(s / 86400)} d ${Math.floor((s % 86400) / 3600)} h`;
}

/** Time of a log or of a drive: hh:mm:ss.t of the day, in UTC. */
export function clock(utime: number): string {
  return utime > 0 ? new Date(utime / 1000).toISOString().slice(11, 21) : dash;
}

export function count(v: number): string { return v.toLocaleString("en").replaceAll(",", "\u2009"); }

const paths: Record<string, string> = {
  follow: "M12 3v4M12 17v4M3 12h4M17 12h4M12 8a4 4 0 1 0 0 8 4 4 0 0 0 0-8",
  fit: "M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5",
  measure: "M3 16 16 3l5 5L8 21zM7 12l2 2M10 9l3 3M13 6l2 2",
  layers: "M12 3 2.5 8 12 13l9.5-5zM4 12l8 4.500 8-4.500M4 16l8 4.500 8-4.500",
  shot: "M4 8h3l2-3h6l2 3h3v11H4zM12 10a3.500 3.500 0 1 0 0 7 3.500 3.500 0 0 0 0-7",
  theme: "M12 4a8 8 0 1 0 0 16zM12 4a8 8 0 0 1 0 16",
  play: "M7 4.500v15l12-7.500z", pause: "M8 5v14M16 5v14",
};

export function icon(name: string): SVGElement {
  const ns = "http://www.w3.org/2000/svg", svg = document.createElementNS(ns, "svg"), path = document.createElementNS(ns, "path");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("class", "icon");
  svg.setAttribute("aria-hidden", "true");
  path.setAttribute("d", paths[name]);
  svg.append(path);
  return svg;
}
