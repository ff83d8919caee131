// Warnings in plain sentences over the view. Read aloud once when they appear, not at each change of a number.

import { capital } from "../units.js";
import { element, setText } from "./elements.js";

const HELD_MS = 1000; // that a limit must be kept for, before the banner goes: a noisy one must not flicker
const RANK = { limit: 0, warning: 1, info: 2 };

export class Warnings {
  constructor(banner, list) {
    Object.assign(this, { banner, list, rows: new Map(), known: "" });
  }

  update(state, lost = "") {
    const notes = lost ? [] : collect(state);
    this.showBanner(lost, state);
    for (const [code, row] of this.rows) if (!notes.some((note) => note.code === code)) this.drop(code, row);
    for (const note of notes) this.show(note);
  }

  showBanner(lost, state) {
    if (state?.in_range === false) this.outside = performance.now();
    const isOutside = state && performance.now() - (this.outside ?? -Infinity) < HELD_MS;
    const text = lost || (isOutside ? "Outside the model’s range: shape and forces are not to be trusted." : "");
    this.banner.hidden = !text;
    this.banner.dataset.kind = lost ? "lost" : "range";
    this.banner.setAttribute("role", "alert");
    setText(this.banner, text);
  }

  show({ code, text, severity }) {
    const row = this.rows.get(code) ?? this.add(code);
    row.dataset.severity = severity;
    setText(row, capital(text));
    row.title = capital(text); // where there is room for its beginning only
  }

  add(code) {
    const row = element("p", { className: "warning" });
    this.rows.set(code, row);
    this.list.append(row);
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
  return [...blocked, ...warnings].slice(0, 4);
}
