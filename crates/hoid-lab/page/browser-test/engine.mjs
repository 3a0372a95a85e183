// The engine of the page without a browser: runs are requested and answered as lines of JSON. The tables come
// from a generator that also exists in Rust (tests/common/page.rs); the times are injected.
import { createHash } from "node:crypto";
import { createInterface } from "node:readline";
import { Operator, Run } from "../dist/engine.mjs";

function generator(seed) {
  let state = seed >>> 0;
  return () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 4294967296 - 0.5;
  };
}

const numbers = (base64) => {
  const bytes = Buffer.from(base64, "base64");
  return new Float64Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
};

/** Random tables, events and frames; the result as a hash. */
function arithmetic({ phases, ticks, map, seed }) {
  const random = generator(seed);
  const table = (size) => Float64Array.from({ length: ticks }, () => size * random());
  const run = new Run({ run_in: 0, ticks, phases, target: table(8), disturbance: table(1) }, map);
  let [now, stamp] = [0, 0];
  const all = { u: [], e: [], events: [] };
  while (!run.done) {
    now += 33 * (random() + 0.5);
    while (stamp < now) {
      run.input(stamp, stamp + 0.5, map.centre + 2.2 * map.span * random());
      stamp += 9 * (random() + 0.5);
    }
    run.advance(now);
    const batch = run.take();
    all.u.push(...batch.u);
    all.e.push(...batch.e);
    all.events.push(...batch.events.map(([tick, , , raw]) => [tick, raw]));
  }
  const hash = createHash("sha256");
  for (const values of [all.u, all.e]) hash.update(Buffer.from(Float64Array.from(values, (v) => v + 0).buffer));
  return { sha256: hash.digest("hex"), events: all.events };
}

/** Signals of a loop with a simulated operator that sees each tick. */
function loop({ phases, ticks, map, target, operator, noise }) {
  const run = new Run({ run_in: 0, ticks, phases, target: numbers(target), disturbance: new Float64Array(ticks) }, map);
  const person = new Operator(operator, numbers(noise), map);
  const [u, e] = [new Float64Array(ticks), new Float64Array(ticks)];
  for (let k = 0; k < ticks; k++) {
    run.advance(k);
    [u[k], e[k]] = [run.u, run.e];
    person.sees(run.e, k);
    run.input(k + 0.5, k + 0.5, person.raw(k + 0.5));
    if (k % 1000 === 0) run.take();
  }
  const text = (values) => Buffer.from(values.buffer).toString("base64");
  return { u: text(u), e: text(e) };
}

for await (const line of createInterface({ input: process.stdin })) {
  const asked = JSON.parse(line);
  const answer = asked.operator ? loop(asked) : arithmetic(asked);
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}
