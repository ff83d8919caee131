// Joins keys, buttons and gamepad into one wish and sends it fifty times a second while something is held. The server
// stops by itself when these messages stop coming; one neutral message tells it at once.

import { clamp } from "../units.js";

export const PERIOD_MS = 20;
const AXES = ["insertion", "rotation", "tension"];

export class Jog {
  /** `sources`: things with read() and halt(). `maySteer()`: whether this page is the operator and live. */
  constructor({ sources, send, maySteer, onHalt }) {
    Object.assign(this, { sources, send, maySteer, onHalt, seq: 0, isMoving: false, ticked: 0 });
    this.timer = setInterval(() => this.tick(), PERIOD_MS);
  }

  read() {
    const wishes = this.sources.map((source) => source.read());
    const wish = { hold: wishes.some((one) => one.hold) };
    for (const axis of AXES) wish[axis] = clamp(wishes.reduce((sum, one) => sum + (one.hold ? one[axis] : 0), 0), -1, 1);
    return wish;
  }

  tickIfDue() {
    if (performance.now() - this.ticked > PERIOD_MS - 5) this.tick();
  }

  tick() {
    this.ticked = performance.now();
    const wish = this.read();
    if (wish.hold && this.maySteer()) this.say(wish);
    else this.rest();
  }

  say(wish) {
    this.seq += 1;
    const was = this.isMoving;
    this.isMoving = this.send({ type: "jog", seq: this.seq, ...wish });
    if (was && !this.isMoving) this.halt("The connection is lost");
  }

  rest() {
    if (!this.isMoving) return;
    this.isMoving = false;
    this.seq += 1;
    this.send({ type: "jog", seq: this.seq, insertion: 0, rotation: 0, tension: 0, hold: false });
  }

  /** Stops now and forgets what is held: each key, button or stick must be let go and pressed anew. */
  halt(reason) {
    const wasHeld = this.isMoving;
    for (const source of this.sources) source.halt();
    this.rest();
    this.onHalt(reason, wasHeld);
  }
}
