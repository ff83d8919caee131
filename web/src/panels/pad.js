// The pad: one row per motion with two hold buttons, their keys, and the rate.

import { AXES } from "../controls/bindings.js";
import { display, fixed } from "../units.js";
import { element, setText } from "./elements.js";

const UNITS = { insertion: "m/s", rotation: "rad/s", tension: "N/s" };

export class Pad {
  constructor(box, { bindings, buttons, onRates }) {
    Object.assign(this, { box, bindings, buttons, onRates, rows: {}, rates: {} });
    for (const axis of AXES) this.rows[axis.name] = this.row(axis);
    bindings.onChange(() => this.showKeys());
    this.showKeys();
  }

  row(axis) {
    const less = this.button(axis, "-", axis.less);
    const more = this.button(axis, "+", axis.more);
    const rate = element("output", { ariaLive: "off" }); // the slider says it
    const slider = element("input", { type: "range", min: 0, max: 100, step: 1, ariaLabel: `Rate of ${axis.label.toLowerCase()}`, title: "How fast at full deflection" });
    slider.addEventListener("input", () => this.slide(axis.name));
    const middle = element("div", { className: "rate" }, element("span", {}, axis.label), rate, slider);
    this.box.append(element("div", { className: "axis" }, less.button, middle, more.button));
    return { less, more, rate, slider };
  }

  button(axis, sign, label) {
    const key = element("kbd");
    const button = element("button", { type: "button", className: "hold", disabled: true }, element("span", {}, label), key);
    button.dataset.action = axis.name + sign;
    button.title = `${axis.does[sign]}, while held`;
    this.buttons.add(button, axis.name + sign);
    return { button, key };
  }

  showKeys() {
    for (const { name } of AXES) {
      setText(this.rows[name].less.key, this.bindings.letter(this.bindings.keys[`${name}-`]));
      setText(this.rows[name].more.key, this.bindings.letter(this.bindings.keys[`${name}+`]));
    }
  }

  setEnabled(isEnabled) {
    for (const { name } of AXES) {
      const { less, more, slider } = this.rows[name];
      less.button.disabled = more.button.disabled = slider.disabled = !isEnabled;
    }
  }

  /** Lights the buttons of what moves, whichever source moves it. */
  showWish(wish) {
    for (const { name } of AXES) {
      this.rows[name].more.button.classList.toggle("moving", wish.hold && wish[name] > 0);
      this.rows[name].less.button.classList.toggle("moving", wish.hold && wish[name] < 0);
    }
  }

  build(rates, allowed) {
    this.allowed = allowed;
    this.show(rates);
  }

  show(rates) {
    for (const { name } of AXES) {
      this.rates[name] = rates[name];
      const [low, high] = this.range(name);
      const { slider } = this.rows[name];
      if (document.activeElement !== slider) slider.value = String(100 * Math.sqrt((rates[name] - low) / (high - low || 1)));
      this.showRate(name);
    }
  }

  range(name) {
    const allowed = this.allowed[name];
    return Array.isArray(allowed) ? allowed : [allowed.low, allowed.high];
  }

  slide(name) {
    const [low, high] = this.range(name);
    this.rates[name] = low + (high - low) * (Number(this.rows[name].slider.value) / 100) ** 2; // finer where it is slow
    this.showRate(name);
    this.onRates({ ...this.rates });
  }

  showRate(name) {
    const { factor, unit, digits } = display(UNITS[name]);
    const rate = this.rates[name] * factor;
    const text = `${fixed(rate, rate < 1 ? 2 : digits)} ${unit}`;
    setText(this.rows[name].rate, text);
    this.rows[name].slider.setAttribute("aria-valuetext", text);
  }
}
