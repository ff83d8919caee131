// Keys to choose, and what the gamepad does.

import { AXES } from "../controls/bindings.js";
import { byId, closable, element, setText } from "./elements.js";

export class Settings {
  constructor({ bindings, gamepads }) {
    Object.assign(this, { bindings, gamepads, waiting: null });
    this.dialog = closable(byId("settings-dialog"));
    byId("settings").addEventListener("click", () => this.open());
    byId("bindings-reset").addEventListener("click", () => this.bindings.reset());
    this.dialog.addEventListener("keydown", (event) => this.take(event), { capture: true });
    this.dialog.addEventListener("close", () => (this.waiting = null));
    bindings.onChange(() => this.fill());
    this.fill();
    setInterval(() => this.dialog.open && setText(byId("gamepad-text"), gamepads.describe()), 200);
  }

  open() {
    byId("bindings-error").textContent = "";
    this.dialog.showModal();
  }

  fill() {
    byId("bindings").replaceChildren(...AXES.flatMap((axis) => [this.key(`${axis.name}-`, axis.less), this.key(`${axis.name}+`, axis.more)]));
  }

  key(action, label) {
    const letter = this.waiting === action ? "press a key" : this.bindings.letter(this.bindings.keys[action]);
    const button = element("button", { type: "button" }, letter);
    button.dataset.binding = action;
    button.setAttribute("aria-label", `Key for ${label}: ${letter}`);
    button.addEventListener("click", () => this.wait(action));
    return element("label", {}, element("span", {}, label), button);
  }

  wait(action) {
    this.waiting = action;
    this.fill();
    byId("bindings").querySelector(`[data-binding="${action}"]`).focus();
  }

  take(event) {
    if (!this.waiting || event.code === "Tab" || event.repeat) return;
    event.preventDefault();
    event.stopPropagation();
    const action = this.waiting;
    this.waiting = null;
    const refusal = event.code === "Escape" ? "" : this.bindings.set(action, event.code);
    byId("bindings-error").textContent = refusal;
    this.fill();
  }
}
