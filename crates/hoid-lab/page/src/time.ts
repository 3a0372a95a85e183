// The clock and the frames. A test may replace them before the page is loaded; the runs then state it.

export interface Time {
  clock: "browser" | "injected";
  now(): number;
  frame(each: (time: number) => void): void;
  stamp(event: Event): number;
}

const given = (globalThis as { hoidTime?: Time }).hoidTime;

export const time: Time = given ?? {
  clock: "browser",
  now: () => performance.now(),
  frame: (each) => requestAnimationFrame(each),
  stamp: (event) => event.timeStamp,
};
