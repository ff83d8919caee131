// The last minute as a strip chart: insertion, tension, least clearance, and marks where something happened.

import { bodyClearance, fixed, isNumber, least } from "../units.js";
import { fitted } from "./canvas.js";

const SPAN = 60; // s shown
const STEP = 0.1; // s between samples
const GAP = 2; // s without samples over which no line is drawn
const BURST = 5; // s within which the same again is counted
const LEFT = 116; // px for the names
const LANES = [
  { key: "insertion", name: "Insertion", unit: "mm", digits: 1 },
  { key: "tension", name: "Tension", unit: "N", digits: 2 },
  { key: "clearance", name: "Clearance", unit: "mm", digits: 2 },
];

export class Strip {
  constructor(canvas) {
    Object.assign(this, { canvas, samples: [], marks: [], tops: { insertion: 75, tension: 1, clearance: 2 } });
  }

  build(scene) {
    this.length = scene.robot.length;
    const tension = scene.limits?.find((limit) => limit.name.startsWith("tension"));
    this.tops = { insertion: 1e3 * this.length, tension: tension?.high ?? 1, clearance: 2 };
  }

  add(state, now) {
    if (now - (this.samples.at(-1)?.now ?? -1) < STEP) return;
    const [clearance] = least(bodyClearance(state.clearance));
    this.keep({ now, insertion: state.insertion, tension: Math.max(...state.tension), clearance, isOutside: state.in_range === false,
      isLive: state.mode === "live" });
    while (this.samples[0].now < now - SPAN) this.samples.shift();
    while (this.marks[0]?.now < now - SPAN) this.marks.shift();
  }

  keep({ now, insertion, tension, clearance, isOutside, isLive }) {
    this.samples.push({ now, insertion: 1e3 * insertion * this.length, tension, clearance: isNumber(clearance) ? 1e3 * clearance : NaN,
      outside: isOutside, isLive });
  }

  /** What was shown before, over s ago, as far as this page missed it. */
  recall({ ago, insertion, tension, clearance, in_range: inRange, live }, now, missed) {
    ago.forEach((each, i) => {
      if (each >= missed) return;
      this.keep({ now: now - each, insertion: insertion[i], tension: tension[i], clearance: clearance[i], isOutside: !inRange[i], isLive: live[i] });
    });
  }

  /** The same again within a moment is one mark with a count, as long as it goes on. */
  mark(severity, now, text) {
    const same = this.marks.findLast((mark) => mark.text === text && now - mark.last < BURST);
    if (same) Object.assign(same, { last: now, count: same.count + 1 });
    else this.marks.push({ severity, text, now, last: now, count: 1 });
  }

  draw(now, theme) {
    const { context, width, height } = fitted(this.canvas);
    const x = (time) => LEFT + ((time - now + SPAN) / SPAN) * (width - LEFT - 6);
    const lane = (height - 14) / LANES.length;
    context.clearRect(0, 0, width, height);
    context.font = theme.font;
    this.shadeOutside(context, x, lane * LANES.length, theme);
    this.drawMarks(context, x, lane * LANES.length, theme);
    LANES.forEach((one, i) => this.drawLane(context, one, { x, top: i * lane, lane, width }, theme));
    timeScale(context, x, height, theme);
  }

  drawLane(context, { key, name, unit, digits }, { x, top, lane, width }, theme) {
    const bottom = top + lane - 4;
    const y = (value) => bottom - Math.min(1, Math.max(0, value / this.tops[key])) * (lane - 8);
    rule(context, LEFT, width - 6, bottom, theme.line);
    context.strokeStyle = theme[key];
    context.lineWidth = 1.6;
    context.beginPath();
    let last = null; // that the line goes on from: not from a record to the live session, nor over a gap
    for (const sample of this.samples) {
      const goesOn = last && last.isLive === sample.isLive && sample.now - last.now < GAP;
      if (isNumber(sample[key])) context[goesOn ? "lineTo" : "moveTo"](x(sample.now), y(sample[key]));
      last = isNumber(sample[key]) ? sample : null;
    }
    context.stroke();
    if (lane >= 32) ends(context, this.tops[key], [top + 8, bottom], theme);
    caption(context, name, `${fixed(this.samples.at(-1)?.[key], digits)} ${unit}`, { middle: top + lane / 2, isFlat: lane < 32 }, theme, theme[key]);
  }

  shadeOutside(context, x, height, theme) {
    context.globalAlpha = 0.16;
    context.fillStyle = theme.bad;
    this.samples.forEach((sample, i) => {
      if (!sample.outside) return;
      const end = this.samples[i + 1]?.now ?? sample.now + STEP;
      context.fillRect(x(sample.now), 0, Math.max(1, x(end) - x(sample.now)), height);
    });
    context.globalAlpha = 1;
  }

  drawMarks(context, x, height, theme) {
    context.textAlign = "left";
    context.textBaseline = "top";
    for (const { severity, now, count } of this.marks) {
      context.fillStyle = { good: theme.good, limit: theme.bad, warning: theme.warn }[severity] ?? theme.line;
      context.fillRect(x(now), 0, 1.5, height);
      if (count > 1) context.fillText(`${count}×`, x(now) + 4, 0);
    }
  }
}

function rule(context, from, to, y, colour) {
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(from, y + 0.5);
  context.lineTo(to, y + 0.5);
  context.stroke();
}

/** What the ends of a lane stand for. */
function ends(context, most, [high, low], theme) {
  context.fillStyle = theme.quiet;
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.fillText(fixed(most, most < 10 ? 1 : 0), LEFT - 6, high);
  context.fillText("0", LEFT - 6, low - 3);
}

function caption(context, name, value, { middle, isFlat }, theme, colour) {
  context.textAlign = "left";
  context.textBaseline = "middle";
  context.fillStyle = colour;
  context.fillText(name, 4, isFlat ? middle : middle - 7);
  context.fillStyle = theme.text;
  context.fillText(value, isFlat ? 64 : 4, isFlat ? middle : middle + 6);
}

function timeScale(context, x, height, theme) {
  context.fillStyle = theme.quiet;
  context.textBaseline = "alphabetic";
  for (const ago of [60, 45, 30, 15, 0]) {
    context.textAlign = ago === 60 ? "left" : ago === 0 ? "right" : "center";
    const now = performance.now() / 1e3;
    context.fillText(ago ? `−${ago} s` : "now", x(now - ago), height - 2);
  }
}
