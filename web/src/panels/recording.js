// Whether the session is being recorded, and the button that ends the record or begins a new one.

import { byId, closable, setText } from "./elements.js";

export class Recording {
  constructor({ store, send }) {
    Object.assign(this, { store, send });
    this.dialog = closable(byId("record-dialog"));
    byId("record").addEventListener("click", () => (store.state?.recording ? this.ask() : send({ type: "record", on: true })));
    byId("record-end").addEventListener("click", () => this.end());
    for (const type of ["control", "connection", "state"]) store.on(type, () => this.show());
  }

  ask() {
    setText(byId("record-name"), this.store.state.recording);
    this.dialog.showModal();
  }

  end() {
    this.dialog.close();
    this.send({ type: "record", on: false });
  }

  show() {
    const { isRetracted, maySteer, state } = this.store;
    const name = state?.recording;
    byId("recording").hidden = !name;
    byId("recording").title = name ? `Everything is kept in ${name}` : "";
    const button = byId("record");
    button.classList.toggle("is-on", Boolean(name));
    setText(button, name ? "End record" : "New record");
    button.disabled = !maySteer || (!name && !isRetracted);
    button.title = !maySteer ? "Take control first" : name ? "Asks before it ends" : isRetracted ? "From here on" : "Retract the robot first";
  }
}
