// The page in a browser: sessions of a simulated person, closed windows, a killed server, and the remaining
// files. Usage: node main.mjs PROGRAM; PROGRAM is hoid with the feature lab.
// With HOID_LAB_PICTURES=DIR every screen is drawn at 1200 and 400 pixels.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";
import { browserOrEnd, endAll, injectTime, lab, operator } from "./lab.mjs";

const program = process.argv[2];
const path = browserOrEnd();

const folder = mkdtempSync(join(tmpdir(), "hoid-lab-"));
const config = join(folder, "lab.toml");
// A test machine may be slow, so delays are not tested here.
writeFileSync(
  config,
  `name = "Test of the page"
order = "given"
[limits]
frame_ms = 5000
input_ms = 5000
${[
  ["long", 80, 10, "compensatory"],
  ["real", 50, 10, "pursuit"],
  ["pad", 4, 1, "preview"],
]
  .map(
    ([name, measurement, runIn, display]) => `[[condition]]
name = "${name}"
measurement_s = ${measurement}
run_in_s = ${runIn}
display = "${display}"
break_s = 0
target = { rms = 1.5 }
`,
  )
  .join("")}`,
);

const browser = await chromium.launch({ executablePath: path, args: ["--no-sandbox"] });
const pictures = process.env.HOID_LAB_PICTURES;
let faults = 0;

async function open(address, { time = "browser", scheme = "light", width = 1200 } = {}) {
  const context = await browser.newContext({ viewport: { width, height: 800 }, colorScheme: scheme });
  const page = await context.newPage();
  page.on("pageerror", (error) => {
    faults++;
    console.error(`the page: ${error}`);
  });
  page.on("console", (message) => {
    if (message.type() === "error") {
      faults++;
      console.error(`the page: ${message.text()}`);
    }
  });
  if (time === "injected") await page.addInitScript(injectTime);
  await page.goto(address);
  return page;
}

async function picture(page, name) {
  if (!pictures) return;
  for (const width of [1200, 400]) {
    await page.setViewportSize({ width, height: 800 });
    await page.waitForTimeout(150);
    await page.screenshot({ path: join(pictures, `${name}-${width}.png`), fullPage: true });
  }
  await page.setViewportSize({ width: 1200, height: 800 });
}

const heading = (page, text) => page.getByRole("heading", { name: text }).waitFor({ timeout: 90_000 });

async function consent(page, name) {
  await page.locator("#subject").fill(name);
  assert.equal(await page.locator("#begin").isDisabled(), true);
  await page.locator("#agree").check();
  await picture(page, "consent");
  await page.locator("#begin").click();
  await heading(page, "How you steer");
  await picture(page, "settings");
  await page.getByRole("button", { name: "Done" }).click();
  await heading(page, /^Run 1 of/);
}

/** Starts the next run with the keyboard, and waits for its canvas. */
async function startRun(page) {
  await page.locator("#start").waitFor();
  await page.evaluate(() => document.activeElement?.blur());
  await page.keyboard.press("Space");
  await page.locator("canvas.task").waitFor();
}

async function runOf(page, address, number) {
  return page.evaluate(async (n) => (await fetch(`data/${n}.json`)).json(), number);
}

/** Reports the lag of the live estimate and its rate. */
async function behind(page, experimenter) {
  await page.waitForFunction(() => window.hoidLab?.run.next > 20_000, undefined, { timeout: 90_000 });
  const began = await page.evaluate(() => window.hoidLab.began());
  const seen = await experimenter.evaluate(async () => {
    const seen = [];
    const end = performance.now() + 5000;
    while (performance.now() < end) {
      if (window.hoidLive && window.hoidLive.at !== seen.at(-1)?.at) seen.push(window.hoidLive);
      await new Promise((resolve) => setTimeout(resolve, 2));
    }
    return seen;
  });
  // t is zero at the start of the measurement, 10 s after tick 0.
  const late = seen.map(({ t, at }) => at - began - 1000 * (t + 10)).sort((a, b) => a - b);
  const at = (part) => late[Math.floor(part * (late.length - 1))].toFixed(0);
  console.log(`  live: ${seen.length / 5} a second; behind by ${at(0.5)} ms in the median, ${at(0.95)} ms in 95 of 100`);
  assert.ok(seen.length > 0, "nothing is told live");
}

function near(found, expected, tolerance, what) {
  assert.ok(Math.abs(found - expected) < tolerance, `${what}: ${found}, expected ${expected} within ${tolerance}`);
}

