// The page without the program hoid: one file with the tables of an experiment and the tracker in WebAssembly.
// Runs stay in the window. No other program recomputes them, so no run is verified.

import { button, h } from "./dom";
import { type Batch, type EventRow, type FrameRow, type Phase, Run } from "./engine";
import { begin } from "./main";
import { Kernel, SAMPLE_S, Tracker } from "./tracker";
import type { Condition, Done, FromPage, Listener, LiveLine, Measures, RunData, State, Wire } from "./wire";

/** A planned run; the tables are little-endian numbers in base 64. */
interface Planned {
  condition: Condition;
  /** Controlled element, if it does not change. */
  element: string | null;
  training: boolean;
  run_in: number;
  ticks: number;
  phases: Phase[];
  target: string;
  disturbance: string;
}

interface Experiment {
  name: string;
  consent: string;
  live: State["live"];
  runs: Planned[];
}

const TICKS_PER_SAMPLE = 10;
const TICK_S = SAMPLE_S / TICKS_PER_SAMPLE;
/** A frame counts as missed if the interval exceeds this multiple of the median interval. */
const MISSED = 1.5;

/** A run in progress. */
interface Going {
  number: number;
  planned: Planned;
  refresh_ms: number;
  run: Run;
  target: Float64Array;
  disturbance: Float64Array;
  u: number[];
  e: number[];
  events: EventRow[];
  frames: FrameRow[];
  tracker: Tracker;
  live: LiveLine[];
}

class Alone implements Wire {
  readonly alone = true;
  private subject: string | null = null;
  private readonly done: Done[] = [];
  private readonly runs: Going[] = [];
  /** Tables of the requested run. */
  private tables: [Float64Array, Float64Array] = [new Float64Array(), new Float64Array()];
  private going: Going | null = null;

  constructor(
    private readonly experiment: Experiment,
    private readonly kernel: Kernel,
    private readonly listener: Listener,
  ) {}

  say(message: FromPage): void {
    // As with a program, the answer arrives after the current work is done.
    queueMicrotask(() => this.hear(message));
  }

  async data(number: number): Promise<RunData | null> {
    const going = this.runs.find((run) => run.number === number);
    const done = this.done.find((run) => run.number === number);
    if (!going || !done) return null;
    const { e, u, f } = samplesOf(going);
    return {
      number,
      condition: going.planned.condition,
      start_s: -going.planned.run_in * TICK_S,
      step_s: SAMPLE_S,
      e,
      u,
      f,
      y: e.map((e, k) => f[k] - e),
      live: going.live,
      verdict: done.verdict,
      reasons: done.reasons,
    };
  }

  takeHome(): HTMLElement {
    const save = (going: Going) => {
      const link = h("a", { href: URL.createObjectURL(new Blob([tableOf(going)], { type: "text/csv" })), download: `${this.subject}-run-${going.number}.csv` });
      link.click();
      URL.revokeObjectURL(link.href);
    };
    const saves = this.runs.map((going) => button(`Save run ${going.number}`, () => save(going), { class: "quiet" }));
    return h("div", {}, h("p", { class: "soft" }, "Save a run as a table of t, e, u, f_t and d for hoid identify, track and describe:"), ...saves);
  }

  private hear(message: FromPage): void {
    switch (message.type) {
      case "hello":
        return this.tell();
      case "consent":
        this.subject = message.subject || "P01";
        return this.tell();
      case "next":
        return this.send();
      case "begin": {
        const planned = this.next();
        if (!planned) return;
        const [target, disturbance] = this.tables;
        const task = { ...planned, target, disturbance };
        this.going = {
          number: message.number,
          planned,
          refresh_ms: message.refresh_ms,
          run: new Run(task, message.input),
          target,
          disturbance,
          u: [],
          e: [],
          events: [],
          frames: [],
          tracker: new Tracker(this.kernel, planned.element),
          live: [],
        };
        return this.tell();
      }
      case "batch":
        return this.take(message.batch);
      case "finish":
        return this.end("finished");
      case "abort":
        return this.end("interrupted");
    }
  }

  private next(): Planned | null {
    return this.experiment.runs[this.place()] ?? null;
  }

  private place(): number {
    return this.done.filter((run) => run.how === "finished").length;
  }

  private send(): void {
    const planned = this.next();
    if (!planned) return;
    const [target, disturbance] = [numbers(planned.target), numbers(planned.disturbance)];
    this.tables = [target, disturbance];
    this.listener.hear({
      type: "run",
      number: this.done.length + 1,
      condition: planned.condition,
      training: planned.training,
      run_in: planned.run_in,
      ticks: planned.ticks,
      phases: planned.phases,
      tables: [target.length, disturbance.length, 0],
      operator: null,
    });
    const both = new Float64Array(target.length + disturbance.length);
    both.set(target);
    both.set(disturbance, target.length);
    this.listener.tables(both);
  }

