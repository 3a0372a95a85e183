// A run: it receives events, computes ticks and logs both. It does not depend on a browser: the caller passes
// the times, in ms from tick 0, so that a test can choose them.
//
// Tick k is computed at the first call at or after k ms, with the last event whose time stamp is not later. An
// event that arrives after its tick was computed belongs to the next tick. The log contains the tick at which
// each event took effect, so that the run can be recomputed.

import { type InputMap, type Plant, inputOf, output, rawOf, step } from "./plant";

export interface Phase extends Plant {
  from: number;
}

export interface Task {
  run_in: number;
  ticks: number;
  phases: Phase[];
  target: Float64Array;
  disturbance: Float64Array;
}

/** Tick, time stamp, time at the handler, value of the device. */
export type EventRow = [number, number, number, number];
/** Time of the frame, time of drawing, tick, e as shown. */
export type FrameRow = [number, number, number, number];

export interface Batch {
  first: number;
  u: number[];
  e: number[];
  events: EventRow[];
  frames: FrameRow[];
}

export class Run {
  /** The next tick to be computed. */
  next = 0;
  /** Values at the last tick. */
  e = 0;
  y = 0;
  u = 0;
  private readonly x: Float64Array;
  private readonly spare: Float64Array;
  private phase = 0;
  private lastTick = 0;
  private queue: EventRow[] = [];
  private batch: Batch = { first: 0, u: [], e: [], events: [], frames: [] };

  constructor(
    readonly task: Task,
    readonly map: InputMap,
  ) {
    const order = task.phases[0].b.length;
    this.x = new Float64Array(order);
    this.spare = new Float64Array(order);
  }

  get done(): boolean {
    return this.next >= this.task.ticks;
  }

  /** Accepts an event of the device. */
  input(stamp: number, handled: number, raw: number): void {
    const tick = Math.max(0, Math.ceil(stamp), this.next, this.lastTick);
    if (tick >= this.task.ticks || !Number.isFinite(raw)) return;
    this.lastTick = tick;
    const row: EventRow = [tick, stamp, Math.max(handled, stamp), raw];
    this.queue.push(row);
    this.batch.events.push(row);
  }

  /** Computes all ticks up to a time. */
  advance(now: number): void {
    const { task, batch } = this;
    const end = Math.min(Math.floor(now), task.ticks - 1);
    for (; this.next <= end; this.next++) {
      const k = this.next;
      while (this.queue.length > 0 && this.queue[0][0] <= k) {
        this.u = inputOf(this.map, (this.queue.shift() as EventRow)[3]);
      }
      const following = task.phases[this.phase + 1];
      if (following !== undefined && following.from <= k) this.phase++;
      const plant = task.phases[this.phase];
      const v = this.u + task.disturbance[k];
      this.y = output(plant, this.x, v);
      this.e = task.target[k] - this.y;
      step(plant, this.x, v, this.spare);
      batch.u.push(this.u);
      batch.e.push(this.e);
    }
  }

  /** Logs that a frame with the last tick was drawn. */
  frame(time: number, drawn: number): void {
    this.batch.frames.push([time, drawn, this.next - 1, this.e]);
  }

  /** Returns the ticks, events and frames since the last call. */
  take(): Batch {
    const taken = this.batch;
    this.batch = { first: this.next, u: [], e: [], events: [], frames: [] };
    return taken;
  }
}

export interface SimulatedOperator {
  plant: Plant;
  delay: number;
}

/** A simulated operator: u = (H e)(t - delay) + n, where e is the error on the screen. */
export class Operator {
  private readonly x: Float64Array;
  private readonly spare: Float64Array;
  private readonly answers: number[] = [];
  private e = 0;

  constructor(
    private readonly own: SimulatedOperator,
    private readonly noise: Float64Array,
    private readonly map: InputMap,
  ) {
    this.x = new Float64Array(own.plant.b.length);
    this.spare = new Float64Array(own.plant.b.length);
  }

  /** Sets the error that the screen shows from a time on; the response until then is to the previous error. */
  sees(e: number, at: number): void {
    this.upTo(at);
    this.e = e;
  }

  /** Returns the position of the device at a time. */
  raw(now: number): number {
    this.upTo(now);
    const k = Math.max(0, Math.floor(now));
    const answer = this.answers[k - this.own.delay] ?? 0;
    return rawOf(this.map, answer + (this.noise[Math.min(k, this.noise.length - 1)] ?? 0));
  }

  private upTo(now: number): void {
    while (this.answers.length < now) {
      this.answers.push(output(this.own.plant, this.x, this.e));
      step(this.own.plant, this.x, this.e, this.spare);
    }
  }
}

export { inputOf, output, rawOf, step };
export type { InputMap, Plant };
