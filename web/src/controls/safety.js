// Everything that must stop the robot from the page's side.

import { isTextField } from "./keys.js";

/** Calls `halt(reason)` on a lost focus, a hidden or left page, a field to type in, and Escape (which also tells the server). */
export function guard({ halt, stop }) {
  window.addEventListener("blur", () => halt("The page lost the focus"));
  window.addEventListener("pagehide", () => halt("The page was left"));
  document.addEventListener("visibilitychange", () => document.hidden && halt("The page is hidden"));
  document.addEventListener("focusin", (event) => isTextField(event.target) && halt("A field to type in has the focus"));
  window.addEventListener("keydown", (event) => event.code === "Escape" && stop("Escape"), { capture: true });
}
