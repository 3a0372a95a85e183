// The arithmetic of a tick, with the same operations as plant.rs. Doubles of ECMAScript and Rust are the same,
// both round products before they add them, and no other operations are used.

export interface Plant {
  a: number[];
  b: number[];
  c: number[];
  d: number;
}

export interface InputMap {
  centre: number;
  span: number;
  dead: number;
  gain: number;
}

export function output(p: Plant, x: Float64Array, v: number): number {
  let y = 0;
  for (let i = 0; i < p.b.length; i++) y += p.c[i] * x[i];
  return y + p.d * v;
}

/** Computes the state at the next tick; `next` has the length of `x`. */
export function step(p: Plant, x: Float64Array, v: number, next: Float64Array): void {
  const n = p.b.length;
  for (let i = 0; i < n; i++) {
    let sum = 0;
    for (let j = 0; j < n; j++) sum += p.a[i * n + j] * x[j];
    next[i] = sum + p.b[i] * v;
  }
  x.set(next);
}

export function inputOf(map: InputMap, raw: number): number {
  let w = (raw - map.centre) / map.span;
  if (w > 1) w = 1;
  if (w < -1) w = -1;
  const size = w < 0 ? -w : w;
  if (size <= map.dead) return 0;
  const moved = (size - map.dead) / (1 - map.dead);
  return w < 0 ? -(map.gain * moved) : map.gain * moved;
}

/** Returns the value of the device for a u, for simulated operators. */
export function rawOf(map: InputMap, u: number): number {
  let w = u / map.gain;
  if (w > 1) w = 1;
  if (w < -1) w = -1;
  const size = w < 0 ? -w : w;
  const moved = size === 0 ? 0 : map.dead + size * (1 - map.dead);
  return map.centre + (w < 0 ? -moved : moved) * map.span;
}
