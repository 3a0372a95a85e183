// The task on a canvas. The middle of the canvas is zero; positive values are to the right.

import { colour } from "./dom";
import type { Condition } from "./wire";

export interface Shown {
  e: number;
  y: number;
  f: number;
  /** The target at the current and the following ticks, for previews. */
  ahead: (ticks: number) => number;
}

export class Surface {
  private readonly context: CanvasRenderingContext2D;
  private width = 0;
  private height = 0;
  private readonly colours: { ink: string; soft: string; line: string; accent: string; paper: string };

  constructor(readonly canvas: HTMLCanvasElement) {
    const context = canvas.getContext("2d", { alpha: false, desynchronized: true });
    if (!context) throw new Error("this browser cannot draw");
    this.context = context;
    this.colours = { ink: colour("--ink"), soft: colour("--soft"), line: colour("--line"), accent: colour("--accent"), paper: colour("--paper") };
    this.fit();
  }

  /** Sets the resolution of the canvas to that of the screen. */
  fit(): void {
    const box = this.canvas.getBoundingClientRect();
    const ratio = devicePixelRatio || 1;
    this.width = box.width;
    this.height = box.height;
    this.canvas.width = Math.max(1, Math.round(box.width * ratio));
    this.canvas.height = Math.max(1, Math.round(box.height * ratio));
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
  }

  private line(x0: number, y0: number, x1: number, y1: number, colour: string, thick: number): void {
    const c = this.context;
    c.strokeStyle = colour;
    c.lineWidth = thick;
    c.beginPath();
    c.moveTo(x0, y0);
    c.lineTo(x1, y1);
    c.stroke();
  }

  private ring(x: number, y: number): void {
    const c = this.context;
    c.strokeStyle = this.colours.accent;
    c.lineWidth = 4;
    c.beginPath();
    c.arc(x, y, 14, 0, 2 * Math.PI);
    c.stroke();
  }

  task(condition: Condition, shown: Shown): void {
    const { context: c, width, height, colours } = this;
    c.fillStyle = colours.paper;
    c.fillRect(0, 0, width, height);
    const middle = height / 2;
    const place = (v: number) => {
      const part = Math.max(-1.05, Math.min(1.05, v / condition.half_width));
      return width / 2 + part * (width / 2 - 20);
    };
    this.line(0, middle, width, middle, colours.line, 1);
    this.line(width / 2, middle - 12, width / 2, middle + 12, colours.line, 1);
    const tall = Math.min(90, height / 5);
    if (condition.display === "compensatory") {
      this.line(place(shown.e), middle - tall, place(shown.e), middle + tall, colours.ink, 4);
      this.ring(width / 2, middle);
      return;
    }
    if (condition.display === "preview") {
      const ticks = Math.round(condition.preview_s * 1000);
      const top = height * 0.08;
      c.strokeStyle = colours.ink;
      c.lineWidth = 4;
      c.beginPath();
      for (let k = 0; k <= ticks; k += 10) {
        const x = place(shown.ahead(k));
        const y = middle - ((middle - top) * k) / ticks;
        if (k === 0) c.moveTo(x, y);
        else c.lineTo(x, y);
      }
      c.stroke();
    } else {
      this.line(place(shown.f), middle - tall, place(shown.f), middle + tall, colours.ink, 4);
    }
    this.ring(place(shown.y), middle);
  }

  /** Draws the bar of the settings; the position of the hand is from -1 to 1. */
  hand(part: number): void {
    const { context: c, width, height, colours } = this;
    c.fillStyle = colours.paper;
    c.fillRect(0, 0, width, height);
    const middle = height / 2;
    this.line(20, middle, width - 20, middle, colours.line, 2);
    for (const end of [-1, 0, 1]) {
      const x = width / 2 + end * (width / 2 - 20);
      this.line(x, middle - 10, x, middle + 10, colours.soft, 2);
    }
    this.ring(width / 2 + part * (width / 2 - 20), middle);
  }
}
