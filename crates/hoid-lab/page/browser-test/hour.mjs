// A long session in real time: memory of page and server, missed frames, verified runs. A simulated person
// tracks one run after the other while a second window is open.
// Usage: node hour.mjs PROGRAM [MINUTES]; PROGRAM is hoid with the feature lab. Prints a table in Markdown.
//
// Every half minute: the resident memory of the server and the JavaScript heap of both windows. After each run,
// outside the measurement: the heap of the tracking window after garbage collection, which a leak would
// increase. The slopes are those of least-squares lines through the samples after the first run.
import assert from "node:assert/strict";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { cpus, tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { browserOrEnd, lab, operator } from "./lab.mjs";

const [program, asked = "60"] = process.argv.slice(2);
const minutes = Number(asked);
assert.ok(minutes > 0, `found ${asked} minutes, expected a number above zero`);
const path = browserOrEnd();

// Runs of 90 s, shorter if the session is short; one more run than the time allows.
const measurement = minutes < 5 ? 12 : 80;
const runIn = minutes < 5 ? 3 : 10;
const runs = Math.ceil((60 * minutes) / (measurement + runIn)) + 1;
const folder = mkdtempSync(join(tmpdir(), "hoid-lab-hour-"));
const config = join(folder, "lab.toml");
writeFileSync(
  config,
  `name = "A long session"
order = "given"
live = "during"
[[condition]]
name = "long"
measurement_s = ${measurement}
run_in_s = ${runIn}
break_s = 0
runs = ${runs}
target = { rms = 1.5 }
`,
);

const MB = 1e6;
const began = performance.now();
const at = () => (performance.now() - began) / 60_000;

/** Resident memory of a process in MB; undefined without /proc. */
function resident(pid) {
  try {
    const line = /VmRSS:\s+(\d+) kB/.exec(readFileSync(`/proc/${pid}/status`, "utf8"));
    return line ? (1024 * Number(line[1])) / MB : NaN;
  } catch {
    return NaN;
  }
}

/** The slope of a quantity per hour, with its standard error. */
function slope(samples) {
  const known = samples.filter(([, value]) => Number.isFinite(value));
  const n = known.length;
  if (n < 3) return [NaN, NaN];
  const mean = (of) => known.reduce((sum, sample) => sum + of(sample), 0) / n;
  const [t, v] = [mean(([t]) => t), mean(([, v]) => v)];
  const square = known.reduce((sum, [x]) => sum + (x - t) ** 2, 0);
  const b = known.reduce((sum, [x, y]) => sum + (x - t) * (y - v), 0) / square;
  const rest = known.reduce((sum, [x, y]) => sum + (y - v - b * (x - t)) ** 2, 0);
  return [60 * b, 60 * Math.sqrt(rest / (n - 2) / square)];
}

const browser = await chromium.launch({ executablePath: path, args: ["--no-sandbox"] });
const server = await lab(program, "--out", join(folder, "out"), "--config", config);
try {
  const window = async (address) => {
    const context = await browser.newContext({ viewport: { width: 1200, height: 800 } });
    const page = await context.newPage();
    page.on("pageerror", (error) => assert.fail(`the page: ${error}`));
    await page.goto(address);
    const inside = await context.newCDPSession(page);
    return { page, inside, heap: async () => (await inside.send("Runtime.getHeapUsage")).usedSize / MB };
  };
  const person = await window(server.address);
  const looksOn = await window(`${server.address}experimenter`);
  const { page } = person;
  await page.locator("#subject").fill("H1");
  await page.locator("#agree").check();
  await page.locator("#begin").click();
  await page.getByRole("button", { name: "Done" }).click();

  const samples = { server: [], person: [], looksOn: [], collected: [] };
  const take = async () => {
    const [own, other] = await Promise.all([person.heap(), looksOn.heap()]);
    samples.server.push([at(), resident(server.pid)]);
    samples.person.push([at(), own]);
    samples.looksOn.push([at(), other]);
  };
  const timer = setInterval(() => void take(), 30_000);
  const facts = [];
  let firstDone = 0;
  do {
    await page.locator("#start:not([disabled])").click({ timeout: 90_000 });
    await page.locator("canvas.task").waitFor();
    if (facts.length === 0) await take();
    await page.evaluate(operator, { injected: false });
    await page.getByRole("heading", { name: /^Score/ }).waitFor({ timeout: 90_000 });
    facts.push(await page.locator("#main").innerText());
    // The tracking window contains the data of the run and of its result.
    await page.locator("#person b").first().waitFor({ timeout: 30_000 });
    await person.inside.send("HeapProfiler.collectGarbage");
    samples.collected.push([at(), await person.heap()]);
    firstDone ||= at();
  } while (at() < minutes);
  clearInterval(timer);
  await take();

  const numbers = facts.map((text) => {
    const found = /Frames of ([\d.]+) ms, the longest ([\d.]+) ms, (\d+) missed; (\d+) events a second/.exec(text);
    assert.ok(found, `no frames are told in ${text}`);
    return found.slice(1).map(Number);
  });
  const sum = (k) => numbers.reduce((all, row) => all + row[k], 0);
  const longest = Math.max(...numbers.map((row) => row[1]));
  const verified = facts.filter((text) => text.includes("This run is verified")).length;
  const others = [...new Set(facts.map((text) => /unverified: ([^\n]*)/.exec(text)?.[1]).filter(Boolean))];

  const near = (all, minute) => all.reduce((best, one) => (Math.abs(one[0] - minute) < Math.abs(best[0] - minute) ? one : best))[1];
  const marks = [0, 10, 30, 60].filter((minute) => minute <= minutes);
  if (marks[marks.length - 1] !== minutes) marks.push(minutes);
  const number = (v) => (Number.isFinite(v) ? v.toFixed(1) : "–");
  console.log(`\n${facts.length} runs in ${at().toFixed(1)} min on ${cpus().length} processors, ${browser.version()}\n`);
  console.log(`| MB | begin | ${marks.slice(1).map((minute) => `${minute} min`).join(" | ")} | slope an hour, ± standard error |`);
  console.log(`|---|${marks.map(() => "---").join("|")}|---|`);
  for (const [name, all] of [
    ["server, resident", samples.server],
    ["window that tracks, heap as it stands", samples.person],
    ["the same behind a run, garbage collected", samples.collected],
    ["window that looks on, heap as it stands", samples.looksOn],
  ]) {
    const [b, error] = slope(all.filter(([t]) => t >= firstDone));
    console.log(`| ${name} | ${marks.map((minute) => number(near(all, minute))).join(" | ")} | ${number(b)} ± ${number(error)} |`);
  }
  console.log(`\n${verified} of ${facts.length} runs verified${others.length > 0 ? ` (${others.join("; ")})` : ""}.`);
  const frames = Math.round((facts.length * 1000 * (measurement + runIn)) / (sum(0) / numbers.length));
  console.log(`Frames of ${(sum(0) / numbers.length).toFixed(1)} ms, ${sum(2)} missed of about ${frames}, the longest ${longest.toFixed(0)} ms; ${Math.round(sum(3) / numbers.length)} input events a second.`);
} finally {
  await browser.close();
  await server.end();
  rmSync(folder, { recursive: true, force: true });
}
