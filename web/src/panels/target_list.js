// The targets by level with distance and reached mark; the chosen one is highlighted in the view.

import { fixed, nearestOf } from "../units.js";
import { element, setText } from "./elements.js";

/** "Lateral left" of "lateral-left@T12", "DRG right" of "drg-right@L1". */
export function placeOf(name) {
  const words = name.split("@")[0].replaceAll("-", " ");
  return words.startsWith("drg") ? words.replace("drg", "DRG") : words.charAt(0).toUpperCase() + words.slice(1);
}

export class TargetList {
  constructor(box, count, onChoose) {
    Object.assign(this, { box, count, onChoose, rows: new Map(), chosen: null });
    this.nearest = element("p", { className: "nearest" });
    this.nearest.append("Nearest", element("b"), element("span", { className: "distance" }));
  }

  build(scene) {
    this.rows.clear();
    const groups = scene.phantom.levels.map((level) => this.group(level.name, scene.phantom.targets.filter((t) => t.level === level.name)));
    this.box.replaceChildren(this.nearest, ...groups.filter(Boolean));
  }

  group(level, targets) {
    if (!targets.length) return null;
    return element("section", { className: "level" }, element("h3", {}, level), element("ul", { ariaLabel: level }, ...targets.map((target) => this.row(target))));
  }

  row(target) {
    const mark = element("i", { className: "ring", ariaHidden: "true" });
    const distance = element("span", { className: "distance" });
    const button = element("button", { type: "button", className: "target", title: target.description ?? "" }, mark, placeOf(target.name), distance);
    button.dataset.target = target.name;
    button.setAttribute("aria-label", `Target ${placeOf(target.name)} ${target.level}`);
    button.addEventListener("click", () => this.choose(this.chosen === target.name ? null : target.name));
    this.rows.set(target.name, { button, distance, tolerance: target.tolerance });
    return element("li", {}, button);
  }

  choose(name) {
    this.chosen = name;
    for (const [own, { button }] of this.rows) button.setAttribute("aria-pressed", String(own === name));
    this.onChoose(name);
  }

  update(state) {
    const reached = new Set(state.reached);
    for (const [name, row] of this.rows) {
      const isReached = reached.has(name);
      if (row.button.dataset.reached !== String(isReached)) this.mark(name, row.button, isReached);
      setText(row.distance, isReached ? "reached" : `${fixed(1e3 * (state.targets[name] ?? NaN), 1)} mm`);
    }
    setText(this.count, `${reached.size} of ${this.rows.size} reached`);
    this.showNearest(state);
  }

  mark(name, button, isReached) {
    button.dataset.reached = String(isReached);
    const [, level] = name.split("@");
    button.setAttribute("aria-label", `Target ${placeOf(name)} ${level}${isReached ? ", reached" : ""}`);
  }

  /** Keeps the nearest target in sight, unless somebody is using the list. */
  reveal(name) {
    if (name === undefined || name === this.revealed || this.box.matches(":hover, :focus-within")) return;
    this.revealed = name;
    const level = this.rows.get(name)?.button.closest(".level");
    if (!level) return;
    const [box, at, head] = [this.box, level, this.nearest].map((one) => one.getBoundingClientRect());
    if (at.top < head.bottom) this.box.scrollTop += at.top - head.bottom; // the list alone, never the page
    else if (at.bottom > box.bottom) this.box.scrollTop += Math.min(at.bottom - box.bottom, at.top - head.bottom);
  }

  showNearest(state) {
    const name = nearestOf(state);
    for (const [own, { button }] of this.rows) button.classList.toggle("is-nearest", own === name);
    if (state.insertion > 0) this.reveal(name); // at first the list stands at its top, as it is read
    const [title, distance] = this.nearest.querySelectorAll("b, span");
    setText(title, name ? `${placeOf(name)} ${name.split("@")[1]}` : "all reached");
    setText(distance, name ? `${fixed(1e3 * state.targets[name], 1)} mm` : "");
  }
}
