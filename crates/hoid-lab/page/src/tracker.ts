// The tracker of hoid in WebAssembly, by its C ABI (hoid.h), with the sizes and offsets for 32-bit pointers.

import type { Told } from "./wire";

/** Sample time, s: every tenth tick. */
export const SAMPLE_S = 0.01;

interface Exports {
  memory: WebAssembly.Memory;
  hoid_tracker_new(method: number, sampleTime: number, options: number, tracker: number): number;
  hoid_tracker_free(tracker: number): void;
  hoid_tracker_step(tracker: number, e: number, u: number, outcome: number): number;
  hoid_tracker_operator(tracker: number, estimates: number, room: number, count: number): number;
  hoid_tracker_open_loop(tracker: number, estimates: number, room: number, count: number): number;
  hoid_tracker_change(tracker: number, change: number): number;
  hoid_last_error(): number;
}

const PAGE = 65536;
/** Size of hoid_estimate, and offsets of its value and standard error. */
const [SIZE, VALUE, ERROR] = [32, 8, 16];
/** Offsets in our page of memory: a pointer, a number, an outcome, then lists and texts. */
const [POINTER, COUNT, OUTCOME, LIST] = [0, 8, 16, 64];
/** K_e, T_L, K_e_dot, omega_nm, zeta_nm, tau_e; crossover frequency, phase margin. */
const [OPERATOR, OPEN_LOOP] = [6, 2];

export interface Estimates {
  operator: Told[];
  openLoop: Told[];
  /** Reason why there is no operator. */
  waiting: string | null;
}

export class Kernel {
  /** A page of memory that the library does not use. */
  readonly room: number;

  private constructor(readonly hoid: Exports) {
    this.room = hoid.memory.grow(1) * PAGE;
  }

  static async of(bytes: BufferSource): Promise<Kernel> {
    const module = await WebAssembly.compile(bytes);
    // A library for random numbers imports functions that are never called.
    const imports: WebAssembly.Imports = {};
    for (const { module: from, name } of WebAssembly.Module.imports(module)) {
      (imports[from] ??= {})[name] = () => {
        throw new Error(`${from}.${name} was called`);
      };
    }
    return new Kernel((await WebAssembly.instantiate(module, imports)).exports as unknown as Exports);
  }

  view(): DataView {
    return new DataView(this.hoid.memory.buffer);
  }

  /** Writes a text into the memory for lists. */
  put(text: string): number {
    const bytes = new TextEncoder().encode(`${text}\0`);
    if (LIST + bytes.length > PAGE) throw new Error("a text is too long");
    new Uint8Array(this.hoid.memory.buffer).set(bytes, this.room + LIST);
    return this.room + LIST;
  }

  reason(): string {
    const bytes = new Uint8Array(this.hoid.memory.buffer, this.hoid.hoid_last_error());
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }
}

/** One run: the population prior, no warm-up. */
export class Tracker {
  private readonly tracker: number;

  /** `element`: the controlled element in s, if it does not change. */
  constructor(
    private readonly kernel: Kernel,
    element: string | null,
  ) {
    const { hoid, room } = kernel;
    const options = kernel.put(JSON.stringify(element === null ? {} : { controlled_element: element }));
    if (hoid.hoid_tracker_new(0, SAMPLE_S, options, room + POINTER) !== 0) throw new Error(kernel.reason());
    this.tracker = kernel.view().getUint32(room + POINTER, true);
  }

  /** Processes a sample; returns the time since a change of the person in s, if one is declared at this sample. */
  step(e: number, u: number): number | null {
    const { hoid, room } = this.kernel;
    if (hoid.hoid_tracker_step(this.tracker, e, u, room + OUTCOME) !== 0) throw new Error(this.kernel.reason());
    if (hoid.hoid_tracker_change(this.tracker, room + LIST) !== 0) return null;
    return this.kernel.view().getFloat64(room + LIST, true);
  }

  estimates(): Estimates {
    const { hoid, room } = this.kernel;
    const [list, count] = [room + LIST, room + COUNT];
    const known = hoid.hoid_tracker_operator(this.tracker, list, OPERATOR, count) === 0;
    const waiting = known ? null : this.kernel.reason();
    const operator = this.told(OPERATOR, known);
    const crosses = hoid.hoid_tracker_open_loop(this.tracker, list, OPEN_LOOP, count) === 0;
    return { operator, openLoop: this.told(OPEN_LOOP, crosses), waiting };
  }

  free(): void {
    this.kernel.hoid.hoid_tracker_free(this.tracker);
  }

  private told(n: number, known: boolean): Told[] {
    const view = this.kernel.view();
    const finite = (at: number) => {
      const value = view.getFloat64(at, true);
      return known && Number.isFinite(value) ? value : null;
    };
    const first = this.kernel.room + LIST;
    return Array.from({ length: n }, (_, k) => [finite(first + k * SIZE + VALUE), finite(first + k * SIZE + ERROR)]);
  }
}
