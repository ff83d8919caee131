// The page: one store of what the server says, one stage to draw it, panels around it, controls that stop by default.

import { Bindings } from "./controls/bindings.js";
import { HoldButtons } from "./controls/buttons.js";
import { Gamepads } from "./controls/gamepad.js";
import { Jog } from "./controls/jog.js";
import { Keys } from "./controls/keys.js";
import { guard } from "./controls/safety.js";
import { walkByKeys } from "./controls/list_keys.js";
import { turnByKeys } from "./controls/view_keys.js";
import { Connection, socketUrl } from "./connection.js";
import { byId, setText } from "./panels/elements.js";
import { Fault } from "./panels/fault.js";
import { Header } from "./panels/header.js";
import { Hint } from "./panels/hint.js";
import { Pad } from "./panels/pad.js";
import { Picture } from "./picture.js";
import { Placing } from "./panels/placing.js";
import { Player } from "./panels/player.js";
import { Recording } from "./panels/recording.js";
import { Records } from "./panels/records.js";
import { Settings } from "./panels/settings.js";
import { Store } from "./store.js";

const PING_MS = 2000; // an operator who is silent for ten seconds may be replaced
const RATES_MS = 100;

const query = location.search;
const store = new Store();
const picture = new Picture(store, query);
const send = (message) => connection.send(message);

// ---- what moves, and what stops it
const bindings = new Bindings();
const keys = new Keys(bindings);
const buttons = new HoldButtons();
const gamepads = new Gamepads({ onLost: () => halt("The gamepad is lost") });
const hasFocus = () => document.hasFocus() && !document.hidden && !document.querySelector("dialog[open]");
const jog = new Jog({ sources: [keys, buttons, gamepads], send, maySteer: () => store.maySteer && hasFocus(), onHalt });

function halt(reason) {
  jog.halt(reason);
}

function stop(reason) {
  halt(reason);
  send({ type: "stop" });
}

function onHalt(reason, wasMoving) {
  if (wasMoving) picture.events.add(`${reason}: stopped.`, "warning", store.time);
}

guard({ halt, stop });
walkByKeys({ box: byId("targets"), bindings });
turnByKeys({ canvas: byId("view"), cameras: picture.stage?.cameras, bindings });
picture.beforeDrawing = () => jog.tickIfDue(); // a drawing may take long, and the timer would be late by it

// ---- panels that act
const pad = new Pad(byId("axes"), { bindings, buttons, onRates: sendRatesSoon });
new Header({ store, send, stop });
new Placing({ store, send });
new Recording({ store, send });
new Records({ store, send, query });
new Player({ store, send });
new Fault({ store, send });
new Hint({ store, bindings });
new Settings({ bindings, gamepads });
bindings.readLayout();
for (const dialog of document.querySelectorAll("dialog")) dialog.addEventListener("focusin", () => halt("A dialog is open"));

let ratesTimer = null;
function sendRatesSoon(rates) {
  clearTimeout(ratesTimer);
  ratesTimer = setTimeout(() => send({ type: "rates", ...rates }), RATES_MS);
}

const coupling = byId("coupling");
coupling.addEventListener("change", () => send({ type: "coupling", on: coupling.checked }));

function showSettings() {
  pad.build(store.rates, store.allowedRates);
  coupling.checked = store.coupled;
}

store.on("welcome", showSettings);
store.on("settings", showSettings);
store.on("error", () => store.rates && showSettings()); // what was refused goes back to what holds
store.on("control", () => !store.maySteer && halt("This page has no control"));
store.on("connection", (isConnected) => !isConnected && halt("The connection is lost"));
setInterval(showControls, 60);

function showControls() {
  pad.setEnabled(store.maySteer);
  coupling.disabled = !store.maySteer;
  pad.showWish(store.maySteer ? jog.read() : { hold: false });
  setText(byId("input-text"), inputText());
  setText(byId("pad-text"), store.maySteer ? "hold to move, let go to stop" : "");
}

function inputText() {
  if (!store.connected) return "";
  if (store.isReplaying) return "A replay: nothing can be moved.";
  if (!store.control.you) return store.control.free ? "Take control to move the robot." : `Watching: ${store.control.operator} has control.`;
  return gamepads.id === null ? "Keys, buttons or a gamepad." : gamepads.describe();
}

// ---- the server
const connection = new Connection(socketUrl(location), {
  onMessage: (message) => store.receive(message),
  onStatus: (isConnected) => store.setConnected(isConnected),
});
setInterval(() => send({ type: "ping", id: Math.round(performance.now()) }), PING_MS);

// ---- what a test or a curious reader may look at
window.tendonrod = {
  get state() { return store.state; },
  get scene() { return store.scene; },
  get control() { return store.control; },
  get connected() { return store.connected; },
  get stateCount() { return store.stateCount; },
  get isMoving() { return jog.isMoving; },
  get framesDrawn() { return picture.framesDrawn; },
  drop: () => connection.drop(),
  bindings, gamepads, jog, picture,
};
