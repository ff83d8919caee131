// A record on the screen: pause, place, speed, end. Whoever has control handles it; all others see where it is.

import { clock, fixed, isNumber } from "../units.js";
import { byId, element, setText } from "./elements.js";

const SPEEDS = [0.25, 0.5, 1, 2, 4, 8];
const SLOWER = 0.85; // share of the speed asked for, below which it is said
const SEEK_MS = 100; // at most one place asked for in this time, while the bar is drawn
const SETTLE_MS = 400; // in which the bar stays where it was put, until the server has heard of it

export class Player {
  constructor({ store, send }) {
    Object.assign(this, { store, send, touched: -Infinity, timer: null });
    this.bar = byId("player-at");
    byId("player-speed").append(...SPEEDS.map((speed) => element("option", { value: String(speed) }, `${speed}×`)));
    byId("player-speed").addEventListener("change", (event) => this.set({ speed: Number(event.target.value) }));
    byId("play").addEventListener("click", () => this.set({ paused: !store.state?.replay?.paused }));
    byId("replay-end").addEventListener("click", () => send({ type: "replay_stop" }));
    this.bar.addEventListener("input", () => this.seek());
    for (const type of ["control", "connection", "state"]) store.on(type, () => this.show());
  }

  set(what) {
    this.send({ type: "replay_set", ...what });
  }

  seek() {
    this.touched = performance.now();
    this.timer ??= setTimeout(() => {
      this.timer = null;
      this.touched = performance.now();
      this.set({ at: Number(this.bar.value) });
    }, SEEK_MS);
  }

  show() {
    const replay = this.store.isReplaying ? this.store.state.replay : null;
    byId("player").hidden = !replay;
    if (!replay) return;
    const { you, operator } = this.store.control;
    for (const id of ["play", "player-at", "player-speed", "replay-end"]) byId(id).disabled = !you;
    this.showPlace(replay);
    setText(byId("play"), !replay.paused ? "Pause" : isOver(replay) ? "Again" : "Play");
    const speed = String(replay.speed);
    if (document.activeElement !== byId("player-speed")) byId("player-speed").value = speed;
    const handled = you ? "" : operator ? ` · ${operator} handles it` : " · take control to handle it";
    setText(byId("player-name"), `${replay.name}${speedNote(replay)}${handled}`);
  }

  showPlace(replay) {
    this.bar.max = String(replay.span || 1);
    if (performance.now() - this.touched > SETTLE_MS) this.bar.value = String(replay.at);
    byId("player").style.setProperty("--known", `${(100 * replay.known) / (replay.span || 1)}%`);
    setText(byId("player-time"), `${clock(Number(this.bar.value))} of ${clock(replay.span)}`);
  }
}

const isOver = ({ at, span }) => at >= span - 1e-6;

/** Why it is not where or not as fast as it was asked to be. */
function speedNote({ at, known, pace, speed }) {
  if (at > known + 0.1) return " · computing up to there …";
  return isNumber(pace) && pace < SLOWER * speed && known < at + 1 ? ` · at ${fixed(pace, 1)}×: it is computed no faster` : "";
}
