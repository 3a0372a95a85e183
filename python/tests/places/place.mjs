// The C ABI in WebAssembly, with the calls of place.c. `node place.mjs hoid_ffi.wasm < samples`.
import { readFileSync } from "node:fs";

const module = await WebAssembly.compile(readFileSync(process.argv[2]));
// A library for random numbers imports functions that are never called.
const imports = {};
for (const { module: of, name } of WebAssembly.Module.imports(module)) {
  (imports[of] ??= {})[name] = () => {
    throw new Error(`${of}.${name} was called`);
  };
}
const hoid = (await WebAssembly.instantiate(module, imports)).exports;
// Memory for the arguments: a separate page that the library does not use.
const room = hoid.memory.grow(1) * 65536;
const [place, count, options, list] = [room, room + 8, room + 16, room + 128];
// Layout of hoid_estimate: two pointers, then value and standard error.
const [size, value, error] = [32, 8, 16];

const text = new TextEncoder().encode('{"controlled_element": "90/(s(s+6))"}\0');
new Uint8Array(hoid.memory.buffer).set(text, options);
if (hoid.hoid_tracker_new(0, 0.01, options, place) !== 0) throw new Error("no tracker");
const tracker = new DataView(hoid.memory.buffer).getUint32(place, true);
const lines = [];
for (const line of readFileSync(0, "utf8").trim().split("\n")) {
  const [e, u] = line.split(",").map(Number);
  const begin = process.hrtime.bigint();
  if (hoid.hoid_tracker_step(tracker, e, u, 0) !== 0) throw new Error("no step");
  const known = [
    hoid.hoid_tracker_operator(tracker, list, 6, count),
    hoid.hoid_tracker_open_loop(tracker, list + 6 * size, 2, count),
  ];
  const memory = new DataView(hoid.memory.buffer);
  const cells = [];
  for (let i = 0; i < 8; i++) {
    for (const part of [value, error]) {
      cells.push(known[i < 6 ? 0 : 1] === 0 ? memory.getFloat64(list + size * i + part, true) : NaN);
    }
  }
  cells.push(process.hrtime.bigint() - begin);
  lines.push(cells.join(","));
}
console.log(lines.join("\n"));
