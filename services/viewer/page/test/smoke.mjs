// What must hold of a page on a real viewer, whatever it shows.
import { colours, must, open, pictures, state, stats, until } from "./browser.mjs";

export const smoke = (url) => ({
  "the page opens and is connected": async ({ browser }) => {
    const page = await open(browser, url);
    await until("a connection", async () => (await state(page)).connection === "open");
    await until("a mode", async () => (await state(page)).mode !== null);
    return (await state(page)).mode;
  },
  "the map appears": async ({ browser }) => {
    const page = await open(browser, url);
    await pictures(page, 1);
    await until("something on the map", async () => (await colours(page)).colours > 8);
    const s = await state(page), { drawCalls, refused } = await stats(page);
    must(refused === 0, `${refused} messages refused`);
    must(page.faults.length === 0, page.faults.join("\n"));
    return `${s.verdict.word}, ${s.runs.map((r) => `${r.landmarks} landmarks`).join(", ")}, ${s.processes.length} processes, ${drawCalls} calls`;
  },
});
