// node check.mjs BIN ROOT [--pictures DIR]: status 0 all hold, 1 not.
import { spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import WebSocket from "ws";
import { launch, open, state } from "../test/browser.mjs";
import { Stack, sleep, until } from "./stack.mjs";

const [bin, root] = process.argv.slice(2);
const at = process.argv.indexOf("--pictures");
const pictures = at < 0 ? null : process.argv[at + 1];
const must = (holds, what) => { if (!holds) throw new Error(what); };

const browser = await launch();
const stack = new Stack(bin, root);
const scratch = mkdtempSync(join(tmpdir(), "understory-elsewhere-"));
let elsewhere = null;
let failed = 0;
async function check(name, body) {
  const begin = Date.now();
  try {
    console.log(`ok    ${name}: ${await body()} [${((Date.now() - begin) / 1000).toFixed(1)} s]`);
  } catch (error) {
    console.log(`FAIL  ${name}: ${error.message}`);
    failed++;
  }
}

const process_of = async (page, name) => (await state(page)).processes.find((p) => p.name === name);
const landmarks = async (page) => (await state(page)).runs[0]?.landmarks ?? 0;

try {
  const address = await stack.page();
  const page = await open(browser, address);
  await check("the page opens and hears the processes", async () => {
    await until("six processes that are ok", async () => (await state(page)).processes.filter((p) => p.state === "ok").length >= 6);
    must((await state(page)).verdict.state === "waiting", "no pose has come, and the page does not say so");
    return `${(await state(page)).processes.length} processes`;
  });

  const drive = stack.sim("intermediate", "--path", "circle", "--seed", "7", "--rate", "3");
  await check("the map appears and numbers move", async () => {
    await until("50 landmarks and a pose", async () => (await landmarks(page)) >= 50 && (await state(page)).verdict.state === "ok");
    const before = (await state(page)).pose.utime;
    await until("another pose", async () => (await state(page)).pose.utime > before + 1e6);
    return `${await landmarks(page)} landmarks, ${(await state(page)).verdict.text}`;
  });

  await check("a landmark tells its story", async () => {
    // Number 1 of map 1.
    await page.evaluate(() => window.understory.select(String((1n << 48n) + 1n)));
    const [title] = await until("the story", async () => (await state(page)).story);
    await page.evaluate(() => window.understory.clearSelection());
    return title;
  });

  await check("a killed process turns red within 1 s and comes back", async () => {
    // It would be back before anybody sees that it was gone.
    process.kill(stack.launch.pid, "SIGSTOP");
    process.kill(stack.pid("loop_closer"), "SIGKILL");
    const [, ms] = await until("red", async () => (await process_of(page, "loop_closer")).state === "silent", 5000);
    process.kill(stack.launch.pid, "SIGCONT");
    must(ms <= 1000, `red only after ${ms} ms`);
    await until("ok again", async () => (await process_of(page, "loop_closer")).state === "ok");
    return `red after ${ms} ms`;
  });

  await check("a process that hangs turns red within 1 s", async () => {
    const pid = stack.pid("existence_tracker");
    process.kill(pid, "SIGSTOP");
    const [, ms] = await until("red", async () => (await process_of(page, "existence_tracker")).state === "silent", 5000);
    process.kill(pid, "SIGCONT");
    must(ms <= 1000, `red only after ${ms} ms`);
    await until("ok again", async () => (await process_of(page, "existence_tracker")).state === "ok");
    return `red after ${ms} ms`;
  });

  await check("ten stalled browsers change nothing on the bus", async () => {
    const stalled = [];
    for (let i = 0; i < 10; i++) {
      const socket = new WebSocket(address.replace("http", "ws") + "live");
      await new Promise((done) => socket.on("open", done));
      socket.pause();
      stalled.push(socket);
    }
    const before = (await state(page)).pose.utime;
    await sleep(3000);
    const after = (await state(page)).pose.utime;
    const listed = await stack.status();
    for (const socket of stalled) socket.terminate();
    must(after > before + 5e6, "poses stopped");
    const mapper = listed.find((p) => p.process === "geoslam_mapper");
    const lost = mapper.channels.reduce((sum, c) => sum + c.lost + c.dropped, 0);
    must(lost === 0, `the mapper lost ${lost} messages`);
    return `${((after - before) / 1e6).toFixed(0)} s of drive, the mapper lost nothing`;
  });

  await check("a page of elsewhere is refused", async () => {
    const refused = await new Promise((done) => {
      const socket = new WebSocket(address.replace("http", "ws") + "live", { origin: "http://evil.example" });
      socket.on("unexpected-response", (_, response) => done(response.statusCode));
      socket.on("open", () => done("opened"));
      socket.on("error", () => {});
    });
    must(refused === 403, `${refused}`);
    await until("counted", async () => (await (await fetch(address + "health.json")).json()).refused_origin >= 1, 2000);
    return "403, counted";
  });

  await check("other viewers are served by the Foxglove protocol", async () => {
    const heard = [];
    for (const protocol of ["foxglove.sdk.v1", "foxglove.websocket.v1"]) {
      const socket = new WebSocket(address.replace("http", "ws") + "foxglove", [protocol]);
      let channels = null, messages = 0;
      socket.on("message", (data, isBinary) => {
        if (isBinary) { messages++; return; }
        const text = JSON.parse(data.toString());
        if (text.op === "advertise") channels = text.channels;
      });
      await until("the list of topics", () => channels);
      const topic = channels.find((one) => one.topic === "/pose");
      socket.send(JSON.stringify({ op: "subscribe", subscriptions: [{ id: 1, channelId: topic.id }] }));
      await until("ten poses", () => messages >= 10);
      must(socket.protocol === protocol, `${socket.protocol} instead of ${protocol}`);
      socket.terminate();
      heard.push(`${channels.length} topics`);
    }
    return heard.join(", ");
  });

  if (pictures) {
    mkdirSync(pictures, { recursive: true });
    for (const theme of ["dark", "light"]) {
      const one = await open(browser, address, { width: 1600, height: 900, theme });
      await sleep(5000);
      await one.screenshot({ path: join(pictures, `page-${theme}.png`) });
      await one.close();
    }
  }

  await check("a vehicle whose poses stop is shown as silent", async () => {
    drive.kill("SIGINT");
    const [, ms] = await until("silent", async () => (await state(page)).verdict.state === "silent", 5000);
    return `after ${ms} ms`;
  });
  must(page.faults.length === 0, page.faults.join("\n"));

  // A map of another forest, of which nothing is here.
  await stack.stop();
  const log = join(scratch, "elsewhere.lcm"), run = join(scratch, "run.lcm"), map = join(scratch, "elsewhere.gpkg");
  for (const parameters of [
    ["sim", "intermediate", "--path", "circle", "--seed", "99", "--out", log],
    ["replay", log, "--out", run, "--stages", "keyframer,geoslam_mapper"],
    ["map", "import", run, "--out", map],
  ]) must(spawnSync(join(bin, "understory"), parameters).status === 0, `understory ${parameters.join(" ")}`);
  elsewhere = new Stack(bin, root, { options: ["--map", map, "--localisation-only"] });
  const lost = await open(browser, await elsewhere.page());
  elsewhere.sim("intermediate", "--path", "circle", "--seed", "7", "--rate", "3");
  await check("a vehicle that is nowhere in its map is shown as lost", async () => {
    const [text] = await until("lost", async () => {
      const { state: now, text } = (await state(lost)).verdict;
      must(now !== "ok", `the verdict is ok: ${text}`);
      return now === "lost" && text;
    });
    await until("the given map on the page", async () => (await landmarks(lost)) > 50);
    await until("LOST, for the driver", async () => (await lost.locator('[data-test="verdict-word"]').textContent()) === "LOST");
    return text;
  });
} catch (error) {
  console.log(`FAIL  ${error.message}\n${stack.output.slice(-2000)}`);
  failed++;
} finally {
  await browser.close();
  await stack.stop();
  await elsewhere?.stop();
  rmSync(scratch, { recursive: true, force: true });
}
console.log(failed ? `${failed} failed` : "all hold");
process.exit(failed ? 1 : 0);
