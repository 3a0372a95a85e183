// Test in real time whether simulated operators are identified, with the measured latency in their delay.
// Usage: node real.mjs PROGRAM [ROUNDS]; PROGRAM is hoid with the feature lab. Prints a table in Markdown, and
// fails if a parameter is more than three standard errors from its true value.
//
// A round consists of a calibration (its operator has a gain and a neuromuscular system) and one run of each of
// two other operators. All see e as it is drawn and respond with pointer events every 8 ms; `hoid identify` is
// given the form. The true tau_e is the delay of the operator plus the latency, whose error is the larger of the
// standard error and the scatter of the calibrations.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { cpus, tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { browserOrEnd, lab } from "./lab.mjs";

const [program, asked = "3"] = process.argv.slice(2);
const rounds = Number(asked);
assert.ok(Number.isInteger(rounds) && rounds > 0, `found ${asked} rounds, expected a whole number above zero`);
const path = browserOrEnd();

/** Factor a of the lag: the next x is a x + (1 - a) e, with e held over a tick. */
const decay = Math.exp(-0.001 / 1.0);
const PEOPLE = [
  { name: "gain", form: "gain", plant: { a: [], b: [], c: [], d: 0.6 }, delay: 180, truth: { K: 0.6 } },
  {
    name: "gain and lag",
    form: "lag",
    plant: { a: [decay], b: [1 - decay], c: [0.4], d: 0 },
    delay: 180,
    truth: { K: 0.4, T_I: 1.0 },
  },
];

const folder = mkdtempSync(join(tmpdir(), "hoid-lab-real-"));
const config = join(folder, "lab.toml");
writeFileSync(
  config,
  `name = "Operators in real time"
order = "given"
${PEOPLE.map(
  ({ name }) => `[[condition]]
name = "${name.replaceAll(" ", "")}"
break_s = 0
runs = ${rounds}
target = { rms = 1.5 }
`,
).join("")}`,
);

// The operator of the page itself, without its exports.
const engine = readFileSync(new URL("../dist/engine.mjs", import.meta.url), "utf8").replace(/export \{[^}]*\};?/, "");

/** In the page: an operator with a first-order remnant, a tenth of u, until the end of the run. */
function tracks({ own, seed }) {
  const { run, map } = window.hoidLab;
  const canvas = document.querySelector("canvas.task");
  const kind = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";
  let [state, n] = [seed >>> 0, 0];
  const uniform = () => (state = (Math.imul(state, 1664525) + 1013904223) >>> 0) / 4294967296 - 0.5;
  const a = Math.exp(-0.001 / 0.1);
  // The variance of a uniform number is 1/12.
  const drive = 0.06 * Math.sqrt(12 * (1 - a * a));
  const noise = Float64Array.from({ length: run.task.ticks }, () => (n = a * n + drive * uniform()));
  const person = new window.hoidOperator(own, noise, map);
  let zero = NaN;
  const frame = run.frame.bind(run);
  run.frame = (stamp, now) => {
    zero = performance.now() - now;
    frame(stamp, now);
    person.sees(run.e, now);
  };
  return new Promise((resolve) => {
    const timer = setInterval(() => {
      if (!canvas.isConnected) {
        clearInterval(timer);
        return resolve();
      }
      if (Number.isNaN(zero)) return;
      const clientX = person.raw(performance.now() - zero);
      canvas.dispatchEvent(new PointerEvent(kind, { pointerType: "mouse", clientX }));
    }, 8);
  });
}

const browser = await chromium.launch({ executablePath: path, args: ["--no-sandbox"] });
const open = async (address) => {
  const page = await (await browser.newContext({ viewport: { width: 1200, height: 800 } })).newPage();
  page.on("pageerror", (error) => assert.fail(`the page: ${error}`));
  await page.goto(address);
  return page;
};

