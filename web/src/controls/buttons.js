// Buttons on the screen that move while they are held: by pointer, or by Enter or Space on the focused button.

export class HoldButtons {
  constructor() {
    this.held = new Map(); // button -> action
  }

  add(button, action) {
    const release = () => this.release(button);
    button.addEventListener("pointerdown", (event) => this.press(event, button, action));
    for (const type of ["pointerup", "pointercancel", "lostpointercapture", "blur", "keyup"]) {
      button.addEventListener(type, release);
    }
    button.addEventListener("keydown", (event) => this.key(event, button, action));
    button.addEventListener("contextmenu", (event) => event.preventDefault()); // a long touch is a hold, not a menu
  }

  press(event, button, action) {
    if (button.disabled || event.button !== 0) return;
    event.preventDefault();
    button.focus({ preventScroll: true });
    button.setPointerCapture(event.pointerId);
    this.hold(button, action);
  }

  key(event, button, action) {
    if (button.disabled || event.repeat || (event.code !== "Enter" && event.code !== "Space")) return;
    event.preventDefault();
    this.hold(button, action);
  }

  hold(button, action) {
    this.held.set(button, action);
    button.classList.add("held");
  }

  release(button) {
    this.held.delete(button);
    button.classList.remove("held");
  }

  halt() {
    for (const button of [...this.held.keys()]) this.release(button);
  }

  read() {
    const wish = { insertion: 0, rotation: 0, tension: 0, hold: this.held.size > 0 };
    for (const action of this.held.values()) wish[action.slice(0, -1)] += action.endsWith("+") ? 1 : -1;
    return wish;
  }
}
