// Replay of a run: the task as it was on the screen, and the estimate.

import { Surface } from "./display";
import { button, h } from "./dom";
import { Plots } from "./plots";
import type { RunData } from "./wire";

let stopReplay = () => {};

/** Replays a run; `judged` is the text of its verdict. */
export function play(run: RunData | null, place: HTMLElement, judged: string): void {
  stopReplay();
  if (!run) {
    place.replaceChildren(h("p", {}, "This run has no data."));
    return;
  }
  const canvas = h("canvas", { class: "replay", role: "img", "aria-label": "The task as it was shown" });
  const curves = h("canvas", { class: "plots", role: "img", "aria-label": "The estimate over time" });
  const slider = h("input", { type: "range", min: "0", max: String(run.e.length - 1), step: "1", value: "0", "aria-label": "Time" });
  const speed = h("select", { "aria-label": "Speed" });
  for (const factor of ["1", "2", "5", "10"]) speed.append(h("option", { value: factor, selected: factor === "2" }, `Speed × ${factor}`));
  const clock = h("p", { class: "soft" });
  const toggle = button("Pause", () => {
    going = !going;
    toggle.textContent = going ? "Pause" : "Play";
  });
  place.replaceChildren(
    h("h2", {}, `Run ${run.number}: ${run.condition.name}`),
    h("p", {}, judged, ": ", h("span", { class: run.verdict === "verified" ? "good" : "bad" }, run.verdict), run.reasons ? `: ${run.reasons}` : "."),
    canvas,
    slider,
    clock,
    toggle,
    speed,
    curves,
  );
  const surface = new Surface(canvas);
  const estimates = new Plots(curves);
  estimates.set(run.live, run.start_s, run.start_s + run.e.length * run.step_s);
  let going = true;
  let over = false;
  let at = 0;
  let before = performance.now();
  let drawn = 0;
  let shownWidth = canvas.clientWidth;
  slider.addEventListener("input", () => (at = Number(slider.value)));
  stopReplay = () => (over = true);
  const frame = (now: number) => {
    if (over) return;
    if (canvas.clientWidth !== shownWidth) {
      shownWidth = canvas.clientWidth;
      surface.fit();
    }
    requestAnimationFrame(frame);
    if (going) at = Math.min(run.e.length - 1, at + ((now - before) / 1000 / run.step_s) * Number(speed.value));
    before = now;
    const k = Math.floor(at);
    const f = (i: number) => run.f?.[Math.min(i, run.e.length - 1)] ?? 0;
    surface.task(run.condition, { e: run.e[k], y: run.y[k], f: f(k), ahead: (ticks) => f(k + Math.round(ticks / 10)) });
    slider.value = String(k);
    const t = run.start_s + k * run.step_s;
    clock.textContent = `${t.toFixed(1)} s${t < 0 ? " (run-in)" : ""}`;
    if (now - drawn > 100) {
      drawn = now;
      estimates.draw(t);
    }
  };
  requestAnimationFrame(frame);
}
