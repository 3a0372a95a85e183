// Builds the page into one file, dist/lab.html, and what of it needs no browser into dist/engine.mjs.
// With the argument --check nothing is written: it fails where the files are not what is built.
import { build } from "esbuild";
import { readFileSync, writeFileSync, mkdirSync, existsSync } from "node:fs";

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

const script = await bundled("main.ts", "iife");
if (script.includes("</script")) throw new Error("the script ends its own element");
const style = readFileSync(`${here}src/style.css`, "utf8");
const page = readFileSync(`${here}src/page.html`, "utf8")
  .replace("/*style*/", () => style)
  .replace("/*script*/", () => script);
const built = { "lab.html": page, "engine.mjs": await bundled("engine.ts", "esm") };

mkdirSync(`${here}dist`, { recursive: true });
for (const [name, text] of Object.entries(built)) {
  const path = `${here}dist/${name}`;
  if (!process.argv.includes("--check")) {
    writeFileSync(path, text);
  } else if (!existsSync(path) || readFileSync(path, "utf8") !== text) {
    console.error(`dist/${name} is not what the sources build: run npm run build in crates/hoid-lab/page`);
    process.exitCode = 1;
  }
}