const steps = {
  async "a run of 90 s in injected time"() {
    const server = await lab(program, "--out", join(folder, "a"), "--config", config);
    const page = await open(server.address, { time: "injected" });
    const experimenter = await open(`${server.address}experimenter`);
    await consent(page, "A1");
    assert.equal(await page.evaluate(() => crossOriginIsolated), true);
    await picture(page, "ready");
    await startRun(page);
    await page.evaluate(operator, { injected: true, until: 45_000 });
    await picture(page, "run");
    await experimenter.getByText(/Run 1 is in progress/).waitFor();
    await picture(experimenter, "experimenter");
    await page.evaluate(operator, { injected: true });
    await heading(page, /^Score/);
    await page.getByText("verified", { exact: true }).waitFor();
    await page.getByText("The estimate of your behaviour").waitFor();
    await picture(page, "result");
    const run = await runOf(page, server.address, 1);
    assert.equal(run.verdict, "verified", run.reasons);
    const last = run.live[run.live.length - 1];
    near(last[1], 0.7, 0.2, "gain");
    // The simulated person has no neuromuscular system, and that of the estimate contains a part of the delay: the
    // remaining phase of an integrator at crossover is the sum of both.
    near(((90 - last[11]) * Math.PI) / 180 / last[9], 0.2, 0.03, "delay at crossover");
    assert.ok(Math.abs(last[7] - 0.2) < 3 * last[8], "the delay is within its error");
    console.log(`  found: gain ${last[1].toFixed(3)} ± ${last[2].toFixed(3)}, delay ${last[7].toFixed(3)} ± ${last[8].toFixed(3)}`);

    // The page is reloaded in the middle of a run, which is then repeated.
    await startRun(page);
    await page.evaluate(operator, { injected: true, until: 8000 });
    await page.reload();
    await page.getByText("The last run was interrupted").waitFor();
    await picture(page, "broken-off");
    // A second window takes over between two runs; the first window becomes view-only.
    const second = await open(server.address);
    await heading(page, "This window is view-only");
    await picture(page, "looks-on");
    await second.close();
    await server.end("SIGKILL");
    await heading(experimenter, "The program has ended");
    await picture(experimenter, "ended");
  },

  async "a run of 60 s in real time, after kill -9"() {
    let server = await lab(program, "--out", join(folder, "a"), "--config", config);
    let page = await open(server.address);
    await picture(page, "go-on");
    await page.getByRole("button", { name: /Continue sub-A1/ }).click();
    await startRun(page);
    await page.evaluate(operator, { injected: false, until: 4000 });
    await server.end("SIGKILL");
    await heading(page, "The program has ended");
    const session = join(folder, "a", "sub-A1", "ses-01");
    const begun = readdirSync(session).filter((name) => name.endsWith("_ticks.csv")).sort();
    const lines = readFileSync(join(session, begun[begun.length - 1]), "utf8").split("\n").length;
    assert.ok(lines > 3000, `the log has ${lines} ticks of the 4000 that were made`);

    server = await lab(program, "--out", join(folder, "a"), "--config", config);
    page = await open(server.address);
    await page.getByRole("button", { name: /Continue sub-A1/ }).click();
    await page.getByText("The last run was interrupted").waitFor();
    const experimenter = await open(`${server.address}experimenter`);
    await startRun(page);
    const tracked = page.evaluate(operator, { injected: false });
    await behind(page, experimenter);
    await tracked;
    await heading(page, /^Score/);
    await page.getByText("verified", { exact: true }).waitFor();

    // A simulated gamepad, whose stick moves from side to side.
    await page.evaluate(() => {
      let phase = 0;
      navigator.getGamepads = () => [{ axes: [Math.sin((phase += 0.05))], timestamp: performance.now() }];
      localStorage.setItem("hoid-lab-settings", JSON.stringify({ device: "gamepad", dead: 0.1 }));
    });
    await page.getByRole("button", { name: "How I steer" }).click();
    await page.locator("#device").selectOption("gamepad");
    await page.getByRole("button", { name: "Done" }).click();
    await startRun(page);
    await heading(page, "Done. Thank you.");
    const numbers = readdirSync(session).filter((name) => name.endsWith("_end.json"));
    const pad = await runOf(page, server.address, numbers.length);
    assert.equal(pad.verdict, "verified", pad.reasons);
    assert.ok(Math.max(...pad.u) > 1, "the stick moved nothing");

    await page.getByRole("link", { name: /: identify/ }).first().waitFor({ timeout: 240_000 });
    await page.getByText("Reports are being written").waitFor({ state: "detached", timeout: 400_000 });
    const links = await page.locator("li a").evaluateAll((all) => all.map((a) => a.href));
    for (const name of ["identify", "track", "describe"]) {
      const href = links.find((href) => href.includes(`/${name}/`));
      assert.ok(href, `there is no page of ${name}`);
      const answer = await page.evaluate(async (href) => (await fetch(href)).status, href);
      assert.equal(answer, 200);
    }
    await picture(page, "finished");
    const head = await page.evaluate(async () => {
      const bytes = new Uint8Array(await (await fetch("export.zip")).arrayBuffer());
      return [bytes.length, bytes[0], bytes[1]];
    });
    assert.deepEqual(head.slice(1), [0x50, 0x4b]);
    // No server would answer the remaining requests of the page.
    await page.close();
    await experimenter.close();
    await server.end();
  },

  async "a session shown again, its runs corrupted"() {
    const session = join(folder, "a", "sub-A1", "ses-01");
    const ticks = readdirSync(session).find((name) => name.endsWith("run-01_ticks.csv"));
    const text = readFileSync(join(session, ticks), "utf8");
    const show = async (pattern, name) => {
      const server = await lab(program, "--replay", session);
      const page = await open(server.address, { scheme: "dark" });
      await page.getByText("Recomputed now:").waitFor();
      await page.locator("#replay").getByText(pattern).waitFor();
      await page.waitForTimeout(1500);
      await picture(page, name);
      await page.close();
      await server.end();
    };
    await show(/^verified$/, "replay");
    const lines = text.split("\n");
    const cells = lines[5000].split(",");
    lines[5000] = [cells[0], cells[1], String(Number(cells[2]) + 1e-9)].join(",");
    writeFileSync(join(session, ticks), lines.join("\n"));
    await show(/e does not match the controlled element at 1 of \d+ ticks, first at tick 4999/, "replay-corrupted");
    writeFileSync(join(session, ticks), text);
  },

  async "an experiment that was designed, done and compared"() {
    const hoid = (...args) => {
      const done = spawnSync(program, args, { cwd: folder, encoding: "utf8" });
      assert.equal(done.status, 0, `hoid ${args.join(" ")}: ${done.stderr}`);
      return done.stdout;
    };
    // The operator does not adapt: half the gain of the element is half the crossover.
    const conditions = Object.entries({ fast: "4/s", slow: "2/s" }).map(([name, element]) => {
      hoid("design", "--controlled-element", element, "--length", "40.96", "--max-rms-e", "1", "--out", `design-${name}`);
      const text = readFileSync(join(folder, `design-${name}`, "lab.toml"), "utf8");
      const own = text
        .slice(text.indexOf("[[condition]]"))
        .replace('name = "design"', `name = "${name}"\nbreak_s = 0`)
        .replace('"scenario.toml"', `"design-${name}/scenario.toml"`);
      assert.match(own, /training = 1/);
      return own.replace("training = 1", "training = 0");
    });
    const designed = join(folder, "designed.toml");
    writeFileSync(designed, `name = "designed"\n[limits]\nframe_ms = 5000\ninput_ms = 5000\n${conditions.join("\n")}`);
    const out = join(folder, "designed");
    for (const name of ["P1", "P2", "P3"]) {
      const server = await lab(program, "--out", out, "--config", designed);
      const page = await open(server.address, { time: "injected" });
      await consent(page, name);
      for (const end of [/^Score/, "Done. Thank you."]) {
        await startRun(page);
        await page.evaluate(operator, { injected: true });
        await heading(page, end);
      }
      await page.close();
      await server.end();
    }
    hoid("group", join(out, "group.toml"), "--out", "results");
    const { differences } = JSON.parse(hoid("compare", "results", "--of", "crossover", "--json"));
    const { value, interval, people } = differences[0];
    console.log(`  crossover: ${value.toFixed(2)} rad/s (${interval.map((v) => v.toFixed(2)).join(" to ")}), ${people.length} people`);
    assert.equal(people.length, 3);
    // .7 e through 4/s and 2/s cross at 2.8 and 1.4 rad/s.
    near(Math.abs(value), 1.4, 0.25, "difference of the crossover");
  },

  async "displays that show the target"() {
    const hoid = (...args) => {
      const done = spawnSync(program, args, { cwd: folder, encoding: "utf8" });
      assert.equal(done.status, 0, `hoid ${args.join(" ")}: ${done.stderr}`);
      return JSON.parse(done.stdout);
    };
    const displays = join(folder, "displays.toml");
    const conditions = ["pursuit", "preview"].map(
      (display) => `[[condition]]
name = "${display}"
display = "${display}"
measurement_s = 80
break_s = 0
target = { rms = 1.5, interleaved = "even" }
disturbance = { rms = 0.5, interleaved = "odd" }
`,
    );
    writeFileSync(displays, `name = "displays"\norder = "given"\n[limits]\nframe_ms = 5000\ninput_ms = 5000\n${conditions.join("")}`);
    const out = join(folder, "displays");
    const server = await lab(program, "--out", out, "--config", displays);
    const page = await open(server.address, { time: "injected" });
    await consent(page, "S1");
    for (const end of [/^Score/, "Done. Thank you."]) {
      await startRun(page);
      await page.evaluate(operator, { injected: true, K_d: 0.15 });
      await heading(page, end);
      if (end !== "Done. Thank you.") await page.getByText("The display shows the target").waitFor();
    }
    // Its page shows both inputs.
    await page.getByRole("link", { name: /: identify/ }).first().waitFor({ timeout: 240_000 });
    const href = await page.getByRole("link", { name: /: identify/ }).first().getAttribute("href");
    const html = await page.evaluate(async (href) => (await fetch(href)).text(), href);
    assert.match(html, /f_t=feedforward/);
    await page.close();
    await server.end();
    const { people } = hoid("group", join(out, "group.toml"), "--out", "seen", "--json");
    for (const { condition, open_loop, channels } of people) {
      const [{ input, form, parameters }] = channels;
      assert.deepEqual([input, form], ["f_t", "derivative"], condition);
      const { K_d, tau_f } = parameters;
      console.log(`  ${condition}: K_d ${K_d.value.toFixed(3)} ± ${K_d.standard_error.toFixed(3)} s, tau_f ${tau_f.value.toFixed(3)} s`);
      near(K_d.value, 0.15, 0.03, `K_d, ${condition}`);
      near(open_loop.crossover_rad_s.value, 2.8, 0.5, `crossover, ${condition}`);
    }
    // With the error as the only input the result is doubtful, and the message contains the remedy.
    const run = join(out, "sub-S1", "ses-01");
    for (const name of readdirSync(run).filter((name) => name.endsWith("_beh.parquet"))) {
      const { verdict } = hoid("identify", join(run, name), "--from", "0", "--json");
      assert.equal(verdict.level, "doubtful", name);
      assert.match(verdict.reasons.map((reason) => reason.message).join(" "), /the display showed f_t .*--role f_t=feedforward/, name);
    }
  },

  async "a disk that is full in the middle of a run"() {
    const disk = join(folder, "disk");
    mkdirSync(disk);
    // The next run needs 7 MB or more, depending on the number of frames.
    if (spawnSync("mount", ["-t", "tmpfs", "-o", "size=32m", "tmpfs", disk]).status !== 0) {
      console.log("  skipped: no disk of its own can be mounted here");
      return;
    }
    try {
      const server = await lab(program, "--out", disk, "--config", config);
      const page = await open(server.address, { time: "injected" });
      await consent(page, "D1");
      await startRun(page);
      await page.evaluate(operator, { injected: true, until: 5000 });
      const ballast = join(disk, "ballast");
      spawnSync("dd", ["if=/dev/zero", `of=${ballast}`, "bs=64k"]);
      await page.evaluate(operator, { injected: true });
      await heading(page, "The run was ended early");
      assert.ok((await page.evaluate(() => window.hoidLab.run.next)) < 60_000, "the run went on to its end");
      await page.getByText(/No space left on device.*free space on the disk/).waitFor();
      await picture(page, "full-disk");
      rmSync(ballast);
      await startRun(page);
      await page.evaluate(operator, { injected: true });
      await page.getByText("verified", { exact: true }).waitFor({ timeout: 90_000 });
      await page.close();
      await server.end();
    } finally {
      // Retries, because the server still has its files open after a failure.
      spawnSync("umount", ["--lazy", disk]);
    }
  },

  async "a calibration"() {
    const server = await lab(program, "--out", join(folder, "b"), "--calibrate");
    const page = await open(server.address);
    await page.locator("#agree").check();
    await picture(page, "calibrate");
    await page.locator("#begin").click();
    await startRun(page);
    await heading(page, "Calibrated");
    await picture(page, "calibrated");
    const told = await page.getByRole("row", { name: /Latency/ }).innerText();
    console.log(`  ${told.replace(/\s+/g, " ")}`);
    assert.match(told, /-?\d+\.\d ± \d+\.\d ms/);
    await page.close();
    await server.end();
  },
};

try {
  for (const [name, step] of Object.entries(steps)) {
    console.log(name);
    await step();
  }
  assert.equal(faults, 0, "the page said something to its console");
  console.log("all passed");
} catch (error) {
  // Printed before the clean-up, which may fail for the same reason.
  console.error(error);
  process.exitCode = 1;
} finally {
  await browser.close();
  endAll();
  rmSync(folder, { recursive: true, force: true, maxRetries: 10 });
}
