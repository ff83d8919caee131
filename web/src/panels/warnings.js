// Warnings in plain sentences over the view. Read aloud once when they appear, not at each change of a number. A jump of
// the robot is told in one state only: it stays in sight long enough to be read.

import { capital } from "../units.js";
import { element, setText } from "./elements.js";

const HELD_MS = 1000; // that a limit must be kept for, before the banner goes: a noisy one must not flicker
const READ_MS = 6000; // that a jump stays in sight
const JUMPED = /^the robot snapped by /; // as the server says it
const MOST = 4;
const RANK = { limit: 0, warning: 1, info: 2 };

export class Warnings {
  constructor(banner, list) {
    Object.assign(this, { banner, list, rows: new Map(), jump: null });
  }

  update(state, lost = "") {
    const notes = lost ? [] : this.keep(collect(state));
    this.showBanner(lost, state);
    for (const [code, row] of this.rows) if (!notes.some((note) => note.code === code)) this.drop(code, row);
    notes.forEach((note, i) => this.show(note, i));
  }

  /** Of every state and event, also of those that are not drawn. */
  hear({ warnings = [], in_range: inRange, text = "" }) {
    if (inRange === false) this.outside = performance.now();
    const jump = warnings.find((note) => note.code === "snap") ?? (JUMPED.test(text) ? { code: "snap", text, severity: "limit" } : null);
    if (jump) Object.assign(this, { jump, jumped: performance.now() });
  }

  /** The notes, and the last jump for as long as it takes to read it. */
  keep(notes) {
    if (this.jump && performance.now() - this.jumped > READ_MS) this.jump = null;
    const others = notes.filter((note) => note.code !== "snap");
    return [...(this.jump ? [this.jump] : []), ...others].slice(0, MOST);
  }

  showBanner(lost, state) {
    const isOutside = state && performance.now() - (this.outside ?? -Infinity) < HELD_MS;
    const text = lost || (isOutside ? "Outside the model’s range: shape and forces are not to be trusted." : "");
    this.banner.hidden = !text;
    this.banner.dataset.kind = lost ? "lost" : "range";
    this.banner.setAttribute("role", "alert");
    setText(this.banner, text);
  }

  show({ code, text, severity }, place) {
    const row = this.rows.get(code) ?? this.add(code);
    if (this.list.children[place] !== row) this.list.insertBefore(row, this.list.children[place]);
    row.dataset.severity = severity;
    setText(row, capital(text));
  }

  add(code) {
    const row = element("p", { className: "warning" });
    row.dataset.code = code;
    this.rows.set(code, row);
    return row;
  }

  drop(code, row) {
    row.remove();
    this.rows.delete(code);
  }
}

function collect(state) {
  const blocked = state?.blocked && !state.fault ? [{ code: "blocked", text: state.blocked, severity: "limit" }] : [];
  const warnings = [...(state?.warnings ?? [])].sort((a, b) => (RANK[a.severity] ?? 3) - (RANK[b.severity] ?? 3));
  return [...blocked, ...warnings];
}
