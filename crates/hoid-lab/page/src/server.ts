// Connection to the program hoid: messages by a socket; finished runs are requested by their address.

import { h } from "./dom";
import type { FromPage, Listener, LiveLine, RunData, State, Wire } from "./wire";

export class Server implements Wire {
  readonly alone = false;
  private readonly socket: WebSocket;
  private readonly base = location.pathname.replace(/experimenter$/, "");

  constructor(listener: Listener, opened: () => void) {
    this.socket = new WebSocket(`ws://${location.host}${this.base}socket`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = (event) => {
      if (typeof event.data === "string") listener.hear(JSON.parse(event.data));
      else listener.tables(new Float64Array(event.data));
    };
    this.socket.onclose = () => listener.gone();
    this.socket.onopen = opened;
  }

  say(message: FromPage): void {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  async data(number: number): Promise<RunData | null> {
    try {
      const answer = await fetch(`${this.base}data/${number}.json`);
      if (!answer.ok) return null;
      const told = await answer.json();
      return { ...told, live: linesOf(told.live) };
    } catch {
      // The program has ended; the page reports it.
      return null;
    }
  }

  takeHome(state: State): HTMLElement {
    const name = `${(state.session ?? "session").replace("/", "_")}.zip`;
    return h("p", {}, h("a", { class: "button quiet", href: "export.zip", download: name }, "All data as one archive"));
  }
}

/** Rows of live.csv as lines. */
function linesOf(rows: (number | null)[][]): LiveLine[] {
  return rows.map((r) => ({
    t: r[0] ?? 0,
    gain: [r[1], r[2]],
    lead_s: [r[3], r[4]],
    lag_s: [r[14] ?? null, r[15] ?? null],
    lag_waiting: (r[14] ?? null) === null ? "not determined" : null,
    omega_nm_rad_s: [r[5], r[6]],
    delay_s: [r[7], r[8]],
    crossover_rad_s: [r[9], r[10]],
    phase_margin_deg: [r[11], r[12]],
    changed_s: r[13] ?? null,
    waiting: null,
  }));
}
