// The bar on top: which session, who steers, and the buttons that act on the whole session.

import { byId, setText } from "./elements.js";

const EMPTY = 1e-9;

export class Header {
  constructor({ store, send, stop }) {
    Object.assign(this, { store, send });
    byId("take").addEventListener("click", () => send({ type: store.control.you ? "release" : "take" }));
    byId("stop").addEventListener("click", () => stop("The stop button"));
    byId("reset").addEventListener("click", () => send({ type: "reset" }));
    byId("record").addEventListener("click", () => send({ type: "record", on: !store.state?.recording }));
    for (const type of ["welcome", "control", "connection"]) store.on(type, () => this.show());
    store.on("state", () => this.show());
    this.show();
  }

  show() {
    this.showScene();
    this.showMode();
    this.showControl();
    this.showActions();
  }

  showScene() {
    const { scene } = this.store;
    if (!scene) return;
    const torsion = scene.robot.torsion ? `, ${scene.robot.torsion}` : "";
    setText(byId("subtitle"), `${scene.robot.name}${torsion} · ${scene.phantom.name} phantom`);
  }

  showMode() {
    const { connected, isReplaying, state } = this.store;
    const kind = !connected ? "lost" : isReplaying ? "replay" : state?.moving ? "moving" : "live";
    const words = { lost: this.store.scene ? "Connection lost: stopped" : "Connecting", replay: "Replay", moving: "Moving", live: "Live, at rest" };
    byId("mode").dataset.kind = kind;
    setText(byId("mode"), words[kind]);
  }

  showControl() {
    const { control, connected } = this.store;
    const watchers = control.watchers ? `, ${control.watchers} watching` : "";
    const who = control.you ? "You have control" : control.operator ? `${control.operator} has control` : "Nobody has control";
    setText(byId("operator-text"), connected ? who + watchers : "");
    const button = byId("take");
    setText(button, control.you ? "Release control" : "Take control");
    button.classList.toggle("primary", !control.you);
    button.disabled = !connected;
  }

  showActions() {
    const { control, connected, isReplaying, isRetracted, state } = this.store;
    const mayAct = connected && control.you && !isReplaying;
    byId("reset").disabled = !mayAct;
    byId("place").disabled = !mayAct || !isRetracted;
    byId("place").title = isRetracted ? "Move the outer tube" : "Retract the robot first";
    byId("replay-end").hidden = !isReplaying || !control.you;
    const record = byId("record");
    const isOn = Boolean(state?.recording);
    record.disabled = !mayAct || (!isOn && (state?.insertion ?? 1) > EMPTY);
    record.title = isOn ? `Recording ${state.recording}: end the record` : "Begin a new record, with the robot retracted";
    record.setAttribute("aria-pressed", String(isOn));
    setText(record.querySelector("span"), isOn ? "Recording" : "Record");
  }
}
