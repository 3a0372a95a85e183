// Screenshots of a built book, and the elements that are cut off (usage: screens.sh).
import { existsSync, readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const [book, out, ...wanted] = process.argv.slice(2);
const path = [process.env.HOID_CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(
  (each) => each && existsSync(each),
);
if (!path) {
  console.log("skipped: no browser is here (apt-get install chromium, or HOID_CHROMIUM=PATH)");
  process.exit(0);
}
// The first chapter occurs twice (index.html); print.html contains all chapters.
const left = /^(404|index|print|toc)\.html$/;
const pages = readdirSync(book, { recursive: true })
  .filter((page) => page.endsWith(".html") && !left.test(page))
  .filter((page) => !wanted.length || wanted.some((part) => page.includes(part)))
  .sort();

/** Returns the problems of a page on the screen. */
function faults(wide) {
  const found = [];
  const screen = document.documentElement.clientWidth;
  if (document.documentElement.scrollWidth > screen) found.push(`the page is ${document.documentElement.scrollWidth} wide`);
  for (const image of document.querySelectorAll("main img")) {
    if (!image.naturalWidth) found.push(`no picture ${image.getAttribute("src")}`);
  }
  if (wide) {
    for (const box of document.querySelectorAll("main pre code, main .table-wrapper")) {
      const more = box.scrollWidth - box.clientWidth;
      if (more > 1) found.push(`${box.tagName.toLowerCase()} cut by ${more}: ${box.textContent.trim().slice(0, 60).replace(/\s+/g, " ")}`);
    }
  }
  return found;
}

/** Returns the links of a page to missing headings. */
function dead(page) {
  const html = readFileSync(join(book, page), "utf8").replace(/[^]*<main>/, "").replace(/<\/main>[^]*/, "");
  return [...html.matchAll(/href="([^"]*)"/g)].flatMap(([, link]) => {
    if (/^[a-z]+:/.test(link)) return [];
    const [file, heading] = link.split("#");
    const target = file ? join(book, page, "..", file) : join(book, page);
    if (!existsSync(target)) return [`no page ${link}`];
    return heading && !readFileSync(target, "utf8").includes(`id="${heading}"`) ? [`no heading ${link}`] : [];
  });
}

const browser = await chromium.launch({ executablePath: path, args: ["--no-sandbox"] });
let count = 0;
for (const [name, width, theme] of [
  ["1200", 1200, "light"],
  ["400", 400, "light"],
  ["dark", 1200, "coal"],
]) {
  const context = await browser.newContext({ viewport: { width, height: 900 } });
  await context.addInitScript((chosen) => localStorage.setItem("mdbook-theme", chosen), theme);
  for (const page of pages) {
    const tab = await context.newPage();
    await tab.goto(pathToFileURL(join(book, page)).href);
    await tab.waitForLoadState("load");
    // Problems that do not depend on the colours are reported once.
    const found = theme === "light" ? [...(await tab.evaluate(faults, width > 400)), ...(name === "400" ? dead(page) : [])] : [];
    for (const fault of found) console.log(`${page} (${name}): ${fault}`);
    count += found.length;
    await tab.screenshot({ path: join(out, `${page.replace(/\.html$/, "").replaceAll("/", "-")}-${name}.png`), fullPage: true });
    await tab.close();
  }
  await context.close();
}
await browser.close();
console.log(`${pages.length} pages, ${count} faults`);
process.exit(count > 0 ? 1 : 0);
