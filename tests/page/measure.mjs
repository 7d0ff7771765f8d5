// node measure.mjs BIN ROOT MINUTES OUT.json: what the page costs those who drive; see README.md.
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, readlinkSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { loadavg, tmpdir } from "node:os";
import { join } from "node:path";
import WebSocket from "ws";
import { launch, open, state, stats } from "../test/browser.mjs";
import { latencies, receipts } from "./latency.mjs";
import { Stack, sleep, until } from "./stack.mjs";

const [bin, root, minutesText, out] = process.argv.slice(2);
const minutes = Number(minutesText), scratch = mkdtempSync(join(tmpdir(), "understory-measure-"));
const channels = ["GROUND_TRUTH", "LANDMARKS", "TRACKED_LANDMARKS", "EKF_POSE", "KEYFRAME", "SLAM_POSE"];
const told = ["LANDMARKS", "EKF_POSE", "SLAM_POSE"];

/** Ticks (10 ms) and bytes of each of our processes. */
function processes() {
  const found = {};
  for (const pid of readdirSync("/proc").filter((name) => /^\d+$/.test(name))) {
    try {
      const program = readlinkSync(`/proc/${pid}/exe`).split("/").pop();
      if (!program.startsWith("understory-")) continue;
      const fields = readFileSync(`/proc/${pid}/stat`, "utf8").split(") ").pop().split(" ");
      found[program.slice(11)] = { ticks: Number(fields[11]) + Number(fields[12]), bytes: Number(fields[21]) * 4096 };
    } catch {} // it ended
  }
  return found;
}

function record(stack, log) {
  const child = spawn(join(bin, "understory"), ["log", "record", log, "--lcm-url", stack.url, "--channels", channels.join("|"), "--force"]);
  return async () => { child.kill("SIGINT"); await new Promise((done) => child.on("exit", done)); };
}

function rawDrive(stack, seed) {
  return stack.sim("forest3d", "--lidar", "vlp16", "--distance", String(Math.ceil(4 * 60 * (2 * minutes + 5))), "--cruise", "4", "--standstill", "5", "--seed", String(seed));
}

async function driving(page) {
  await until("a map and a pose", async () => {
    const { runs, verdict } = await state(page);
    return runs[0]?.landmarks >= 20 && verdict.state === "ok";
  }, 120_000);
}

/** Ten minutes from raw LIDAR with the page open; then the same with ten stalled browsers, a minute with, a minute without. */
async function raw(browser) {
  const stack = new Stack(bin, root, { folder: "lidar" });
  try {
    const address = await stack.page(), page = await open(browser, address);
    rawDrive(stack, 31);
    await driving(page);
    console.log(`raw LIDAR, page open, ${minutes} min`);
    const log = join(scratch, "page.lcm"), stop = record(stack, log);
    const before = processes(), begin = Date.now();
    await page.evaluate(() => window.understory.resetStats());
    await sleep(60_000 * minutes);
    const after = processes(), seconds = (Date.now() - begin) / 1000, pixels = (await stats(page)).pixelMs, load = loadavg()[1];
    await stop();
    const found = receipts(log, channels);
    const open_page = {
      minutes, load_5min: load, message_to_pixel_ms: pixels, landmarks: (await state(page)).runs[0].landmarks,
      channels: Object.fromEntries(told.map((name) => [name, latencies(found, name)])),
      processes: Object.fromEntries(Object.keys(after).filter((name) => before[name]).map((name) =>
        [name, { core_percent: +((after[name].ticks - before[name].ticks) / seconds).toFixed(1), megabytes: Math.round(after[name].bytes / 1e6) }])),
    };
    console.log(JSON.stringify(open_page, null, 1));
    return { open_page, ten_stalled: await stalledBrowsers(stack, page, address) };
  } finally {
    await stack.stop();
  }
}

async function stalledBrowsers(stack, page, address) {
  console.log("the same, ten stalled browsers in every second minute");
  const log = join(scratch, "stalled.lcm"), stop = record(stack, log), spans = [];
  for (let minute = 0; minute < minutes; minute++) {
    const sockets = [], stalled = minute % 2 === 1, begin = Date.now();
    for (let i = 0; stalled && i < 10; i++) {
      const socket = new WebSocket(address.replace("http", "ws") + "live");
      await new Promise((done) => socket.on("open", done));
      socket.pause();
      sockets.push(socket);
    }
    await sleep(60_000 - (Date.now() - begin));
    spans.push({ stalled, begin: begin * 1000, end: Date.now() * 1000 });
    for (const socket of sockets) socket.terminate();
  }
  const listed = await stack.status();
  await stop();
  const found = receipts(log, channels), of = {};
  for (const stalled of [false, true]) {
    const during = (time) => spans.some((span) => span.stalled === stalled && time >= span.begin && time < span.end);
    of[stalled ? "with" : "without"] = Object.fromEntries(told.map((name) => [name, latencies(found, name, during)]));
  }
  const lost = Object.fromEntries(listed.map((p) => [p.process, p.channels.reduce((sum, c) => sum + c.lost + c.dropped, 0)]));
  const result = { minutes_each: minutes / 2, ...of, lost_or_dropped_messages: lost };
  console.log(JSON.stringify(result, null, 1));
  return result;
}

/** A stored map of 10,000 trunks on a square kilometre, and a vehicle that drives in it. */
async function manyLandmarks(browser) {
  const survey = join(scratch, "survey.csv"), map = join(scratch, "survey.gpkg");
  let seed = 12345;
  const uniform = () => (seed = (seed * 1103515245 + 12345) % 2147483648) / 2147483648;
  const rows = Array.from({ length: 10_000 }, () => `${(1000 * uniform() - 500).toFixed(3)},${(1000 * uniform() - 500).toFixed(3)},${(0.1 + 0.4 * uniform()).toFixed(2)}`);
  writeFileSync(survey, `x_m,y_m,dbh_m\n${rows.join("\n")}\n`);
  const made = spawnSync(join(bin, "understory"), ["map", "import", survey, "--out", map, "--sigma-m", "0.05"]);
  if (made.status !== 0) throw new Error(`map import: ${made.stderr}`);
  const stack = new Stack(bin, root, { options: ["--map", map] });
  try {
    const page = await open(browser, await stack.page());
    await until("10,000 landmarks", async () => (await state(page)).runs[0]?.landmarks >= 9_900, 120_000);
    stack.sim(survey, "--path", "circle", "--length", "400", "--speed", "2", "--noise", "0.05", "--seed", "3");
    await driving(page);
    console.log("10,000 landmarks, 2 min");
    await page.evaluate(() => window.understory.resetStats());
    await sleep(120_000);
    const { pixelMs, scriptMs, landmarks, drawCalls } = await stats(page);
    const result = { landmarks, message_to_pixel_ms: pixelMs, script_ms: scriptMs, draw_calls: drawCalls, verdict: (await state(page)).verdict.text };
    console.log(JSON.stringify(result, null, 1));
    return result;
  } finally {
    await stack.stop();
  }
}

const browser = await launch();
try {
  const result = { command: `tests/page/measure BUILD ${minutes} OUT.json`, ...(await raw(browser)) };
  result.many_landmarks = await manyLandmarks(browser);
  writeFileSync(out, JSON.stringify(result, null, 1) + "\n");
} finally {
  await browser.close();
  rmSync(scratch, { recursive: true, force: true });
}
