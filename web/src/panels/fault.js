// What stopped the bench, for everybody, and what to do next.

import { capital } from "../units.js";
import { byId, setText } from "./elements.js";

export class Fault {
  constructor({ store, send }) {
    this.store = store;
    byId("acknowledge").addEventListener("click", () => send({ type: "acknowledge", home: store.state.fault.homes }));
    for (const type of ["control", "connection", "state"]) store.on(type, () => this.show());
  }

  show() {
    const fault = this.store.connected ? this.store.state?.fault : null;
    byId("fault").hidden = !fault;
    if (!fault) return;
    setText(byId("fault-text"), capital(fault.text.replace(/^the bench stopped: /, "")));
    setText(byId("fault-remedy"), capital(fault.remedy) + (this.store.control.you ? "." : ". Only who has control can do it."));
    const button = byId("acknowledge");
    const { you } = this.store.control;
    setText(button, fault.homes ? "Acknowledge and home" : "Acknowledge");
    button.disabled = !you || !fault.ready;
    button.title = !you ? "Take control to acknowledge" : fault.ready ? (fault.homes ? "The bench then moves: it lets the tendon go and draws the robot in" : "Nothing moves by it") : "Not possible yet";
  }
}
