// Numbers with their limits: the three motions first, then distances to tissue, then what limits the model.

import { bodyClearance, clamp, display, fixed, isNumber, least } from "../units.js";
import { element, setText } from "./elements.js";

const LABELS = {
  strain: "Strain", pressure: "Tissue pressure", push: "Push (Euler)", contact_force: "Contact force",
};
const MEANINGS = {
  strain: "The largest strain of the tube’s wall; beyond the limit it is no longer elastic",
  pressure: "The highest contact pressure on cord or dura; the limit is an engineering choice",
  push: "What pushes along the tube, and Euler’s load: beyond it only the walls keep the robot where it is",
  contact_force: "The contact forces on the robot, added as vectors",
};
const OWN = /^(insertion|rotation|tension)/; // these have rows of their own
const SIDES = ["ventral", "ventral left", "left", "dorsal left", "dorsal", "dorsal right", "right", "ventral right"];
const NEAR = 0.85; // share of a limit from which a gauge turns amber
const CLEARANCE_SPAN = 3e-3; // m, full scale of a clearance bar
const TOUCH = 2e-5; // m, the tolerance of the contact
const CLEARANCE_LOW = 2e-4; // m, amber below

export const labelOf = (name) => LABELS[name] ?? (name.charAt(0).toUpperCase() + name.slice(1)).replaceAll("_", " ");

export class Gauges {
  constructor(list) {
    this.list = list;
    this.rows = new Map();
  }

  build(scene) {
    this.scene = scene;
    this.list.replaceChildren();
    this.rows.clear();
  }

  update(state) {
    for (const row of [...this.motions(state), ...clearances(state), ...limits(state)]) this.show(row);
  }

  motions(state) {
    const { length } = this.scene.robot;
    const gauges = state.gauges ?? {};
    const travel = { key: "insertion", label: "Insertion", value: state.insertion * length, low: 0, high: length, unit: "m",
      note: `${fixed(100 * state.insertion, 0)} %`, title: "How far the robot is out of the outer tube, and of its length", level: level(gauges.insertion, true) };
    const turn = { key: "rotation", label: "Rotation", value: state.rotation, unit: "rad", note: bendsTo(state.rotation), ...ends(gauges.rotation),
      title: "Turned by so much at the outer tube's exit; the side to which a pull on the tendon bends the robot there", isCentred: true };
    const pulls = state.tension.map((value, i) => {
      const gauge = gauges.tension ?? gauges[`tension_${i}`] ?? gauges[`tension_${i + 1}`] ?? {};
      const label = state.tension.length > 1 ? `Tendon ${i + 1}` : "Tension";
      return { key: `tension${i}`, label, value, low: gauge.low ?? 0, high: gauge.high, unit: "N", title: "The pull on the tendon, and its stop", level: level(gauge, true) };
    });
    return [travel, turn, ...pulls];
  }

  show(row) {
    const known = this.rows.get(row.key) ?? this.add(row);
    const { unit, digits, factor } = display(row.unit);
    known.row.dataset.level = row.level ?? "";
    setText(known.value, fixed(isNumber(row.value) ? row.value * factor : NaN, row.digits ?? digits));
    setText(known.unit, unit);
    setText(known.note, row.note ?? limitText(row));
    known.bar.hidden = !isNumber(row.high) || !isNumber(row.value);
    if (!known.bar.hidden) fill(known.fill, row);
  }

  add(row) {
    const value = element("b");
    const unit = element("span", { className: "unit" });
    const note = element("span", { className: "note" });
    const fill = element("i");
    const bar = element("div", { className: "meter" }, fill);
    const one = element("div", { className: "gauge" }, element("dt", {}, row.label), element("dd", {}, value, unit, note), bar);
    one.dataset.gauge = row.key;
    one.title = row.title ?? "";
    this.list.append(one);
    const known = { row: one, value, unit, note, bar, fill };
    this.rows.set(row.key, known);
    return known;
  }
}

function clearances(state) {
  const rows = Object.entries(state.clearance ?? {}).map(([name, values]) => {
    const [value] = least(values);
    const warning = value === null ? "" : value < -TOUCH ? "bad" : value < CLEARANCE_LOW ? "warn" : "";
    return { key: `clearance-${name}`, label: `To the ${name}`, value: value ?? NaN, low: 0, high: CLEARANCE_SPAN, unit: "m",
      digits: 2, note: value !== null && value <= TOUCH ? "touching" : "least", level: warning, title: `The least distance from the tube’s wall, along the whole body, to the ${name}` };
  });
  return bodyClearance(state.clearance).length ? rows : rows.map((row) => ({ ...row, value: NaN, level: "" }));
}

function limits(state) {
  return Object.entries(state.gauges ?? {}).filter(([name]) => !OWN.test(name) && !name.startsWith("clearance"))
    .map(([name, gauge]) => ({ key: name, label: labelOf(name), title: MEANINGS[name], ...gauge, level: level(gauge), ...fine(gauge) }));
}

/** Strains are small percentages, forces on tissue a few millinewtons. */
function fine({ unit }) {
  if (unit === "N") return { unit: "mN" };
  return unit === "1" ? { digits: 2 } : {};
}

/** "bad" beyond the limit, "warn" near it. A motion's end (isEnd) is no danger: only beyond counts. */
function level(gauge, isEnd = false) {
  if (!gauge) return "";
  if (gauge.exceeded) return "bad";
  return !isEnd && isNumber(gauge.high) && gauge.value > NEAR * gauge.high ? "warn" : "";
}

const ends = (gauge) => ({ low: gauge?.low, high: gauge?.high, level: level(gauge, true) });

/** A bar from its left end, or from its middle where zero lies there. */
function fill(one, row) {
  const part = share(row);
  one.style.transform = row.isCentred ? `translateX(${100 * Math.min(0.5, part)}%) scaleX(${Math.abs(part - 0.5)})` : `scaleX(${part})`;
}

function share({ value, low, high }) {
  const from = isNumber(low) ? low : 0;
  return clamp((value - from) / (high - from || 1), 0, 1);
}

function limitText({ high, unit, digits }) {
  if (!isNumber(high) || high <= 0) return "";
  const how = display(unit);
  if (unit === "mN" && high >= 1) return `of ${fixed(high, 1)} N`;
  return `of ${fixed(high * how.factor, digits ?? how.digits)}`;
}

/** Where a pull on the tendon bends the robot at the exit: at rotation 0 to ventral, a quarter turn later to the left. */
function bendsTo(rotation) {
  const turns = (((rotation / (2 * Math.PI)) % 1) + 1) % 1;
  return `bends ${SIDES[Math.round(8 * turns) % 8]}`;
}
