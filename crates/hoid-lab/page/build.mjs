// Builds the page into one file, dist/lab.html, and the part that needs no browser into dist/engine.mjs.
// With the argument --check nothing is written; the command fails if the files differ from the build.
//
// With --alone KERNEL EXPERIMENT OUT it builds the page that runs without the program: it contains the C ABI of
// hoid in WebAssembly and the tables of an experiment.
import { build } from "esbuild";
import { createHash } from "node:crypto";
import { readFileSync, writeFileSync, mkdirSync, existsSync } from "node:fs";
import { resolve } from "node:path";
import { gzipSync } from "node:zlib";

const here = new URL(".", import.meta.url).pathname;
const bundled = async (entry, format) => {
  const result = await build({
    entryPoints: [`${here}src/${entry}`],
    absWorkingDir: here,
    bundle: true,
    minify: false,
    format,
    target: "es2022",
    charset: "utf8",
    legalComments: "none",
    write: false,
  });
  return result.outputFiles[0].text;
};

/** Returns the page of a script; `head` and `data` precede style and script. */
async function page(entry, head = () => "", data = "") {
  const script = await bundled(entry, "iife");
  if (script.includes("</script")) throw new Error("the script ends its own element");
  const style = readFileSync(`${here}src/style.css`, "utf8");
  return readFileSync(`${here}src/page.html`, "utf8")
    .replace("<!--head-->\n", () => head(script, style))
    .replace("<!--data-->\n", () => data)
    .replace("/*style*/", () => style)
    .replace("/*script*/", () => script);
}

/** Policy of the page without the program: its own script and style by their hashes, and WebAssembly. */
async function alone(kernel, experiment) {
  const hash = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;
  const policy = (script, style) =>
    `<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src ${hash(script)} 'wasm-unsafe-eval'; ` +
    `style-src ${hash(style)}; img-src data:; base-uri 'none'; form-action 'none'">\n`;
  const packed = (name, path) =>
    `<script type="application/gzip" id="${name}">${gzipSync(readFileSync(path), { level: 9 }).toString("base64")}</script>\n`;
  return page("alone.ts", policy, packed("kernel", kernel) + packed("experiment", experiment));
}

const [mode, ...paths] = process.argv.slice(2);
if (mode === "--alone") {
  const [kernel, experiment, out] = paths.map((path) => resolve(path));
  writeFileSync(out, await alone(kernel, experiment));
} else {
  mkdirSync(`${here}dist`, { recursive: true });
  for (const [name, text] of [
    ["lab.html", await page("lab.ts")],
    ["engine.mjs", await bundled("engine.ts", "esm")],
  ]) {
    const path = `${here}dist/${name}`;
    if (mode !== "--check") {
      writeFileSync(path, text);
    } else if (!existsSync(path) || readFileSync(path, "utf8") !== text) {
      console.error(`dist/${name} is not what the sources build: run npm run build in crates/hoid-lab/page`);
      process.exitCode = 1;
    }
  }
}
