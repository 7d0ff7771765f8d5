// Pictures of the page to be looked at: light and dark, narrow and wide, few and many landmarks, each mode.
import { mkdirSync } from "node:fs";
import { join } from "node:path";
import { open, pictures } from "./browser.mjs";

const sizes = { wide: { width: 1600, height: 900 }, narrow: { width: 420, height: 800 } };
const views = [
  ["200", "drive", null], ["100000", "medium", null], ["100000-all", "medium", () => window.understory.fit()], ["log", "log", null], ["map", "map", null],
  ["lost", "drive", null, (scene) => scene.setLost(true)],
  ["silent", "drive", null, (scene) => scene.setIll("ekf", "silent")],
  ["story", "drive", () => [...Array(200).keys()].some((i) => window.understory.select(String(281474976710657n + BigInt(i))))],
];

export async function screenshots({ browser, serve }, directory) {
  mkdirSync(directory, { recursive: true });
  for (const [name, scene, act, change] of views) {
    const server = await serve(scene);
    change?.(server.scene);
    for (const theme of ["light", "dark"]) {
      for (const [size, viewport] of Object.entries(sizes)) {
        const page = await open(browser, server.url, { ...viewport, theme });
        await pictures(page, scene === "map" ? 1 : 8);
        await page.waitForTimeout(1500);
        if (act) {
          await page.evaluate(act);
          await page.waitForTimeout(1500);
        }
        await page.screenshot({ path: join(directory, `${name}-${size}-${theme}.png`) });
        await page.context().close();
      }
    }
    await server.close();
  }
}