async function calibrated() {
  const server = await lab(program, "--out", folder, "--calibrate");
  const page = await open(server.address);
  await page.locator("#agree").check();
  await page.locator("#begin").click();
  await page.locator("#start").click();
  await page.getByRole("heading", { name: "Calibrated" }).waitFor({ timeout: 120_000 });
  await page.close();
  await server.end();
}

/** Performs a run of the next condition and identifies it. */
async function found(page, session, person, number) {
  await page.locator("#start:not([disabled])").click({ timeout: 90_000 });
  await page.locator("canvas.task").waitFor();
  await page.evaluate(`window.hoidOperator ??= (() => { ${engine}; return Operator; })()`);
  await page.evaluate(tracks, { own: { plant: person.plant, delay: person.delay }, seed: 7919 * number });
  await page.getByText(/This run is (verified|unverified)|Done. Thank you./).first().waitFor({ timeout: 90_000 });
  const run = `run-${String(number).padStart(2, "0")}`;
  const file = readdirSync(session).find((name) => name.includes(run) && name.endsWith("_beh.parquet"));
  const options = ["--from", "0", "--form", person.form, "--neuromuscular", "no", "--prior", "none", "--run-to-run", "0", "--json"];
  const told = JSON.parse(execFileSync(program, ["identify", join(session, file), ...options], { encoding: "utf8", maxBuffer: 1 << 26 }));
  const verdict = await page.evaluate(async (n) => (await (await fetch(`data/${n}.json`)).json()).verdict, number);
  return { told, verdict };
}

try {
  const results = [];
  const server = await lab(program, "--out", join(folder, "out"), "--config", config);
  const page = await open(server.address);
  await page.locator("#subject").fill("R1");
  await page.locator("#agree").check();
  await page.locator("#begin").click();
  await page.getByRole("button", { name: "Done" }).click();
  const session = join(folder, "out", "sub-R1", "ses-01");
  let number = 0;
  for (const person of PEOPLE) {
    for (let round = 0; round < rounds; round++) {
      await page.bringToFront();
      results.push({ person, ...(await found(page, session, person, ++number)) });
      if (results.length % PEOPLE.length === 0) await calibrated();
    }
  }
  await page.close();
  await server.end();

  const kept = readFileSync(join(folder, "calibration", "calibration.toml"), "utf8");
  const all = (key) => [...kept.matchAll(new RegExp(`^${key} = (.*)$`, "gm"))].map((found) => Number(found[1]));
  const [latencies, errors] = [all("latency_s"), all("latency_se_s")];
  const n = latencies.length;
  const latency = latencies.reduce((sum, v) => sum + v, 0) / n;
  const scatter = n > 1 ? Math.sqrt(latencies.reduce((sum, v) => sum + (v - latency) ** 2, 0) / (n - 1) / n) : 0;
  const own = Math.sqrt(errors.reduce((sum, v) => sum + v * v, 0)) / n;
  const error = Math.max(own, scatter);
  console.log(`\nLatency ${(1000 * latency).toFixed(1)} ± ${(1000 * error).toFixed(1)} ms by ${n} calibrations on ${cpus().length} processors, ${browser.version()}\n`);
  console.log("| operator | run | parameter | truth | found | standard errors away |\n|---|---|---|---|---|---|");
  let worst = 0;
  results.forEach(({ person, told, verdict }, k) => {
    for (const [name, truth] of Object.entries({ ...person.truth, tau_e: person.delay / 1000 + latency })) {
      const p = told.parameters.find((one) => one.name === name);
      assert.ok(p?.standard_error, `identify tells no error of ${name}`);
      const se = Math.hypot(p.standard_error, name === "tau_e" ? error : 0);
      const away = (p.value - truth) / se;
      worst = Math.max(worst, Math.abs(away));
      console.log(`| ${person.name} | ${k + 1}, ${verdict} | ${name} | ${truth.toFixed(4)} | ${p.value.toFixed(4)} ± ${p.standard_error.toFixed(4)} | ${away.toFixed(2)} |`);
    }
  });
  assert.ok(worst < 3, `a parameter is ${worst.toFixed(2)} standard errors from its truth, expected less than 3`);
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
