// Curves with bands over time, on one canvas.

import { colour } from "./dom";
import type { LiveLine, Told } from "./wire";

interface Panel {
  title: string;
  of: (line: LiveLine) => Told;
  /** Text for a missing number. */
  waiting?: (line: LiveLine) => string | null;
  /** The smallest span that is shown. */
  least: [number, number];
}

const PANELS: Panel[] = [
  { title: "Gain K", of: (l) => l.gain, least: [0, 1] },
  { title: "Lead, s", of: (l) => l.lead_s, least: [0, 0.5] },
  { title: "Lag, s", of: (l) => l.lag_s, waiting: (l) => l.lag_waiting, least: [0, 2] },
  { title: "Delay, s", of: (l) => l.delay_s, least: [0, 0.4] },
  { title: "Crossover, rad/s", of: (l) => l.crossover_rad_s, least: [0, 5] },
  { title: "Phase margin, deg", of: (l) => l.phase_margin_deg, least: [0, 60] },
];

export class Plots {
  private lines: LiveLine[] = [];
  private changes: number[] = [];
  private from = 0;
  private to = 1;

  constructor(private readonly canvas: HTMLCanvasElement) {}

  begin(from: number, to: number): void {
    this.lines = [];
    this.changes = [];
    this.from = from;
    this.to = to;
  }

  add(line: LiveLine): void {
    this.lines.push(line);
    if (line.t > this.to) this.to = line.t + 10;
    if (line.changed_s !== null) this.changes.push(line.changed_s);
  }

  set(lines: LiveLine[], from: number, to: number): void {
    this.begin(from, to);
    for (const line of lines) this.add(line);
  }

  draw(now = Infinity): void {
    const { canvas } = this;
    const box = canvas.getBoundingClientRect();
    const ratio = devicePixelRatio || 1;
    canvas.width = Math.max(1, Math.round(box.width * ratio));
    canvas.height = Math.max(1, Math.round(box.height * ratio));
    const c = canvas.getContext("2d");
    if (!c) return;
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    const [ink, accent] = [colour("--ink"), colour("--accent")];
    const tall = box.height / PANELS.length;
    const [left, right] = [52, box.width - 12];
    const x = (t: number) => left + ((t - this.from) / (this.to - this.from)) * (right - left);
    c.font = "13px system-ui, sans-serif";
    PANELS.forEach((panel, at) => {
      const top = at * tall + 22;
      const bottom = (at + 1) * tall - 14;
      const known = this.lines.filter((l) => l.t <= now && panel.of(l)[0] !== null);
      let [low, high] = panel.least;
      // The estimates of the first seconds may have any value.
      for (const line of known.slice(Math.floor(known.length / 4))) {
        const value = panel.of(line)[0] as number;
        low = Math.min(low, value * 1.1);
        high = Math.max(high, value * 1.1);
      }
      const y = (v: number) => bottom - ((Math.max(low, Math.min(high, v)) - low) / (high - low)) * (bottom - top);
      c.fillStyle = ink;
      c.globalAlpha = 1;
      const seen = this.lines.filter((l) => l.t <= now);
      const newest = seen[seen.length - 1];
      const words = newest ? panel.waiting?.(newest) : null;
      const last = known[known.length - 1];
      const [value, error] = last ? panel.of(last) : [null, null];
      const told = words ? `: ${words}` : value === null ? "" : `  ${value.toFixed(2)}${error === null ? "" : ` ± ${error.toFixed(2)}`}`;
      c.fillText(panel.title + told, left, top - 8);
      c.globalAlpha = 0.7;
      c.fillText(high.toPrecision(2), 4, top + 10);
      c.fillText(low.toPrecision(2), 4, bottom);
      c.strokeStyle = ink;
      c.lineWidth = 1;
      c.globalAlpha = 0.25;
      c.strokeRect(left, top, right - left, bottom - top);
      c.save();
      c.beginPath();
      c.rect(left, top, right - left, bottom - top);
      c.clip();
      c.fillStyle = accent;
      c.globalAlpha = 0.25;
      c.beginPath();
      known.forEach((l, k) => {
        const [v, se] = panel.of(l) as [number, number | null];
        const put = y(v + 2 * (se ?? 0));
        if (k === 0) c.moveTo(x(l.t), put);
        else c.lineTo(x(l.t), put);
      });
      for (const l of [...known].reverse()) {
        const [v, se] = panel.of(l) as [number, number | null];
        c.lineTo(x(l.t), y(v - 2 * (se ?? 0)));
      }
      c.fill();
      c.globalAlpha = 1;
      c.strokeStyle = accent;
      c.lineWidth = 2;
      c.beginPath();
      known.forEach((l, k) => {
        const put = y(panel.of(l)[0] as number);
        if (k === 0) c.moveTo(x(l.t), put);
        else c.lineTo(x(l.t), put);
      });
      c.stroke();
      c.strokeStyle = ink;
      c.setLineDash([5, 4]);
      for (const change of this.changes.filter((t) => t <= now)) {
        c.beginPath();
        c.moveTo(x(change), top);
        c.lineTo(x(change), bottom);
        c.stroke();
      }
      c.setLineDash([]);
      c.restore();
      c.globalAlpha = 1;
    });
    c.fillStyle = ink;
    c.globalAlpha = 0.7;
    c.fillText(`${this.from.toFixed(0)} s`, left, box.height - 1);
    const end = `${this.to.toFixed(0)} s`;
    c.fillText(end, right - c.measureText(end).width, box.height - 1);
  }
}
