// Checks of the page in a real browser, without the C++ side: node test/run.mjs [--only WORD] [--screenshots DIR] [--url URL] [--without-budget]
// With --url the page of a running viewer is looked at instead of the mock server's. Status: 0 all hold, 1 not, 77 no browser here.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { spawnSync } from "node:child_process";
import { fileURLToPath } from "node:url";
import { executable, launch } from "./browser.mjs";
import { budget } from "./budget.mjs";
import { checks } from "./checks.mjs";
import { MockServer, scenes } from "./mock/server.mjs";
import { screenshots } from "./screenshots.mjs";
import { smoke } from "./smoke.mjs";

const option = (name) => { const at = process.argv.indexOf(`--${name}`); return at < 0 ? null : process.argv[at + 1]; };
if (!executable) {
  console.log("skipped: no chromium here (apt install chromium, or its path in CHROMIUM)");
  process.exit(77);
}

const here = dirname(fileURLToPath(import.meta.url)), dist = mkdtempSync(join(tmpdir(), "understory-page-"));
const built = spawnSync(process.execPath, [join(here, "../build.mjs"), dist], { stdio: "inherit" });
if (built.status !== 0) process.exit(1);

const browser = await launch(), servers = [];
const serve = async (scene, { port = 0 } = {}) => {
  const server = await new MockServer(dist, typeof scene === "string" ? scenes[scene]() : scene).listen(port);
  servers.push(server);
  return server;
};

async function run(name, check) {
  const begin = Date.now();
  try {
    console.log(`ok    ${name}: ${await check({ browser, serve })} [${((Date.now() - begin) / 1000).toFixed(1)} s]`);
    return true;
  } catch (error) {
    console.log(`FAIL  ${name}: ${error.message}`);
    return false;
  } finally {
    for (const c of browser.contexts()) await c.close();
    for (const s of servers.splice(0)) await s.close().catch(() => {});
  }
}

const url = option("url"), only = option("only"), directory = option("screenshots");
const all = url ? smoke(url) : process.argv.includes("--without-budget") ? checks : { ...checks, ...budget };
const chosen = Object.entries(all).filter(([name]) => !only || name.includes(only));
let failed = 0;
if (!directory || only) for (const [name, check] of chosen) if (!(await run(name, check))) failed++;
if (directory && !(await run(`screenshots in ${directory}`, async (t) => (await screenshots(t, directory), "written")))) failed++;
await browser.close();
rmSync(dist, { recursive: true });
console.log(failed ? `${failed} failed` : "all hold");
process.exit(failed ? 1 : 0);
