// Keys as a source of motion: the key itself is the dead-man's switch.

const TEXT_FIELDS = "input:not([type=range]):not([type=checkbox]), select, textarea, [contenteditable]";

export const isTextField = (element) => Boolean(element?.matches?.(TEXT_FIELDS));

export class Keys {
  constructor(bindings, target = window) {
    this.bindings = bindings;
    this.held = new Map(); // code -> action at the time it went down, so that a remap cannot leave one stuck
    target.addEventListener("keydown", (event) => this.down(event));
    target.addEventListener("keyup", (event) => this.held.delete(event.code));
    bindings.onChange(() => this.halt());
  }

  down(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return this.halt(); // a shortcut: its key-up may never come
    const action = this.bindings.actionOf(event.code);
    if (!action || isTextField(event.target) || document.querySelector("dialog[open]")) return;
    event.preventDefault();
    if (!event.repeat) this.held.set(event.code, action); // a repeat after a stop must not start again
  }

  halt() {
    this.held.clear();
  }

  read() {
    const wish = { insertion: 0, rotation: 0, tension: 0, hold: this.held.size > 0 };
    for (const action of this.held.values()) wish[action.slice(0, -1)] += action.endsWith("+") ? 1 : -1;
    return wish;
  }
}
