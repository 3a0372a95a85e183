// The screens of the person, of the experimenter, and of the replay of a session.

import { Surface } from "./display";
import { button, h, show } from "./dom";
import { inputOf } from "./engine";
import { DEVICES, type Device, type Settings, keep, listen, mapOf, settings } from "./input";
import { digits, facts, percent, runsTable } from "./parts";
import { Plots } from "./plots";
import { play } from "./replay";
import { type Given, start } from "./session";
import { time } from "./time";
import { type Condition, type Done, type FromServer, type LiveLine, type Measures, type Listener, type RunMessage, type State, type Wire } from "./wire";

const looksOn = location.pathname.endsWith("/experimenter");
let state: State | null = null;
let own: Settings = settings();
/** The current screen of the person; some screens do not change with messages of the server. */
let screen: "start" | "settings" | "ready" | "run" | "result" | "other" = "start";
let waiting: RunMessage | null = null;
let verdict: { done: Done; measures: Measures } | null = null;
let broken = "";
/** Ends the run in this window. */
let stop: (words: string) => void = () => {};
/** True if the session continues in another window. */
let elsewhere = false;
const plotsCanvas = h("canvas", { class: "plots", role: "img", "aria-label": "The estimate over time, with bands of two standard errors" });
const livePlots = new Plots(plotsCanvas);

let wire: Wire;

/** Shows the page of an experiment; the wire is notified that the page was `opened`. */
export function begin(connect: (listener: Listener, opened: () => void) => Wire): void {
  show("", h("p", {}, "Connecting ..."));
  wire = connect({ hear, tables, gone }, () => wire.say({ type: "hello", role: looksOn ? "experimenter" : "person", browser: browser() }));
}

function browser(): Record<string, string> {
  return {
    user_agent: navigator.userAgent.slice(0, 500),
    language: navigator.language,
    screen: `${window.screen.width} x ${window.screen.height}`,
    window: `${innerWidth} x ${innerHeight}`,
    pixel_ratio: String(devicePixelRatio),
    isolated: String(crossOriginIsolated),
    raw_events: String("onpointerrawupdate" in window),
    clock: time.clock,
  };
}

function gone(): void {
  screen = "other";
  show(
    "",
    h("h1", {}, "The program has ended"),
    h("p", {}, "Start it again and open the address that it prints. Everything up to the last second is stored, and the session continues with the next run."),
  );
}

function hear(message: FromServer): void {
  switch (message.type) {
    case "state":
      if (elsewhere) return;
      state = message;
      if (state.phase === "replay") return replay();
      if (looksOn) return experimenter();
      return person();
    case "run":
      waiting = message;
      return;
    case "verdict":
      verdict = message;
      if (!looksOn && screen === "result") result();
      return;
    case "live":
      return live(message.number, message.line);
    case "yours":
      elsewhere = false;
      screen = "start";
      return;
    case "refused":
      if (message.elsewhere) {
        elsewhere = true;
        show("", h("h1", {}, "This window is view-only"), h("p", {}, message.words), button("Try here", () => location.reload()));
      } else if (screen === "run") {
        // For example, the disk is full: the run cannot continue.
        stop(message.words);
      } else if (screen === "result" && !verdict && !broken) {
        broken = message.words;
        result();
      } else {
        document.getElementById("refused")?.remove();
        document.getElementById("main")?.prepend(h("p", { class: "box bad", id: "refused", role: "alert" }, message.words));
      }
  }
}

function tables(numbers: Float64Array): void {
  const message = waiting;
  waiting = null;
  if (!message || screen === "run") return;
  screen = "run";
  verdict = null;
  broken = "";
  const given: Given = { message, tables: numbers };
  stop = start(wire, given, own, (_, words) => {
    broken = words;
    screen = "result";
    result();
  });
}

// --- The person ---

function person(): void {
  if (!state) return;
  if (screen === "run" || screen === "settings") return;
  if (state.phase === "consent") return consent();
  if (screen === "result" && state.phase === "runs") return result();
  if (state.phase === "finished") return finished();
  if (screen === "start") return state.done.length > 0 ? ready() : setUp();
  ready();
}

function consent(): void {
  if (!state) return;
  const s = state;
  screen = "start";
  if (document.getElementById("subject")) return;
  const name = h("input", { type: "text", id: "subject", value: s.calibrate ? "calibration" : "P01", maxlength: "20", autocomplete: "off" });
  const agree = h("input", { type: "checkbox", id: "agree", change: () => (go.disabled = !agree.checked) });
  const cc0 = h("input", { type: "checkbox", id: "cc0" });
  const go = button("Start", () => wire.say({ type: "consent", subject: name.value.trim(), agreed: agree.checked, cc0: cc0.checked }), {
    disabled: true,
    id: "begin",
  });
  const open = s.open.map((session) =>
    button(`Continue ${session}`, () => wire.say({ type: "resume", session }), { class: "quiet" }),
  );
  show(
    "",
    h("h1", {}, s.name),
    open.length > 0 && h("div", { class: "box" }, h("p", {}, "A session was not finished."), ...open),
    h("p", {}, s.consent),
    h("label", {}, "Made-up name (letters and digits)", name),
    h("label", { class: "check" }, agree, h("span", {}, s.calibrate ? "Start it." : "I have read this and agree to take part.")),
    wire.alone && h("p", {}, "Your runs stay in this window until you close it. Nothing is sent, and nothing is stored unless you save it."),
    !s.calibrate && !wire.alone && h("label", { class: "check" }, cc0, h("span", {}, "My data may be shared with anyone, without conditions (CC0). Leave this box empty if you are not sure.")),
    go,
    !s.calibrate && !wire.alone && h("p", { class: "soft" }, h("a", { href: "experimenter", target: "_blank" }, "Window for the experimenter")),
  );
}

