// What of the map is drawn; remembered, and for what costs the viewer something, told to it.

export const layerNames = {
  landmarks: "Landmarks", ellipses: "Covariance of landmarks", path: "Path", band: "Band of 3 sigma", keyframes: "Smoothed keyframes",
  vehicle: "Vehicle", truth: "Ground truth", scan: "Scan", detections: "Detections", matches: "Matches", hierarchy: "Hierarchy",
  submaps: "Submaps", closures: "Loop closures", second: "Second run", grid: "Grid",
} as const;
export type LayerName = keyof typeof layerNames;
export type Layers = Record<LayerName, boolean>;

const key = "layers";
const offAtFirst: LayerName[] = ["hierarchy", "scan"];

export function loadLayers(): Layers {
  const layers = Object.fromEntries(Object.keys(layerNames).map((n) => [n, !offAtFirst.includes(n as LayerName)])) as Layers;
  try {
    const kept = JSON.parse(localStorage.getItem(key) ?? "{}");
    for (const n of Object.keys(layers) as LayerName[]) if (typeof kept[n] === "boolean") layers[n] = kept[n];
  } catch {
    // What is stored is not ours: the defaults hold.
  }
  return layers;
}

export function keepLayers(layers: Layers): void { localStorage.setItem(key, JSON.stringify(layers)); }

/** The overlays of the protocol that the viewer is to send. */
export function wantedOverlays(layers: Layers): string[] {
  return [...(layers.hierarchy ? ["hierarchy"] : []), ...(layers.scan || layers.detections ? ["scan"] : [])];
}
