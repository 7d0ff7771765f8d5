// What must hold of the page. A check takes {browser, serve} and returns what it measured, in words.
import { colours, must, open, paints, pictures, state, stats, text, until } from "./browser.mjs";

export const checks = {
  "the page opens, the map appears, numbers move": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 10);
    const seen = await colours(page);
    must(seen.colours > 20 && seen.share > 0.01, `the map is blank: ${JSON.stringify(seen)}`);
    const before = await state(page), poses = await text(page, "number-path");
    await until("a later pose", async () => (await state(page)).utime > before.utime + 1e6);
    await until("another number on the page", async () => (await text(page, "number-path")) !== poses);
    must((await state(page)).verdict.state === "ok", "the verdict is not ok");
    must(server.broken === 0 && [...server.clients][0].acks > 5, "frames are not acknowledged");
    must(page.faults.length === 0, page.faults.join("\n"));
    return `${seen.colours} colours, ${(100 * seen.share).toFixed(0)} % of the map drawn on`;
  },

  "a process that went silent is red within 1 s": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 5);
    server.scene.setIll("ekf", "silent");
    const row = page.locator('[data-test="process-ekf"]');
    const { ms } = await until("a red row", async () => (await row.getAttribute("data-state")) === "silent", 5000, 20);
    const colour = await row.locator(".pill").evaluate((e) => getComputedStyle(e).backgroundColor.match(/\d+/g).map(Number));
    must(colour[0] > 150 && colour[1] < 90 && colour[2] < 90, `not red: ${colour}`);
    must(ms <= 1000, `red only after ${ms} ms`);
    return `red after ${ms} ms`;
  },

  "a lost vehicle is shown as lost": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 5);
    server.scene.setLost(true);
    const { ms } = await until("LOST", async () => (await text(page, "verdict-word")) === "LOST", 5000, 20);
    must((await state(page)).pose.status === "lost", "the pose is not lost");
    const size = await page.locator('[data-test="verdict-word"]').evaluate((e) => parseFloat(getComputedStyle(e).fontSize));
    must(size >= 38, `the verdict is written in ${size} px`);
    return `after ${ms} ms`;
  },

  "a story opens at a click on a landmark": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 5);
    server.isHeld = true;
    const id = await page.evaluate(() => [...Array(200).keys()].map((i) => String(281474976710657n + BigInt(i))).find((i) => window.understory.select(i)));
    await until("a story", async () => (await state(page)).story?.includes(id));
    await page.evaluate(() => window.understory.clearSelection());
    const at = server.scene.worlds[0], i = Number(BigInt(id) - 281474976710657n);
    await page.evaluate(([x, y]) => window.understory.view(x, y, 40), [at.x[i], at.y[i]]);
    await page.waitForTimeout(300);
    const box = await page.locator('[data-test="map"]').boundingBox(), where = await page.evaluate(([x, y]) => window.understory.screenOf(x, y), [at.x[i], at.y[i]]);
    await page.mouse.click(box.x + where.x, box.y + where.y);
    await until("the story of the click", async () => (await state(page)).story?.includes(id));
    must((await page.locator(".story canvas").count()) === 1, "no chart of the probability");
    return `landmark ${id}`;
  },

  "a click on the path shows how a pose came about": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 5);
    server.isHeld = true;
    const { path } = server.scene.worlds[0], k = path.x.length - 130;
    await page.evaluate(([x, y]) => window.understory.view(x, y, 60), [path.x[k], path.y[k]]);
    await page.waitForTimeout(300);
    const box = await page.locator('[data-test="map"]').boundingBox();
    await page.mouse.click(box.x + box.width / 2, box.y + box.height / 2);
    await until("steps", async () => (await page.locator('[data-test="story-steps"] li').count()) === 5);
    return "5 steps";
  },

  "the page connects again, and says so meanwhile": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 5);
    const { port, scene } = server;
    await server.close();
    const gone = await until("NO CONNECTION", async () => (await text(page, "verdict-word")) === "NO CONNECTION", 5000, 20);
    await page.waitForTimeout(700);
    const again = await serve(scene, { port });
    const back = await until("OK", async () => (await state(page)).connection === "open" && (await text(page, "verdict-word")) === "OK", 15_000);
    await again.close();
    return `noticed after ${gone.ms} ms, back after ${back.ms} ms`;
  },

  "layers, overlays, measuring, screenshot": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 5);
    await page.keyboard.press("l");
    await page.locator('[data-test="layer-hierarchy"]').check();
    await until("edges", async () => (await state(page)).runs[0].edges > 0);
    must(server.messages.some((m) => m.overlays?.includes("hierarchy")), "the viewer was not asked for the hierarchy");
    await page.keyboard.press("Escape");
    await page.keyboard.press("m");
    const box = await page.locator('[data-test="map"]').boundingBox();
    for (const dx of [-60, 90]) await page.mouse.click(box.x + box.width / 2 + dx, box.y + box.height / 2 + 70);
    const measured = await until("a distance", async () => / m.*bearing/.test(await text(page, "readout")));
    const [download] = await Promise.all([page.waitForEvent("download"), page.locator('[data-test="tool-shot"]').click()]);
    must(/^understory-.*\.png$/.test(download.suggestedFilename()), download.suggestedFilename());
    must(measured.value && page.faults.length === 0, page.faults.join("\n"));
    return await text(page, "readout");
  },

  "a log is played, and two runs are compared": async ({ browser, serve }) => {
    const server = await serve("log"), page = await open(browser, server.url);
    await pictures(page, 10);
    await page.keyboard.press(" ");
    await until("a pause", async () => (await state(page)).player.is_playing === false);
    await page.keyboard.press("ArrowRight");
    await until("a jump", async () => server.messages.some((m) => Number.isInteger(m.seek)));
    await page.locator('[data-test="rate"]').selectOption("4");
    await until("a rate", async () => server.messages.some((m) => m.play?.rate === 4));
    const difference = await until("a difference", async () => /\d+ cm.*\u00b0/.test(await text(page, "difference")));
    must(difference.value && (await state(page)).runs.length === 2, "not two runs");
    return await text(page, "difference");
  },

  "versions of a map are compared": async ({ browser, serve }) => {
    const server = await serve("map"), page = await open(browser, server.url);
    await until("a difference", async () => (await state(page)).difference.added > 0);
    const before = (await state(page)).difference;
    await page.locator('[data-test="base-1"]').check();
    await until("another difference", async () => { const s = await state(page); return s.revision.base === 1 && s.difference.added !== before.added; });
    must((await state(page)).verdict.word === "STORED MAP", "a stored map has no verdict");
    return JSON.stringify((await state(page)).difference);
  },

  "a stored map shows how probable its landmarks are, and what one version alone has": async ({ browser, serve }) => {
    const server = await serve("map"), page = await open(browser, server.url), { palette } = await paints(page);
    const share = async () => (await paints(page)).shares;
    await page.locator('[data-test="base-4"]').check();
    await until("no difference", async () => { const s = await state(page); return s.revision.base === 4 && s.difference.added + s.difference.removed === 0; });
    await page.waitForTimeout(300);
    const same = await share();
    must(same.likely > 2 * same.unknown, `without a difference the map is grey: ${JSON.stringify(same)}`);
    must(same.added === 0 && same.removed === 0, `nothing differs, and it is drawn: ${JSON.stringify(same)}`);
    await page.locator('[data-test="base-1"]').check();
    await until("a difference", async () => { const s = await state(page); return s.revision.base === 1 && s.difference.added > 0 && s.difference.removed > 0; });
    await page.waitForTimeout(300);
    const other = await share();
    must(other.added > 0 && other.removed > 0, `a difference is not drawn in ${palette}: ${JSON.stringify(other)}`);
    must(other.likely > 2 * other.unknown, `with a difference the map is grey: ${JSON.stringify(other)}`);
    return JSON.stringify(other);
  },

  "the count of what was expected and not seen is that of the crosses": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 5);
    const world = server.scene.worlds[0], told = () => `${world.expected.length} of ${world.matched.length + world.expected.length}`;
    const { value } = await until("the count of the crosses", async () => { const shown = await text(page, "number-unseen"); return shown === told() && world.expected.length > 0 && shown; }, 10_000);
    must(/need.window_m/.test(await page.locator('.number:has([data-test="number-missing"])').getAttribute("title")), "the share of the map does not say of which path it is");
    return value;
  },

  "a message that is none does no harm": async ({ browser, serve }) => {
    const server = await serve("drive"), page = await open(browser, server.url);
    await pictures(page, 5);
    for (const data of [Buffer.from([255, 255, 255, 127, 1]), Buffer.alloc(0), Buffer.from("plain text")]) for (const c of server.clients) c.socket.send(data);
    const { pictures: n } = await stats(page);
    await pictures(page, n + 5);
    must((await stats(page)).refused === 3, "not all were counted");
    return "3 refused";
  },
};
