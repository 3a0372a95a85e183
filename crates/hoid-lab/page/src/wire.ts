// Messages between page and server, as in wire.rs. A `Wire` connects the page to the side that runs the experiment.

import type { Batch, InputMap, Phase, SimulatedOperator } from "./engine";

export interface Condition {
  name: string;
  text: string;
  display: "compensatory" | "pursuit" | "preview";
  half_width: number;
  preview_s: number;
  full_deflection: number;
  break_s: number;
}

export interface Done {
  number: number;
  condition: string;
  training: boolean;
  how: "finished" | "interrupted";
  verdict: "verified" | "unverified";
  reasons: string;
  notes: string;
  rms_e: number;
  score: number;
}

export interface Measures {
  frames: number;
  frame_ms: number;
  longest_frame_ms: number;
  missed_frames: number;
  input_hz: number;
  input_age_ms: number;
}

export interface State {
  type: "state";
  phase: "consent" | "runs" | "finished" | "replay";
  name: string;
  consent: string;
  live: "after" | "during" | "never";
  calibrate: boolean;
  session: string | null;
  open: string[];
  done: Done[];
  planned: string[];
  next: number | null;
  condition: Condition | null;
  training: boolean;
  running: number | null;
  reporting: boolean;
  reports: [string, string][];
  calibration: [string, string][];
}

export interface RunMessage {
  type: "run";
  number: number;
  condition: Condition;
  training: boolean;
  run_in: number;
  ticks: number;
  phases: Phase[];
  tables: [number, number, number];
  operator: SimulatedOperator | null;
}

export type Told = [number | null, number | null];

export interface LiveLine {
  t: number;
  gain: Told;
  lead_s: Told;
  lag_s: Told;
  lag_waiting: string | null;
  omega_nm_rad_s: Told;
  delay_s: Told;
  crossover_rad_s: Told;
  phase_margin_deg: Told;
  changed_s: number | null;
  waiting: string | null;
}

export type FromServer =
  | State
  | RunMessage
  | { type: "verdict"; done: Done; measures: Measures }
  | { type: "live"; number: number; line: LiveLine }
  | { type: "refused"; words: string; elsewhere: boolean }
  | { type: "yours" };

export type FromPage =
  | { type: "hello"; role: "person" | "experimenter"; browser: Record<string, string> }
  | { type: "consent"; subject: string; agreed: boolean; cc0: boolean }
  | { type: "resume"; session: string }
  | { type: "next" }
  | {
      type: "begin";
      number: number;
      input: InputMap;
      device: string;
      clock: string;
      refresh_ms: number;
      zero_ms: number;
    }
  | { type: "batch"; number: number; batch: Batch }
  | { type: "finish"; number: number; counted: Record<string, number> }
  | { type: "abort"; number: number }
  | { type: "reports" };

/** A finished run at 100 Hz. */
export interface RunData {
  number: number;
  condition: Condition;
  start_s: number;
  step_s: number;
  e: number[];
  u: number[];
  y: number[];
  f: number[] | null;
  live: LiveLine[];
  verdict: string;
  reasons: string;
}

/** Messages from a wire to the page. */
export interface Listener {
  hear(message: FromServer): void;
  /** Target, disturbance and noise of the last announced run. */
  tables(numbers: Float64Array): void;
  gone(): void;
}

/** The side that runs the experiment, as seen by the page. */
export interface Wire {
  /** True if the page runs without the program: nothing is stored, and there are no other windows. */
  readonly alone: boolean;
  say(message: FromPage): void;
  data(number: number): Promise<RunData | null>;
  /** Files of the session that can be saved. */
  takeHome(state: State): HTMLElement;
}