  private take(batch: Batch): void {
    const going = this.going;
    if (!going) return;
    let changed: number | null = null;
    const before = going.e.length;
    going.u.push(...batch.u);
    going.e.push(...batch.e);
    going.events.push(...batch.events);
    going.frames.push(...batch.frames);
    const time = (k: number) => (k - going.planned.run_in) * TICK_S;
    const first = Math.ceil(before / TICKS_PER_SAMPLE) * TICKS_PER_SAMPLE;
    for (let k = first; k < going.e.length; k += TICKS_PER_SAMPLE) {
      const ago = going.tracker.step(going.e[k], going.u[k]);
      if (ago !== null) changed = time(k) - ago;
    }
    if (going.e.length <= first) return;
    const { operator, openLoop, waiting } = going.tracker.estimates();
    const line: LiveLine = {
      t: time(Math.ceil(going.e.length / TICKS_PER_SAMPLE) * TICKS_PER_SAMPLE),
      gain: operator[0],
      lead_s: operator[1],
      lag_s: [null, null],
      lag_waiting: "not estimated here",
      omega_nm_rad_s: operator[3],
      delay_s: operator[5],
      crossover_rad_s: openLoop[0],
      phase_margin_deg: openLoop[1],
      changed_s: changed,
      waiting,
    };
    going.live.push(line);
    if (this.experiment.live === "during") this.listener.hear({ type: "live", number: going.number, line });
  }

  private end(how: Done["how"]): void {
    const going = this.going;
    if (!going) return;
    this.going = null;
    going.tracker.free();
    if (going.e.length > 2 * TICKS_PER_SAMPLE) this.runs.push(going);
    const { measures, rms_e, score } = measured(going);
    const done: Done = {
      number: going.number,
      condition: going.planned.condition.name,
      training: going.planned.training,
      how,
      verdict: "unverified",
      reasons: "this page cannot recompute the run; hoid lab can",
      notes: measures.missed_frames > 0 ? `${measures.missed_frames} of ${measures.frames} frames were missed` : "",
      rms_e,
      score,
    };
    this.done.push(done);
    this.listener.hear({ type: "verdict", done, measures });
    this.tell();
  }

  private tell(): void {
    const { name, consent, live, runs } = this.experiment;
    const next = this.next();
    this.listener.hear({
      type: "state",
      phase: this.subject === null ? "consent" : next ? "runs" : "finished",
      name,
      consent,
      live,
      calibrate: false,
      session: this.subject,
      open: [],
      done: [...this.done],
      planned: runs.map((run) => run.condition.name),
      next: next ? this.place() : null,
      condition: next?.condition ?? null,
      training: next?.training ?? false,
      running: this.going?.number ?? null,
      reporting: false,
      reports: [],
      calibration: [],
    });
  }
}

function samplesOf(going: Going): { e: number[]; u: number[]; f: number[]; d: number[] } {
  const every = (signal: ArrayLike<number>) =>
    Array.from({ length: Math.ceil(going.e.length / TICKS_PER_SAMPLE) }, (_, k) => signal[k * TICKS_PER_SAMPLE]);
  return { e: every(going.e), u: every(going.u), f: every(going.target), d: every(going.disturbance) };
}

function tableOf(going: Going): string {
  const { e, u, f, d } = samplesOf(going);
  const row = (k: number) => [(k * TICKS_PER_SAMPLE - going.planned.run_in) / 1000, e[k], u[k], f[k], d[k]].join(",");
  return ["t,e,u,f_t,d", ...e.map((_, k) => row(k)), ""].join("\n");
}

/** The measures, as in verify.rs. */
function measured(going: Going): { measures: Measures; rms_e: number; score: number } {
  const steps = going.frames.slice(1).map((frame, k) => frame[0] - going.frames[k][0]);
  const frame_ms = median(steps);
  const usual = going.refresh_ms > 0 ? going.refresh_ms : frame_ms;
  const missed = (step: number) => (step > MISSED * usual ? Math.round(step / usual) - 1 : 0);
  const rms = (values: number[]) => Math.sqrt(values.reduce((sum, v) => sum + v * v, 0) / Math.max(1, values.length));
  // Error without control.
  going.run.advance(going.e.length - 1);
  const rest = rms(going.run.take().e.slice(going.planned.run_in));
  const rms_e = rms(going.e.slice(going.planned.run_in));
  return {
    rms_e,
    score: rest > 0 ? Math.max(0, 100 * (1 - rms_e / rest)) : 0,
    measures: {
      frames: going.frames.length,
      frame_ms,
      longest_frame_ms: steps.reduce((longest, step) => Math.max(longest, step), 0),
      missed_frames: steps.reduce((sum, step) => sum + missed(step), 0),
      input_hz: going.events.length / (Math.max(1, going.e.length) * TICK_S),
      input_age_ms: median(going.events.map((event) => event[2] - event[1])),
    },
  };
}

function median(values: number[]): number {
  const sorted = [...values].sort((a, b) => a - b);
  return sorted[Math.floor(sorted.length / 2)] ?? 0;
}

function bytes(text: string): Uint8Array<ArrayBuffer> {
  return Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
}

function numbers(text: string): Float64Array {
  return new Float64Array(bytes(text).buffer);
}

/** Returns the data that are packed in the page under a name. */
async function packed(name: string): Promise<ArrayBuffer> {
  const text = document.getElementById(name)?.textContent ?? "";
  const unpacked = new Blob([bytes(text.trim())]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(unpacked).arrayBuffer();
}

async function start(): Promise<void> {
  const [kernel, tables] = await Promise.all([packed("kernel"), packed("experiment")]);
  const experiment: Experiment = JSON.parse(new TextDecoder().decode(tables));
  const hoid = await Kernel.of(kernel);
  begin((listener, opened) => {
    queueMicrotask(opened);
    return new Alone(experiment, hoid, listener);
  });
}

start().catch((error: unknown) => {
  const main = document.getElementById("main");
  main?.replaceChildren(h("h1", {}, "This browser cannot run the page"), h("p", {}, String(error)), h("p", {}, "Use a browser from 2023 or later, or install hoid and run hoid lab."));
});
