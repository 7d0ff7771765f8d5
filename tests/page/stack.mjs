// `understory launch` with the viewer, on a multicast group and a port of its own.
import { spawn } from "node:child_process";
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

export const sleep = (ms) => new Promise((done) => setTimeout(done, ms));

/** Waits until `holds` gives something; throws with `what` after `ms`. Gives [value, milliseconds]. */
export async function until(what, holds, ms = 30_000) {
  const begin = Date.now();
  while (Date.now() - begin < ms) {
    const value = await holds();
    if (value) return [value, Date.now() - begin];
    await sleep(20);
  }
  throw new Error(`not within ${ms} ms: ${what}`);
}

/** Of the kernel: the processes below launch, by the end of their program's name. */
function children(pid) {
  const found = {};
  const list = readFileSync(`/proc/${pid}/task/${pid}/children`, "utf8").trim();
  for (const child of list.split(" ").filter(Boolean)) {
    const name = readFileSync(`/proc/${child}/cmdline`, "utf8").split("\0")[0].split("/").pop();
    found[name.replace("understory-", "").replaceAll("-", "_")] = Number(child);
  }
  return found;
}

export class Stack {
  /** `folder` below deploy/config; `options` of launch. */
  constructor(bin, root, { folder = "", options = [] } = {}) {
    this.bin = bin;
    this.directory = mkdtempSync(join(tmpdir(), "understory-live-"));
    cpSync(join(root, "deploy/config"), join(this.directory, "config"), { recursive: true });
    const config = join(this.directory, "config", folder);
    writeFileSync(join(config, "viewer.toml"), "[page]\nport = 0\n");
    this.url = `udpm://239.255.76.67:${20_000 + Math.floor(Math.random() * 10_000)}?ttl=0`;
    this.output = "";
    this.children = [];
    this.launch = this.start(["launch", "--config", config, "--state-dir", join(this.directory, "state"), "--lcm-url", this.url, ...options]);
  }
  start(parameters) {
    const child = spawn(join(this.bin, "understory"), parameters);
    for (const stream of [child.stdout, child.stderr]) stream.on("data", (text) => (this.output += text));
    return child;
  }
  async page() {
    const [address] = await until("the viewer's address", () => this.output.match(/http:\/\/[0-9.:]+\//g)?.at(-1));
    return address;
  }
  pid(name) { return children(this.launch.pid)[name]; }
  sim(...parameters) {
    this.children.push(this.start(["sim", ...parameters, "--lcm-url", this.url]));
    return this.children.at(-1);
  }
  /** HEALTH of all processes, as `understory status` has it. */
  async status() {
    const child = spawn(join(this.bin, "understory"), ["status", "--once", "--json", "--lcm-url", this.url]);
    let text = "";
    child.stdout.on("data", (part) => (text += part));
    await new Promise((done) => child.on("close", done));
    const parsed = JSON.parse(text);
    return parsed.processes ?? parsed;
  }
  async stop() {
    if (this.launch.exitCode !== null || this.launch.signalCode !== null) return;
    for (const child of this.children) child.kill("SIGINT");
    this.launch.kill("SIGCONT");
    this.launch.kill("SIGTERM");
    await until("the end of launch", () => this.launch.exitCode !== null || this.launch.signalCode !== null, 20_000).catch(() => this.launch.kill("SIGKILL"));
    rmSync(this.directory, { recursive: true, force: true });
  }
}