let stopTest = () => {};

function setUp(): void {
  screen = "settings";
  if (state?.calibrate) {
    own = { device: "mouse", sensitivity: 1, reversed: false, dead: 0 };
    return ready();
  }
  stopTest();
  const pick = h("select", { id: "device", change: () => change({ device: pick.value as Device }) });
  for (const [value, text] of DEVICES) pick.append(h("option", { value, selected: value === own.device }, text));
  const range = (key: "sensitivity" | "dead", least: string, most: string) => {
    const slider = h("input", { type: "range", id: key, min: least, max: most, step: "0.01", value: String(own[key]) });
    slider.addEventListener("input", () => change({ [key]: Number(slider.value) }));
    return slider;
  };
  const reversed = h("input", { type: "checkbox", id: "reversed", checked: own.reversed, change: () => change({ reversed: reversed.checked }) });
  const canvas = h("canvas", { class: "test", role: "img", "aria-label": "Where your hand is" });
  show(
    "",
    h("h1", {}, "How you steer"),
    h("label", {}, "With", pick),
    h("p", {}, "Move here from side to side: the ring follows your hand. Both ends should be easy to reach."),
    canvas,
    h("label", {}, "Sensitivity", range("sensitivity", "0.3", "3")),
    h("label", {}, "Dead zone in the middle (for sticks that do not rest at zero)", range("dead", "0", "0.3")),
    h("label", { class: "check" }, reversed, h("span", {}, "Left and right reversed")),
    button("Done", () => {
      stopTest();
      ready();
    }),
  );
  const surface = new Surface(canvas);
  surface.hand(0);
  const hear = () => {
    stopTest();
    stopTest = listen(canvas, own.device, (event) => surface.hand(inputOf(mapOf(own, canvas.getBoundingClientRect(), 1), event.raw)));
  };
  function change(part: Partial<Settings>): void {
    own = { ...own, ...part };
    keep(own);
    hear();
  }
  hear();
  const sized = () => {
    if (!canvas.isConnected) return removeEventListener("resize", sized);
    surface.fit();
    surface.hand(0);
  };
  addEventListener("resize", sized);
}

/** Requests the next run by a button or the space bar. */
function startButton(text: string): HTMLButtonElement {
  const go = button(text, () => wire.say({ type: "next" }), { id: "start" });
  return go;
}

addEventListener("keydown", (event) => {
  const start = document.getElementById("start") as HTMLButtonElement | null;
  const typing = document.activeElement instanceof HTMLInputElement || document.activeElement instanceof HTMLButtonElement;
  if (event.key === " " && start && !start.disabled && !typing) {
    event.preventDefault();
    start.click();
  }
});

const DISPLAYS: Record<Condition["display"], string> = {
  compensatory: "The ring in the middle is you; the line is where you should be. Move towards the line.",
  pursuit: "The ring is you; the line is where you should be. Move the ring onto the line.",
  preview: "The ring is you. The line comes down to you, so you can see where it will be.",
};

function ready(): void {
  if (!state?.condition) return;
  screen = "ready";
  const { condition, planned, next, training } = state;
  const last = state.done[state.done.length - 1];
  show(
    "",
    h("h1", {}, `Run ${(next ?? 0) + 1} of ${planned.length}${training ? " (training)" : ""}`),
    last?.how === "interrupted" && h("p", { class: "box" }, "The last run was interrupted and will be repeated."),
    h("p", {}, condition.text),
    h("p", {}, DISPLAYS[condition.display]),
    h("p", { class: "soft" }, h("kbd", {}, "Space"), " starts the run, and ", h("kbd", {}, "Esc"), " ends it early. A countdown of three seconds comes first. Keep this window in front."),
    startButton("Start"),
    button("How I steer", setUp, { class: "quiet" }),
  );
}

let rest = 0;

function result(): void {
  if (!state) return;
  if (broken) {
    clearInterval(rest);
    show("", h("h1", {}, "The run was ended early"), h("p", {}, broken), state.phase === "finished" ? null : startButton("Start again"));
    return;
  }
  if (!verdict) {
    show("", h("h1", {}, "Checking the run ..."));
    return;
  }
  const { done, measures } = verdict;
  if (state.phase === "finished") return finished();
  const pause = h("p", { "aria-live": "polite" }, "");
  const go = startButton("Next run");
  // The break is that of the condition of the last run.
  let left = Math.round(state.condition?.break_s ?? 0);
  clearInterval(rest);
  const tell = () => {
    pause.textContent = left > 0 ? `Rest for ${left} s.` : "";
    go.disabled = left > 0;
    if (left-- <= 0) clearInterval(rest);
  };
  rest = window.setInterval(tell, 1000);
  show(
    "",
    h("h1", {}, `Score: ${percent(done.score)}`),
    ...facts(done, measures),
    h("div", { id: "person" }),
    pause,
    go,
    button("How I steer", setUp, { class: "quiet" }),
  );
  tell();
  if (state.live !== "never") void estimate(done.number);
}

