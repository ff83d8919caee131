// The first drive: what to hold, in a few lines over the view, until it is put away. Remembered by the browser.

import { byId, element } from "./elements.js";

const STORED = "tendonrod.hint";
const AS_BEGUN = 1e-3; // m and rad, within which the outer tube is where a recipe begins

/** Ways that arrive by hand from the standard pose of the outer tube, with the standard rates; each is tested as a script. */
const RECIPES = [
  { kind: "printed", offset: 1.5e-3, tilt: 22, lean: 8, tension: "0.7 N", gives: ([at, next]) => `it passes lateral right ${at} and, 54 mm out, reaches ventral ${next}` },
  { kind: "anatomical", offset: -1.5e-3, tilt: 32, lean: 1, tension: "0.47 N", gives: ([, next]) => `42 mm out it reaches DRG right ${next}` },
];

export class Hint {
  constructor({ store, bindings }) {
    Object.assign(this, { store, bindings, isWanted: !isPutAway() });
    byId("hint-close").addEventListener("click", () => this.want(false));
    byId("hint-again").addEventListener("click", () => {
      byId("settings-dialog").close();
      this.want(true);
    });
    store.on("welcome", ({ scene }) => {
      this.recipe = recipeFor(scene);
      this.fill();
    });
    bindings.onChange(() => this.fill());
    for (const type of ["welcome", "connection", "state"]) store.on(type, () => this.show());
    this.fill();
  }

  want(isWanted) {
    this.isWanted = isWanted;
    try {
      if (isWanted) localStorage.removeItem(STORED);
      else localStorage.setItem(STORED, "put away");
    } catch {
      // not remembered, put away until the page is left
    }
    this.show();
  }

  /** In the way of a replay, and of a fault. */
  show() {
    const { connected, isReplaying, state } = this.store;
    byId("hint").hidden = !this.isWanted || !connected || isReplaying || Boolean(state?.fault);
  }

  fill() {
    const key = (action) => element("kbd", {}, this.bindings.letter(this.bindings.keys[action]));
    const steps = [
      ["Take control."],
      ["Hold ", key("tension+"), ` to pull${this.recipe ? ` until ${this.recipe.tension}` : ""}, then `, key("insertion+"), this.recipe ? ` to insert: ${this.recipe.gives}.` : " to insert. Without tension the robot goes straight on."],
      [key("rotation-"), " ", key("rotation+"), " turn the side to which it bends; ", key("insertion-"), " ", key("tension-"), " go back."],
      ["Let go to stop; ", element("kbd", {}, "Esc"), " stops everything."],
      ["The filled ring is the nearest target."],
    ];
    byId("hint-steps").replaceChildren(...steps.map((parts) => element("li", {}, ...parts)));
  }
}

function isPutAway() {
  try {
    return localStorage.getItem(STORED) !== null;
  } catch {
    return false;
  }
}

/** The way to tell of this scene, with its targets by name; null where none was tried. */
function recipeFor({ robot, phantom, tube }) {
  const found = RECIPES.find((one) => one.kind === phantom.kind && robot.name === "exonav-1"
    && near(tube.offset, one.offset) && near(tube.tilt, radians(one.tilt)) && near(tube.lean, radians(one.lean)));
  const entry = phantom.levels.findIndex((level) => near(level.entry_height, tube.height));
  if (!found || entry < 1 || entry !== phantom.levels.length - 1) return null;
  return { tension: found.tension, gives: found.gives([phantom.levels[entry].name, phantom.levels[entry - 1].name]) };
}

const near = (a, b) => Math.abs(a - b) < AS_BEGUN;
const radians = (degrees) => (degrees * Math.PI) / 180;
