// Building blocks of the panels.

export const byId = (id) => document.getElementById(id);

/** A new element: element("button", {className: "x"}, "text", child, ...). */
export function element(tag, properties = {}, ...children) {
  const one = Object.assign(document.createElement(tag), properties);
  one.append(...children);
  return one;
}

/** Sets text only where it differs, so that nothing is laid out or read aloud anew for no change. */
export function setText(one, text) {
  if (one.textContent !== text) one.textContent = text;
}

/** Makes a dialog's [data-close] buttons close it. */
export function closable(dialog) {
  for (const button of dialog.querySelectorAll("[data-close]")) button.addEventListener("click", () => dialog.close());
  return dialog;
}
