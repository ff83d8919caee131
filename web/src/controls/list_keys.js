// A long list of buttons is one stop of the Tab key; up, down, Home and End go through it. A key that moves the robot
// does only that.

const STEPS = { ArrowDown: (i) => i + 1, ArrowUp: (i) => i - 1, Home: () => 0, End: (_, last) => last };

/** box: holds the list's buttons, also those that come later. */
export function walkByKeys({ box, bindings }) {
  const buttons = () => [...box.querySelectorAll("button")];
  const stopAt = (one) => buttons().forEach((button) => (button.tabIndex = button === one ? 0 : -1));
  new MutationObserver(() => box.querySelector('button[tabindex="0"]') ?? stopAt(buttons()[0])).observe(box, { childList: true });
  box.addEventListener("focusin", (event) => event.target.matches("button") && stopAt(event.target));
  box.addEventListener("keydown", (event) => {
    const step = STEPS[event.key];
    if (!step || bindings.actionOf(event.code) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const all = buttons();
    all[Math.min(all.length - 1, Math.max(0, step(all.indexOf(document.activeElement), all.length - 1)))]?.focus();
  });
}
