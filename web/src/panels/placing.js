// The form that places the outer tube; the server judges, the form only says what it said.

import { byId, closable, element } from "./elements.js";

const FIELDS = { height: 1e3, offset: 1e3, depth: 1e3, tilt: 180 / Math.PI, lean: 180 / Math.PI };

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
    for (const [name, factor] of Object.entries(FIELDS)) this.field(name).value = String(Number((tube[name] * factor).toFixed(2)));
    const levels = this.store.scene.phantom.levels.map((level) => element("option", { value: level.name }, level.name));
    byId("place-level").replaceChildren(element("option", { value: "" }, "as it is"), ...levels);
    byId("place-error").textContent = "";
    this.dialog.showModal();
  }

  takeLevel() {
    const level = this.store.scene.phantom.levels.find((one) => one.name === byId("place-level").value);
    if (!level) return;
    const height = level.entry_height ?? level.z_low;
    this.field("height").value = String(Number((1e3 * height).toFixed(2)));
    if (level.entry_depth !== undefined && level.entry_depth !== null) this.field("depth").value = String(Number((1e3 * level.entry_depth).toFixed(2)));
  }

  submit(event) {
    event.preventDefault();
    const tube = {};
    for (const [name, factor] of Object.entries(FIELDS)) {
      const value = this.field(name).valueAsNumber;
      if (!Number.isFinite(value)) return this.refuse(`Please give a number for ${name}.`);
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
