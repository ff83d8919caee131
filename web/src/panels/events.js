// What happened, newest first.

import { capital, clock } from "../units.js";
import { element } from "./elements.js";

const MOST = 60;

export class Events {
  constructor(list, onEvent) {
    Object.assign(this, { list, onEvent });
  }

  /** time: s of the session, or from the beginning of the record where it happened in one (inRecord). ago: s since then. */
  add(text, severity = "info", time = null, { ago = 0, inRecord = false } = {}) {
    this.onEvent(severity, text, ago);
    if (this.repeats(text)) return;
    const stamp = element("time", {}, time === null ? "" : `${inRecord ? "▸" : ""}${clock(time)}`);
    if (inRecord) stamp.title = "In the record that is shown, from its beginning";
    this.newest = { text, count: 1, row: element("li", {}, stamp, element("span", {}, capital(text))) };
    this.newest.row.dataset.severity = severity;
    this.list.prepend(this.newest.row);
    while (this.list.children.length > MOST) this.list.lastChild.remove();
  }

  /** The same again is counted, not listed. */
  repeats(text) {
    if (this.newest?.text !== text) return false;
    this.newest.count += 1;
    this.newest.row.lastChild.textContent = `${capital(text)} (${this.newest.count} times)`;
    return true;
  }
}
