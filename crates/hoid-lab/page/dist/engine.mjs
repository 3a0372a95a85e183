// src/plant.ts
function output(p, x, v) {
  let y = 0;
  for (let i = 0; i < p.b.length; i++) y += p.c[i] * x[i];
  return y + p.d * v;
}
function step(p, x, v, next) {
  const n = p.b.length;
  for (let i = 0; i < n; i++) {
    let sum = 0;
    for (let j = 0; j < n; j++) sum += p.a[i * n + j] * x[j];
    next[i] = sum + p.b[i] * v;
  }
  x.set(next);
}
function inputOf(map, raw) {
  let w = (raw - map.centre) / map.span;
  if (w > 1) w = 1;
  if (w < -1) w = -1;
  const size = w < 0 ? -w : w;
  if (size <= map.dead) return 0;
  const moved = (size - map.dead) / (1 - map.dead);
  return w < 0 ? -(map.gain * moved) : map.gain * moved;
}
function rawOf(map, u) {
  let w = u / map.gain;
  if (w > 1) w = 1;
  if (w < -1) w = -1;
  const size = w < 0 ? -w : w;
  const moved = size === 0 ? 0 : map.dead + size * (1 - map.dead);
  return map.centre + (w < 0 ? -moved : moved) * map.span;
}

// src/engine.ts
var Run = class {
  constructor(task, map) {
    this.task = task;
    this.map = map;
    const order = task.phases[0].b.length;
    this.x = new Float64Array(order);
    this.spare = new Float64Array(order);
  }
  task;
  map;
  /** The next tick to be computed. */
  next = 0;
  /** Values at the last tick. */
  e = 0;
  y = 0;
  u = 0;
  x;
  spare;
  phase = 0;
  lastTick = 0;
  queue = [];
  batch = { first: 0, u: [], e: [], events: [], frames: [] };
  get done() {
    return this.next >= this.task.ticks;
  }
  /** Accepts an event of the device. */
  input(stamp, handled, raw) {
    const tick = Math.max(0, Math.ceil(stamp), this.next, this.lastTick);
    if (tick >= this.task.ticks || !Number.isFinite(raw)) return;
    this.lastTick = tick;
    const row = [tick, stamp, Math.max(handled, stamp), raw];
    this.queue.push(row);
    this.batch.events.push(row);
  }
  /** Computes all ticks up to a time. */
  advance(now) {
    const { task, batch } = this;
    const end = Math.min(Math.floor(now), task.ticks - 1);
    for (; this.next <= end; this.next++) {
      const k = this.next;
      while (this.queue.length > 0 && this.queue[0][0] <= k) {
        this.u = inputOf(this.map, this.queue.shift()[3]);
      }
      const following = task.phases[this.phase + 1];
      if (following !== void 0 && following.from <= k) this.phase++;
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
  frame(time, drawn) {
    this.batch.frames.push([time, drawn, this.next - 1, this.e]);
  }
  /** Returns the ticks, events and frames since the last call. */
  take() {
    const taken = this.batch;
    this.batch = { first: this.next, u: [], e: [], events: [], frames: [] };
    return taken;
  }
};
var Operator = class {
  constructor(own, noise, map) {
    this.own = own;
    this.noise = noise;
    this.map = map;
    this.x = new Float64Array(own.plant.b.length);
    this.spare = new Float64Array(own.plant.b.length);
  }
  own;
  noise;
  map;
  x;
  spare;
  answers = [];
  e = 0;
  /** Sets the error that the screen shows from a time on; the response until then is to the previous error. */
  sees(e, at) {
    this.upTo(at);
    this.e = e;
  }
  /** Returns the position of the device at a time. */
  raw(now) {
    this.upTo(now);
    const k = Math.max(0, Math.floor(now));
    const answer = this.answers[k - this.own.delay] ?? 0;
    return rawOf(this.map, answer + (this.noise[Math.min(k, this.noise.length - 1)] ?? 0));
  }
  upTo(now) {
    while (this.answers.length < now) {
      this.answers.push(output(this.own.plant, this.x, this.e));
      step(this.own.plant, this.x, this.e, this.spare);
    }
  }
};
export {
  Operator,
  Run,
  inputOf,
  output,
  rawOf,
  step
};
