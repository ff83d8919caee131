// Buttons over the 3D view: camera, shown parts, what colours the robot.

import { lookOf } from "../view/colours.js";
import { PRESETS } from "../view/cameras.js";
import { byId, element } from "./elements.js";

const SAID = { Whole: "See the whole phantom", Oblique: "Look obliquely, from dorsal and the right", Left: "Look from the patient’s left", Right: "Look from the patient’s right" };

export class ViewBar {
  constructor(stage, anatomy, onColour) {
    Object.assign(this, { stage, anatomy, onColour });
    for (const key of ["clearance", "pressure"]) byId(`by-${key}`).addEventListener("click", () => this.colour(key));
    if (!stage) return;
    byId("cameras").append(...Object.keys(PRESETS).map((name) => this.camera(name)), this.follower());
    stage.cameras.onPreset = (name) => this.showPreset(name);
    this.showPreset(stage.cameras.preset);
  }

  camera(name) {
    const ariaLabel = SAID[name] ?? `Look from ${name.toLowerCase()}`;
    const button = element("button", { type: "button", ariaLabel, title: ariaLabel }, name);
    button.dataset.camera = name;
    button.addEventListener("click", () => this.stage.cameras.go(name));
    return button;
  }

  /** Which way the view looks; "" for one that has no name. */
  showPreset(name) {
    for (const button of byId("cameras").querySelectorAll("[data-camera]")) button.setAttribute("aria-pressed", String(button.dataset.camera === name));
    byId("view").parentElement.classList.toggle("is-above", name === "Cranial");
  }

  follower() {
    const button = element("button", { type: "button", title: "The view goes along with the tip, from near" }, "Follow tip");
    button.setAttribute("aria-pressed", "false");
    button.addEventListener("click", () => {
      const isOn = button.getAttribute("aria-pressed") !== "true";
      button.setAttribute("aria-pressed", String(isOn));
      this.stage.cameras.follow(isOn);
    });
    return button;
  }

  colour(key) {
    for (const name of ["clearance", "pressure"]) byId(`by-${name}`).setAttribute("aria-pressed", String(name === key));
    this.onColour(key);
  }

  /** One switch per role of the anatomy that was loaded. */
  build() {
    byId("layers").replaceChildren(...this.anatomy.roles.map((role) => this.layer(role)));
  }

  layer(role) {
    const look = lookOf(role);
    const swatch = element("i", { className: "swatch", ariaHidden: "true" });
    swatch.style.background = look.colour;
    const button = element("button", { type: "button", ariaLabel: `Show ${look.label.toLowerCase()}` }, swatch, look.label);
    button.setAttribute("aria-pressed", "true");
    button.addEventListener("click", () => this.toggle(button, role));
    return button;
  }

  toggle(button, role) {
    const isOn = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", String(isOn));
    this.anatomy.show(role, isOn);
    if (this.stage) this.stage.isStale = true;
  }
}
