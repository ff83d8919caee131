// The bar on top: which session, how it is, who steers, and the buttons that act on the whole session.

import { byId, setText } from "./elements.js";

const WORDS = {
  connecting: "Connecting", lost: "Connection lost: stopped", fault: "Bench stopped", replay: "Replay", refused: "Refused",
  partly: "Moving, partly refused", moving: "Moving", live: "Live, at rest",
};

export class Header {
  constructor({ store, send, stop }) {
    Object.assign(this, { store, send });
    byId("take").addEventListener("click", (event) => {
      send({ type: store.control.you ? "release" : "take" });
      if (event.detail) event.currentTarget.blur(); // a click, not a key: the space bar must not release control later
    });
    byId("stop").addEventListener("click", () => stop("The stop button"));
    byId("reset").addEventListener("click", () => send({ type: "reset" }));
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
    setText(byId("subtitle"), `${scene.robot.name} · ${scene.phantom.name} phantom`);
    byId("subtitle").title = `Torsion of the section: ${scene.robot.torsion || "as the robot's file says"}`;
  }

  showMode() {
    const { doing } = this.store;
    byId("mode").dataset.kind = doing;
    setText(byId("mode"), WORDS[doing]);
  }

  showControl() {
    const { control, connected } = this.store;
    setText(byId("operator-text"), connected ? who(control) : "");
    const button = byId("take");
    setText(button, control.you ? "Release control" : control.operator && control.free ? "Take over" : "Take control");
    button.classList.toggle("primary", !control.you);
    button.disabled = !connected || !(control.you || control.free);
    button.title = effect(control);
  }

  showActions() {
    const { canReset, isRetracted, maySteer } = this.store;
    byId("reset").disabled = !maySteer || !canReset;
    byId("reset").title = !canReset ? "A bench cannot be reset: retract the robot instead" : !maySteer ? "Take control first"
      : "Retracts the robot at once, without tension, and forgets the targets reached";
    byId("place").disabled = !maySteer || !isRetracted;
    byId("place").title = !maySteer ? "Take control first" : isRetracted ? "Move the outer tube" : "Retract the robot first";
  }
}

/** Who steers, and how many look on beside this page. */
function who({ you, operator, watchers }) {
  const others = watchers - (you ? 0 : 1);
  const also = others > 0 ? `, ${others} ${you ? "watching" : "more watching"}` : "";
  return (you ? "You have control" : operator ? `${operator} has control` : "Nobody has control") + also;
}

/** What the button of control does, or why it can do nothing now. */
function effect({ you, operator, free }) {
  if (you) return "Others may then take control; the robot stops";
  if (!operator) return "Only this page then moves the robot; all others watch";
  return free ? `${operator} has been silent: take its place` : `${operator} must release control, or be silent for 10 s`;
}
