// The program under test, and the browser.
import { spawn } from "node:child_process";
import { existsSync } from "node:fs";

const BROWSERS = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];

/** Returns the available browser; without one, reports it and exits. */
export function browserOrEnd() {
  const found = [process.env.HOID_CHROMIUM, ...BROWSERS].find((path) => path && existsSync(path));
  if (!found) {
    console.log("skipped: no browser is here (apt-get install chromium, or HOID_CHROMIUM=PATH)");
    process.exit(0);
  }
  return found;
}

const children = new Set();

/** Stops all running servers, for example after a failed test. */
export function endAll() {
  for (const child of children) child.kill("SIGKILL");
}

/** Starts `hoid lab` with arguments; returns its address. */
export async function lab(program, ...args) {
  const child = spawn(program, ["lab", ...args], { stdio: ["ignore", "pipe", "inherit"] });
  children.add(child);
  child.on("exit", () => children.delete(child));
  const address = await new Promise((resolve, reject) => {
    let text = "";
    child.stdout.on("data", (data) => {
      text += data;
      if (text.includes("\n")) resolve(text.trim());
    });
    child.on("exit", (code) => reject(new Error(`hoid lab ended with ${code}`)));
  });
  const ended = new Promise((resolve) => child.on("exit", resolve));
  return {
    address,
    pid: child.pid,
    async end(signal = "SIGTERM") {
      child.kill(signal);
      await ended;
    },
  };
}

/** A clock that a test advances, in place of the clock of the browser. */
export function injectTime() {
  window.hoidTime = {
    clock: "injected",
    t: 1000,
    waiting: [],
    now() {
      return this.t;
    },
    frame(each) {
      this.waiting.push(each);
    },
    stamp() {
      return this.t;
    },
    turn(ms) {
      this.t += ms;
      const all = this.waiting;
      this.waiting = [];
      for (const each of all) each(this.t);
    },
  };
}

/**
 * A person who is a program, in the page: u = 0.7 e(t - 0.2 s) + K_d f'(t - 0.2 s) and a little noise, by pointer
 * events each 8 ms; in injected time as fast as it goes, in real time until the run is done.
 */
export async function operator({ injected, until, K_d = 0 }) {
  const canvas = document.querySelector("canvas.task");
  const kind = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";
  const seen = [];
  let [noise, seed] = [0, 12345];
  const random = () => {
    seed = (seed * 1103515245 + 12345) % 2147483648;
    return seed / 2147483648 - 0.5;
  };
  const move = (now) => {
    const { run, map } = window.hoidLab;
    seen.push([now, run.e, run.e + run.y]);
    let k = seen.length - 1;
    while (k > 0 && seen[k][0] > now - 200) k--;
    noise = 0.95 * noise + 0.1 * random();
    const [then, e, f] = seen[k];
    const [before, , last] = seen[Math.max(k - 4, 0)];
    const rate = then > before ? (1000 * (f - last)) / (then - before) : 0;
    const u = 0.7 * e + K_d * rate + noise;
    const part = Math.max(-1, Math.min(1, u / map.gain));
    canvas.dispatchEvent(new PointerEvent(kind, { pointerType: "mouse", clientX: map.centre + part * map.span }));
  };
  const over = () => !canvas.isConnected || (until && window.hoidLab.run.next >= until);
  if (!injected) {
    while (!over()) {
      move(performance.now());
      await new Promise((resolve) => setTimeout(resolve, 8));
    }
    return;
  }
  const time = window.hoidTime;
  for (let k = 0; !over(); k++) {
    time.turn(16.7);
    if (canvas.isConnected) {
      move(time.t);
      time.t += 8;
      move(time.t);
      time.t -= 8;
    }
    // The socket needs some time.
    if (k % 60 === 0) await new Promise((resolve) => setTimeout(resolve, 0));
  }
}
