// The form that places the outer tube; the server judges, the form only says what it said.

import { fixed } from "../units.js";
import { byId, closable, element } from "./elements.js";

const FIELDS = { height: 1e3, offset: 1e3, depth: 1e3, tilt: 180 / Math.PI, lean: 180 / Math.PI };
const UNITS = { height: "mm", offset: "mm", depth: "mm", tilt: "°", lean: "°" };

export class Placing {
  constructor({ store, send }) {
    Object.assign(this, { store, send, isWaiting: false });
    this.dialog = closable(byId("place-dialog"));
    byId("place").addEventListener("click", () => this.open());
    byId("place-level").addEventListener("change", () => this.takeLevel());
    byId("place-form").addEventListener("submit", (event) => this.submit(event));
    store.on("error", (message) => this.isWaiting && this.refuse(message.text));
    store.on("state", (state) => this.isWaiting && this.settle(state));
  }

  field(name) {
    return byId(`place-${name}`);
  }

  open() {
    const { tube } = this.store.state;
    this.fill(tube);
    byId("place-level").replaceChildren(...this.choices().map(([text]) => element("option", { value: text }, text)));
    byId("place-error").textContent = "";
    this.dialog.showModal();
  }

  /** Poses to begin with, each [what it is called, pose or what of it]. */
  choices() {
    const { scene, state } = this.store;
    const levels = scene.phantom.levels.map((level) => [level.name, level.tube ?? { height: level.z_low }]);
    return [["as it is", state.tube], ["where the session began", scene.tube], ...levels];
  }

  takeLevel() {
    const [, pose] = this.choices().find(([text]) => text === byId("place-level").value);
    this.fill(pose);
  }

  fill(pose) {
    for (const [name, value] of Object.entries(pose)) this.field(name).value = String(Number((value * FIELDS[name]).toFixed(2)));
  }

  submit(event) {
    event.preventDefault();
    const tube = {};
    for (const [name, factor] of Object.entries(FIELDS)) {
      const value = this.field(name).valueAsNumber;
      if (!Number.isFinite(value)) return this.refuse(`Please give a number for ${name}.`);
      const [low, high] = this.store.allowedTube[name].map((end) => Math.round(end * factor));
      if (value < low || value > high) return this.refuse(`The ${name} must be from ${fixed(low, 0)} to ${fixed(high, 0)} ${UNITS[name]}.`);
      tube[name] = value / factor;
    }
    this.asked = tube;
    this.isWaiting = this.send({ type: "place", tube });
    if (!this.isWaiting) this.refuse("There is no connection.");
  }

  refuse(text) {
    this.isWaiting = false;
    byId("place-error").textContent = text;
  }

  settle(state) {
    const isThere = Object.keys(FIELDS).every((name) => Math.abs(state.tube[name] - this.asked[name]) < 1e-6);
    if (isThere) {
      this.isWaiting = false;
      this.dialog.close();
    } else if (state.blocked) this.refuse(state.blocked);
  }
}
