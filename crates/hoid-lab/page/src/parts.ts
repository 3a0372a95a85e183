// Parts of several screens: verdicts, tables of runs.

import { button, h } from "./dom";
import type { Done, Measures } from "./wire";

export const percent = (v: number) => `${Math.round(v)} of 100`;

export function worth(done: Done): HTMLElement {
  const good = done.verdict === "verified";
  return h(
    "span",
    {},
    h("span", { class: good ? "good" : "bad" }, done.verdict),
    done.reasons ? `: ${done.reasons}` : "",
    done.notes ? ` (${done.notes})` : "",
  );
}

export function facts(done: Done, measures: Measures): HTMLElement[] {
  return [
    h("p", {}, "This run is ", worth(done), "."),
    h(
      "p",
      { class: "soft" },
      `Frames of ${measures.frame_ms.toFixed(1)} ms, the longest ${measures.longest_frame_ms.toFixed(1)} ms, ${measures.missed_frames} missed; ` +
        `${measures.input_hz.toFixed(0)} events a second, ${measures.input_age_ms.toFixed(1)} ms old on arrival.`,
    ),
  ];
}

export function runsTable(done: Done[], pick?: (number: number) => void): HTMLElement {
  const row = (d: Done) =>
    h(
      "tr",
      {},
      h("td", {}, pick ? button(`Run ${d.number}`, () => pick(d.number), { class: "quiet" }) : String(d.number)),
      h("td", {}, d.condition + (d.training ? " (training)" : "")),
      h("td", {}, d.how === "finished" ? percent(d.score) : "ended early"),
      h("td", {}, worth(d)),
    );
  const head = ["Run", "Task", "Score", "Verdict"].map((text) => h("th", { scope: "col" }, text));
  return h("div", { class: "scroll" }, h("table", {}, h("thead", {}, h("tr", {}, ...head)), h("tbody", {}, ...done.map(row))));
}

export const digits = (v: number) => v.toFixed(Math.abs(v) < 1 ? 3 : Math.abs(v) < 10 ? 2 : 0);