/** The last live estimate of a run, for the person. */
async function estimate(number: number): Promise<void> {
  const place = document.getElementById("person");
  const run = await wire.data(number);
  const last = run?.live[run.live.length - 1];
  if (!place || !run || !last) return;
  const shown = run.condition.display === "compensatory" ? "" : "The display shows the target, but this estimate covers only the response to the error. The report of hoid identify shows both responses.";
  const cell = (name: string, told: [number | null, number | null], unit: string, none = "–") =>
    h("div", {}, name, h("b", {}, told[0] === null ? none : `${digits(told[0])} ${unit}`), told[1] === null ? "" : `± ${digits(told[1])}`);
  place.replaceChildren(
    h("h2", {}, "The estimate of your behaviour"),
    h(
      "div",
      { class: "numbers" },
      cell("Gain", last.gain, ""),
      cell("Lead", last.lead_s, "s"),
      cell("Lag", last.lag_s, "s", last.lag_waiting ?? "–"),
      cell("Delay", last.delay_s, "s"),
      cell("Crossover", last.crossover_rad_s, "rad/s"),
      cell("Phase margin", last.phase_margin_deg, "deg"),
    ),
    h("p", {}, shown),
  );
}

function links(): HTMLElement {
  const s = state as State;
  const all = s.reports.map(([text, place]) => h("li", {}, h("a", { href: place, target: "_blank" }, text)));
  return h(
    "div",
    {},
    h("h2", {}, "Reports"),
    s.reporting && h("p", { class: "soft" }, "Reports are being written; this takes a minute or two."),
    all.length > 0 ? h("ul", {}, ...all) : !s.reporting && h("p", { class: "soft" }, "There are no reports yet."),
  );
}

function finished(): void {
  const s = state as State;
  clearInterval(rest);
  screen = "other";
  const shownDone = s.done[s.done.length - 1];
  const place = h("div");
  show(
    "",
    h("h1", {}, s.calibrate ? "Calibrated" : "Done. Thank you."),
    ...(s.calibration.length > 0
      ? [h("table", {}, ...s.calibration.map(([name, value]) => h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, value)))),
         h("p", { class: "soft" }, "This latency is part of every delay identified here. The screen and the input device add more latency, which only a light sensor can measure.")]
      : []),
    runsTable(s.done),
    h("div", { id: "person" }),
    !s.calibrate && !wire.alone && links(),
    wire.takeHome(s),
    place,
  );
  if (wire.alone && shownDone) void again(shownDone.number, place, "This run is");
  if (!s.calibrate && s.live !== "never" && shownDone) void estimate(shownDone.number);
}

// --- The experimenter ---

let shownRun = 0;

function experimenter(): void {
  const s = state as State;
  show(
    "wide",
    h("h1", {}, `${s.name}: ${s.session ?? "no session yet"}`),
    h("p", { id: "status", "aria-live": "polite" }, s.running ? `Run ${s.running} is in progress.` : s.phase === "finished" ? "The session is done." : `Runs: ${s.done.length} ended, ${s.planned.length} planned.`),
    h("p", { id: "waiting", class: "soft" }),
    plotsCanvas,
    s.done.length > 0 && runsTable(s.done),
    s.phase === "finished" && links(),
  );
  livePlots.draw();
}

let due = false;
addEventListener("resize", () => {
  if (plotsCanvas.isConnected) livePlots.draw();
});

function live(number: number, line: LiveLine): void {
  if (number !== shownRun) {
    shownRun = number;
    livePlots.begin(line.t, line.t + 30);
  }
  livePlots.add(line);
  (globalThis as { hoidLive?: unknown }).hoidLive = { t: line.t, at: performance.timeOrigin + performance.now() };
  const reason = document.getElementById("waiting");
  if (reason) reason.textContent = line.waiting ? `No estimate yet: ${line.waiting}` : "";
  if (due || !plotsCanvas.isConnected) return;
  due = true;
  requestAnimationFrame(() => {
    due = false;
    livePlots.draw();
  });
}

// --- Replay of a session ---

async function again(number: number, place: HTMLElement, judged: string): Promise<void> {
  play(await wire.data(number), place, judged);
}

function replay(): void {
  const s = state as State;
  if (document.getElementById("replay")) return;
  const place = h("div", { id: "replay" });
  const judged = "Recomputed now";
  show("wide", h("h1", {}, `${s.name}: ${s.session}`), runsTable(s.done, (number) => void again(number, place, judged)), place, links());
  const first = s.done.find((d) => d.how === "finished") ?? s.done[0];
  if (first) void again(first.number, place, judged);
}
