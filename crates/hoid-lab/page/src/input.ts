// The devices: pointers send events with time stamps; gamepads are polled at each frame.

import type { InputMap } from "./engine";
import { time } from "./time";

export type Device = "mouse" | "pen" | "touch" | "gamepad";
export const DEVICES: [Device, string][] = [
  ["mouse", "Mouse or touchpad"],
  ["touch", "Finger on the screen"],
  ["pen", "Pen"],
  ["gamepad", "Gamepad or joystick"],
];

export interface Settings {
  device: Device;
  sensitivity: number;
  reversed: boolean;
  dead: number;
}

const KEY = "hoid-lab-settings";

export function settings(): Settings {
  const usual: Settings = { device: "mouse", sensitivity: 1, reversed: false, dead: 0 };
  if (matchMedia("(pointer: coarse)").matches) usual.device = "touch";
  try {
    return { ...usual, ...JSON.parse(localStorage.getItem(KEY) ?? "{}") };
  } catch {
    return usual;
  }
}

export function keep(own: Settings): void {
  try {
    localStorage.setItem(KEY, JSON.stringify(own));
  } catch {
    // A browser without storage asks again next time.
  }
}

/** Map for a surface: its middle is zero, and two fifths of its width are the full deflection. */
export function mapOf(own: Settings, surface: DOMRect, full: number): InputMap {
  const gain = full * (own.reversed ? -1 : 1);
  if (own.device === "gamepad") return { centre: 0, span: 1 / own.sensitivity, dead: own.dead, gain };
  const reach = Math.min(surface.width, 1000);
  return { centre: surface.left + surface.width / 2, span: (0.4 * reach) / own.sensitivity, dead: own.dead, gain };
}

export interface Taken {
  stamp: number;
  raw: number;
  synthetic: boolean;
}

/** Listens to a device until it is stopped. */
export function listen(surface: HTMLElement, device: Device, take: (event: Taken) => void): () => void {
  if (device === "gamepad") return watchGamepad(take);
  const kinds = device === "mouse" ? ["mouse"] : [device];
  const raw = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";
  const one = (event: PointerEvent) => take({ stamp: time.stamp(event), raw: event.clientX, synthetic: !event.isTrusted });
  const heard = (e: Event) => {
    const event = e as PointerEvent;
    if (!kinds.includes(event.pointerType)) return;
    const all = event.getCoalescedEvents?.() ?? [];
    if (all.length > 0) all.forEach(one);
    else one(event);
  };
  const options = { passive: true };
  surface.addEventListener(raw, heard, options);
  surface.addEventListener("pointerdown", heard, options);
  return () => {
    surface.removeEventListener(raw, heard);
    surface.removeEventListener("pointerdown", heard);
  };
}

function watchGamepad(take: (event: Taken) => void): () => void {
  let going = true;
  let last = NaN;
  const look = () => {
    if (!going) return;
    const pad = [...navigator.getGamepads()].find((pad) => pad !== null);
    const raw = pad?.axes[0];
    if (pad && raw !== undefined && raw !== last) {
      last = raw;
      // The time stamp of a gamepad is that of its last report, if the browser provides it.
      const now = time.now();
      const stamp = time.clock === "browser" && pad.timestamp > now - 100 && pad.timestamp <= now ? pad.timestamp : now;
      take({ stamp, raw, synthetic: false });
    }
    time.frame(look);
  };
  look();
  return () => {
    going = false;
  };
}
