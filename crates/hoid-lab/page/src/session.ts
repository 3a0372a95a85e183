// One run on the screen, from the countdown to its last tick.

import { h, show } from "./dom";
import { Surface } from "./display";
import { Operator, Run } from "./engine";
import { listen, mapOf, type Settings } from "./input";
import { time } from "./time";
import type { RunMessage, Wire } from "./wire";

const COUNTDOWN_MS = 3000;
const BATCH_MS = 45;

export interface Given {
  message: RunMessage;
  tables: Float64Array;
}

/** Performs a run; `ended` receives whether the run is complete. The returned function ends the run if the server has ended it. */
export function start(wire: Wire, given: Given, own: Settings, ended: (finished: boolean, words: string) => void): (words: string) => void {
  const { message } = given;
  const canvas = h("canvas", { class: "task running", role: "img", "aria-label": "The task" });
  const count = h("p", { class: "count", "aria-live": "polite" }, "");
  const over = h("div", { class: "over" }, h("p", {}, message.condition.text), count, h("p", { class: "soft" }, "Esc ends the run"));
  show("full", canvas, over);
  const surface = new Surface(canvas);
  const map = mapOf(own, canvas.getBoundingClientRect(), message.condition.full_deflection);
  const [ahead, disturbed, noise] = message.tables;
  const target = given.tables.subarray(0, ahead);
  const task = { ...message, target, disturbance: given.tables.subarray(ahead, ahead + disturbed) };
  const run = new Run(task, map);
  const operator = message.operator
    ? new Operator(message.operator, given.tables.subarray(ahead + disturbed, ahead + disturbed + noise), map)
    : null;
  // For simulated operators, and for the lag of the live estimate.
  (globalThis as { hoidLab?: unknown }).hoidLab = { run, map, began: () => performance.timeOrigin + zero };

  let zero = NaN;
  let asked = false;
  let over_ = false;
  let sent = 0;
  let synthetic = 0;
  let left = NaN;
  const times: number[] = [];
  const origin = time.now();

  const stopListening = listen(canvas, own.device, (event) => {
    if (event.synthetic) synthetic++;
    // The last position of the hand before the start is that of tick 0.
    if (Number.isNaN(zero)) left = event.raw;
    else run.input(event.stamp - zero, time.now() - zero, event.raw);
  });
  const keys = (event: KeyboardEvent) => {
    if (event.key === "Escape") end(false, "You ended the run.");
  };
  const hidden = () => {
    if (document.hidden) end(false, "The window was hidden, so nothing could be measured.");
  };
  const sized = () => surface.fit();
  addEventListener("keydown", keys);
  document.addEventListener("visibilitychange", hidden);
  addEventListener("resize", sized);

  function end(finished: boolean, words: string, told = asked): void {
    if (over_) return;
    over_ = true;
    stopListening();
    removeEventListener("keydown", keys);
    document.removeEventListener("visibilitychange", hidden);
    removeEventListener("resize", sized);
    if (told) {
      wire.say({ type: "batch", number: message.number, batch: run.take() });
      const memory = (performance as { memory?: { usedJSHeapSize: number } }).memory?.usedJSHeapSize ?? 0;
      const counted = { synthetic_events: synthetic, memory_mb: Math.round(memory / 1e5) / 10 };
      if (finished) wire.say({ type: "finish", number: message.number, counted });
      else wire.say({ type: "abort", number: message.number });
    }
    ended(finished, words);
  }

  const draw = () => {
    const now = Math.max(0, run.next - 1);
    surface.task(message.condition, { e: run.e, y: run.y, f: target[now], ahead: (k) => target[Math.min(now + k, target.length - 1)] });
  };

  function frame(stamp: number): void {
    if (over_) return;
    time.frame(frame);
    const now = time.now();
    if (!asked) {
      times.push(stamp);
      const rest = COUNTDOWN_MS - (now - origin);
      if (rest > 0) {
        count.textContent = String(Math.ceil(rest / 1000));
        surface.task(message.condition, { e: 0, y: 0, f: 0, ahead: () => 0 });
        return;
      }
      over.remove();
      zero = now;
      asked = true;
      wire.say({
        type: "begin",
        number: message.number,
        input: map,
        device: own.device,
        clock: time.clock,
        refresh_ms: usual(times),
        zero_ms: zero,
      });
      if (!Number.isNaN(left)) run.input(0, 0, left);
      if (operator) drive(operator);
    }
    run.advance(now - zero);
    draw();
    run.frame(stamp - zero, now - zero);
    operator?.sees(run.e, now - zero);
    if (now - sent > BATCH_MS || run.done) {
      sent = now;
      if (run.done) return end(true, "");
      wire.say({ type: "batch", number: message.number, batch: run.take() });
    }
  }

  /** The simulated operator moves a pointer, 125 times a second in real time. */
  function drive(person: Operator): void {
    const move = () => {
      if (over_) return clearInterval(timer);
      const at = time.now() - zero;
      const clientX = person.raw(at);
      const kind = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";
      canvas.dispatchEvent(new PointerEvent(kind, { pointerType: own.device, clientX }));
    };
    const timer = setInterval(move, 8);
  }

  time.frame(frame);
  return (words) => end(false, words, false);
}

/** The median time between frames, ms. */
function usual(times: number[]): number {
  const steps = times.slice(1).map((t, k) => t - times[k]).sort((a, b) => a - b);
  return steps[Math.floor(steps.length / 2)] ?? 0;
}
