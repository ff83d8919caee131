// What the page knows: the newest message of each kind, and who wants to hear of it.

export class Store {
  constructor() {
    this.listeners = new Map();
    this.scene = null; // of the last welcome
    this.client = null;
    this.rates = null;
    this.allowedRates = null;
    this.coupled = true;
    this.control = { operator: null, you: false, watchers: 0 };
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
      this.state = message;
      this.stateCount += 1;
    }
    this.emit(message.type, message);
  }

  welcome(message) {
    this.scene = message.scene;
    this.client = message.client;
    this.rates = message.rates;
    this.allowedRates = message.allowed_rates;
    this.coupled = message.coupled ?? true;
  }

  setConnected(connected) {
    this.connected = connected;
    if (!connected) this.control = { operator: null, you: false, watchers: 0 };
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

  get isRetracted() {
    return (this.state?.insertion ?? 1) <= 1e-9;
  }
}
