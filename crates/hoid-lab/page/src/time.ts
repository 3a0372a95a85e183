// The clock and the frames. A test may give its own before the page is loaded: then runs say so.

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
