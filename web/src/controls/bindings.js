// Which key moves what. Keys are named by their place on the keyboard (KeyboardEvent.code), so that the pairs keep
// their shape on every layout; the letter shown is that of the layout where the browser tells it.

export const AXES = [
  { name: "insertion", label: "Insertion", less: "Retract", more: "Insert", does: { "-": "Draws the robot into the outer tube", "+": "Pushes the robot out of the outer tube" } },
  { name: "rotation", label: "Rotation", less: "Turn −", more: "Turn +",
    does: { "-": "Turns the robot anticlockwise, seen from behind", "+": "Turns the robot clockwise, seen from behind" } },
  { name: "tension", label: "Tendon", less: "Release", more: "Pull", does: { "-": "Lets the tendon go: the robot bends less", "+": "Pulls the tendon: the robot bends more" } },
];

export const STANDARD = {
  "insertion+": "KeyW", "insertion-": "KeyS",
  "rotation-": "KeyA", "rotation+": "KeyD",
  "tension-": "KeyQ", "tension+": "KeyE",
};

/** What the page calls an action: "Pull" for "tension+". */
function labelOf(action) {
  const axis = AXES.find((one) => one.name === action.slice(0, -1));
  return action.endsWith("+") ? axis.more : axis.less;
}

const STORED = "tendonrod.keys";
const RESERVED = new Set(["Escape", "Tab", "Enter", "Space", "F5", "F11", "F12"]);

function isBindings(value) {
  const codes = Object.keys(STANDARD).map((action) => value?.[action]);
  return codes.every((code) => typeof code === "string" && !RESERVED.has(code)) && new Set(codes).size === codes.length;
}

export class Bindings {
  constructor(storage = globalThis.localStorage) {
    this.storage = storage;
    this.letters = new Map();
    this.listeners = [];
    this.keys = { ...STANDARD, ...this.stored() };
  }

  stored() {
    try {
      const value = JSON.parse(this.storage.getItem(STORED));
      return isBindings(value) ? value : {};
    } catch {
      return {}; // private mode or a spoilt entry: the standard keys do
    }
  }

  /** Gives `action` the key `code`. Returns "" or the reason why not. */
  set(action, code) {
    if (RESERVED.has(code)) return `${code} is kept for the browser or for stopping.`;
    const other = Object.keys(this.keys).find((name) => this.keys[name] === code && name !== action);
    if (other) return `${this.letter(code)} already is the key for ${labelOf(other)}.`;
    this.change({ ...this.keys, [action]: code });
    return "";
  }

  reset() {
    this.change({ ...STANDARD });
  }

  change(keys) {
    this.keys = keys;
    try {
      this.storage.setItem(STORED, JSON.stringify(keys));
    } catch {
      // not stored, valid until the page is left
    }
    this.announce();
  }

  onChange(listener) {
    this.listeners.push(listener);
  }

  announce() {
    for (const listener of this.listeners) listener(this.keys);
  }

  actionOf(code) {
    return Object.keys(this.keys).find((action) => this.keys[action] === code) ?? null;
  }

  /** What is printed on the key, as far as the browser tells. */
  letter(code) {
    return (this.letters.get(code) ?? code.replace(/^(Key|Digit)/, "").replace("Arrow", "")).toUpperCase();
  }

  async readLayout(keyboard = globalThis.navigator?.keyboard) {
    const layout = await keyboard?.getLayoutMap?.().catch(() => null);
    if (!layout) return;
    this.letters = layout;
    this.announce();
  }
}
