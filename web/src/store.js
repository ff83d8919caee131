// What the page knows: the newest message of each kind, and who wants to hear of it.

const NOBODY = { operator: null, you: false, watchers: 0, free: false };

export class Store {
  constructor() {
    this.listeners = new Map();
    this.scene = null; // of the last welcome
    this.client = null;
    this.rates = null;
    this.allowedRates = null;
    this.coupled = true;
    this.canReset = true;
    this.time = null; // s, of the live session
    this.control = NOBODY;
    this.state = null;
    this.stateCount = 0;
    this.connected = false;
  }

  /** Calls `listener` with the message after each message of that type ("state", "welcome", ...). */
  on(type, listener) {
    const known = this.listeners.get(type) ?? [];
    this.listeners.set(type, [...known, listener]);
  }

  emit(type, message) {
    for (const listener of this.listeners.get(type) ?? []) listener(message);
  }

  receive(message) {
    if (message.type === "welcome") this.welcome(message);
    if (message.type === "control") this.control = message;
    if (message.type === "settings") Object.assign(this, { rates: message.rates, coupled: message.coupled });
    if (message.type === "state") {
      this.isStill = isSame(this.state, message);
      this.state = message;
      this.stateCount += 1;
      if (message.mode === "live") this.time = message.time;
    }
    this.emit(message.type, message);
  }

  welcome(message) {
    this.scene = message.scene;
    this.client = message.client;
    this.rates = message.rates;
    this.allowedRates = message.allowed_rates;
    this.coupled = message.coupled ?? true;
    this.allowedTube = message.allowed_tube;
    this.canReset = message.can_reset;
  }

  setConnected(connected) {
    this.connected = connected;
    if (!connected) this.control = NOBODY;
    this.emit("connection", connected);
    this.emit("control", this.control);
  }

  get isReplaying() {
    return this.state?.mode === "replay";
  }

  /** True where this page may move the robot. */
  get maySteer() {
    return this.connected && this.control.you && !this.isReplaying;
  }

  /** One word for how it is: connecting, lost, fault, replay, refused, partly (refused), moving or live (at rest). */
  get doing() {
    const { state } = this;
    if (!this.connected) return this.scene ? "lost" : "connecting";
    if (this.isReplaying) return "replay";
    if (state?.fault) return "fault";
    if (state?.blocked) return this.isStill ? "refused" : "partly";
    return state?.moving ? "moving" : "live";
  }

  get isRetracted() {
    return (this.state?.insertion ?? 1) <= 1e-9;
  }
}

/** Whether the robot stands as it did: what was asked of it meanwhile was refused. */
function isSame(before, now) {
  return before?.insertion === now.insertion && before.rotation === now.rotation && String(before.tension) === String(now.tension);
}
