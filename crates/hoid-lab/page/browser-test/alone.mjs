// The page without the program hoid: it is opened as a file, a simulated person tracks, and hoid reads the saved
// run. Usage: node alone.mjs PROGRAM PAGE. With HOID_LAB_PICTURES=DIR its screens are drawn.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";
import { browserOrEnd, injectTime, operator } from "./lab.mjs";

const [program, file] = process.argv.slice(2);
const browser = await chromium.launch({ executablePath: browserOrEnd(), args: ["--no-sandbox"] });
const folder = mkdtempSync(join(tmpdir(), "hoid-alone-"));
const pictures = process.env.HOID_LAB_PICTURES;

try {
  console.log("the page without a program behind it");
  const page = await browser.newPage({ viewport: { width: 1200, height: 800 } });
  const faults = [];
  const asked = [];
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  page.on("request", (request) => asked.push(request.url().slice(0, 80)));
  const picture = async (name) => {
    if (!pictures) return;
    for (const width of [1200, 400]) {
      await page.setViewportSize({ width, height: 800 });
      await page.waitForTimeout(150);
      await page.screenshot({ path: join(pictures, `alone-${name}-${width}.png`), fullPage: true });
    }
    await page.setViewportSize({ width: 1200, height: 800 });
  };
  const heading = (text) => page.getByRole("heading", { name: text }).waitFor({ timeout: 90_000 });
  await page.addInitScript(injectTime);
  const address = pathToFileURL(resolve(file)).href;
  await page.goto(address);
  await page.getByText("Nothing is sent, and nothing is stored").waitFor();
  await page.locator("#agree").check();
  await picture("consent");
  await page.locator("#begin").click();
  await heading("How you steer");
  await page.getByRole("button", { name: "Done" }).click();
  await heading(/^Run 1 of 1/);

  // A run that ended early is repeated.
  await page.locator("#start").click();
  await page.locator("canvas.task").waitFor();
  await page.evaluate(operator, { injected: true, until: 5000 });
  await page.keyboard.press("Escape");
  await heading("The run was ended early");
  await page.getByRole("button", { name: "Start again" }).click();
  await page.locator("canvas.task").waitFor();
  await page.evaluate(operator, { injected: true });
  await heading("Done. Thank you.");
  await page.getByText("this page cannot recompute the run").first().waitFor();
  await page.getByText("The estimate of your behaviour").waitFor();
  await page.waitForTimeout(500);
  await picture("done");

  const told = async (name) => {
    const cell = page.locator("#person .numbers > div").filter({ hasText: name });
    const [, value, error] = (await cell.innerText()).match(/\n(-?[\d.]+).*\n± ([\d.]+)/s) ?? [];
    return [Number(value), Number(error)];
  };
  const shown = { K_e: await told("Gain"), tau_e: await told("Delay"), crossover: await told("Crossover"), margin: await told("Phase margin") };
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("button", { name: "Save run 2" }).click()]);
  const saved = join(folder, download.suggestedFilename());
  await download.saveAs(saved);
  assert.deepEqual(faults, [], "the page said something to its console");
  assert.deepEqual(asked.filter((url) => !url.startsWith("file:") && !url.startsWith("blob:")), [], "the page asked somebody");

  // For the saved run hoid reports the values that the page has shown.
  const out = join(folder, "trace.csv");
  execFileSync(program, ["track", saved, "--controlled-element", "4/s", "--out", out], { stdio: ["ignore", "ignore", "inherit"] });
  const rows = readFileSync(out, "utf8").trim().split("\n").filter((line) => !line.startsWith("#")).map((line) => line.split(","));
  const last = (name) => Number(rows[rows.length - 1][rows[0].indexOf(name)]);
  for (const [name, column] of [["K_e", "K_e"], ["tau_e", "tau_e"], ["crossover", "crossover_rad_s"], ["margin", "phase_margin_deg"]]) {
    const digits = (v) => v.toFixed(Math.abs(v) < 1 ? 3 : Math.abs(v) < 10 ? 2 : 0);
    assert.equal(shown[name][0], Number(digits(last(column))), name);
  }
  console.log(`  found: gain ${shown.K_e.join(" ± ")}, delay ${shown.tau_e.join(" ± ")}; as hoid track of the saved run`);
} finally {
  await browser.close();
  rmSync(folder, { recursive: true, force: true });
}
