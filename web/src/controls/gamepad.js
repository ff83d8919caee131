// A gamepad as a source of motion. A pad that vanishes may leave its last axis values behind (seen: insertion ran on to
// its stop), so after a loss, a stop or a new pad nothing moves until the pad has been seen at rest.

import { clamp } from "../units.js";

const DEADZONE = 0.15;
const HOLD = [4, 5]; // shoulder buttons of the standard mapping
const RELEASE = 6; // left trigger
const PULL = 7; // right trigger
const NONE = { insertion: 0, rotation: 0, tension: 0, hold: false };

/** Zero inside the dead zone, then rising from zero, so that there is no jump at its edge. */
export function curved(value) {
  const beyond = Math.abs(value) - DEADZONE;
  return Number.isFinite(value) && beyond > 0 ? (Math.sign(value) * Math.min(1, beyond)) / (1 - DEADZONE) : 0;
}

/** What a pad of the standard mapping asks for; hold only where a shoulder button is down. */
export function readPad(pad) {
  const axis = (index) => curved(pad.axes[index] ?? 0);
  const button = (index) => curved(pad.buttons[index]?.value ?? 0);
  return {
    insertion: clamp(-axis(1), -1, 1) || 0,
    rotation: axis(0),
    tension: clamp(-axis(3) + button(PULL) - button(RELEASE), -1, 1) || 0,
    hold: HOLD.some((index) => pad.buttons[index]?.pressed),
  };
}

const isAtRest = (wish) => !wish.hold && !wish.insertion && !wish.rotation && !wish.tension;

export class Gamepads {
  /** `onLost()` is called when the pad that was in use is gone. */
  constructor({ onLost, pads = () => navigator.getGamepads?.() ?? [] }) {
    Object.assign(this, { onLost, pads, id: null, isNeutralSeen: false });
    window.addEventListener("gamepaddisconnected", () => this.read());
  }

  find() {
    const all = [...this.pads()].filter((pad) => pad?.connected);
    return all.find((pad) => this.key(pad) === this.id) ?? (this.id === null ? all[0] : null) ?? null;
  }

  key(pad) {
    return `${pad.index}:${pad.id}`;
  }

  lose() {
    this.id = null;
    this.isNeutralSeen = false;
    this.onLost();
  }

  halt() {
    this.isNeutralSeen = false;
  }

  read() {
    const pad = this.find();
    if (!pad) {
      if (this.id !== null) this.lose();
      return NONE;
    }
    this.id = this.key(pad);
    const wish = readPad(pad);
    if (isAtRest(wish)) this.isNeutralSeen = true;
    return this.isNeutralSeen ? wish : NONE;
  }

  /** One line for the settings: which pad, and what it waits for. */
  describe() {
    if (this.id === null) return "No gamepad seen. Press one of its buttons.";
    const name = this.id.split(":").slice(1).join(":").replace(/\s*\(.*\)$/, "");
    return this.isNeutralSeen ? `${name}: ready.` : `${name}: let go of all sticks and buttons first.`;
  }
}
