// The first drive: what to hold, in a few lines over the view, until it has arrived or is put away. Remembered by the
// browser. Where there is little room only the present step is shown.

import { byId, element, setText } from "./elements.js";

const STORED = "tendonrod.hint";
const NARROW = 720; // px of the view, below which all steps, or long warnings, would hide the robot
const LOW = 440;
const ENOUGH = 0.97; // of the tension to pull to
const AS_BEGUN = 1e-3; // m and rad, within which the outer tube is where a recipe begins

/** Ways that arrive by hand from the standard pose of the outer tube, with the standard rates; each is tested as a script. */
const RECIPES = [
  { kind: "printed", offset: 1.5e-3, tilt: 22, lean: 8, tension: 0.7, goal: "ventral", gives: ([at, next]) => `it passes lateral right ${at} and, 54 mm out, reaches ventral ${next}` },
  { kind: "anatomical", offset: -1.5e-3, tilt: 32, lean: 1, tension: 0.47, goal: "drg-right", gives: ([, next]) => `42 mm out it reaches DRG right ${next}` },
];

export class Hint {
  constructor({ store, bindings }) {
    Object.assign(this, { store, bindings, isWanted: !isPutAway() });
    byId("hint-close").addEventListener("click", () => this.want(false));
    byId("hint-again").addEventListener("click", () => {
      byId("settings-dialog").close();
      this.want(true);
    });
    for (const type of ["welcome", "state"]) store.on(type, () => this.choose());
    bindings.onChange(() => this.fill());
    for (const type of ["connection", "control", "state"]) store.on(type, () => this.show());
    const stage = byId("hint").closest(".stage");
    new ResizeObserver(() => stage.classList.toggle("is-short", stage.clientWidth < NARROW || stage.clientHeight < LOW)).observe(stage);
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

  /** The way to tell of, which holds for one place of the outer tube only. */
  choose() {
    const { scene, state, canReset } = this.store;
    const where = JSON.stringify([state?.tube, scene.phantom.kind, canReset]);
    if (!state || where === this.where) return;
    this.where = where;
    this.recipe = recipeFor(scene, state.tube);
    this.fill();
  }

  /** In the way of a replay, and of a fault; of no use once it has arrived. */
  show() {
    const { connected, isReplaying, state } = this.store;
    if (this.isWanted && !isReplaying && state?.moving && state.reached.includes(this.recipe?.goal)) this.want(false);
    byId("hint").hidden = !this.isWanted || !connected || isReplaying || Boolean(state?.fault);
    if (!byId("hint").hidden) this.mark();
  }

  /** The step that is to be done now. */
  mark() {
    const { control, state } = this.store;
    const isPulled = !this.recipe || Math.max(...(state?.tension ?? [0])) >= ENOUGH * this.recipe.tension || state.insertion > 0;
    const now = !control.you ? 0 : !isPulled ? 1 : this.recipe ? 2 : 1;
    const steps = [...byId("hint-steps").children];
    setText(steps[0], control.operator && !control.free && !control.you ? `${control.operator} has control: take it once it is released.` : "Take control.");
    steps.forEach((one, i) => one.classList.toggle("now", i === now));
  }

  fill() {
    const key = (action) => element("kbd", {}, this.bindings.letter(this.bindings.keys[action]));
    const steps = [
      ["Take control."],
      ...this.drive(key),
      [key("rotation-"), "\u00a0", key("rotation+"), " turn the side to which it bends; ", key("insertion-"), "\u00a0", key("tension-"), " go back."],
      ["Let go to stop; ", element("kbd", {}, "Esc"), " stops everything."],
      ["The filled ring is the nearest target."],
    ];
    byId("hint-steps").replaceChildren(...steps.map((parts) => element("li", {}, ...parts)));
    this.mark();
  }

  drive(key) {
    const { recipe } = this;
    const slow = this.store.canReset ? "" : " A bench takes its time for that, two minutes perhaps.";
    if (!recipe) return [["Hold ", key("tension+"), " to pull, then ", key("insertion+"), ` to insert. Without tension the robot goes straight on.${slow}`]];
    return [
      ["Hold ", key("tension+"), ` to pull until ${recipe.tension} N.`],
      ["Hold ", key("insertion+"), ` to insert: ${recipe.gives}.${slow}`],
    ];
  }
}

function isPutAway() {
  try {
    return localStorage.getItem(STORED) !== null;
  } catch {
    return false;
  }
}

/** The way to tell of this scene and outer tube, with its targets by name; null where none was tried. */
function recipeFor({ robot, phantom }, tube) {
  const found = RECIPES.find((one) => one.kind === phantom.kind && robot.name === "exonav-1"
    && near(tube.offset, one.offset) && near(tube.tilt, radians(one.tilt)) && near(tube.lean, radians(one.lean)));
  const entry = phantom.levels.findIndex((level) => near(level.entry_height, tube.height));
  if (!found || entry < 1 || entry !== phantom.levels.length - 1) return null;
  const [at, next] = [phantom.levels[entry].name, phantom.levels[entry - 1].name];
  return { tension: found.tension, goal: `${found.goal}@${next}`, gives: found.gives([at, next]) };
}

const near = (a, b) => Math.abs(a - b) < AS_BEGUN;
const radians = (degrees) => (degrees * Math.PI) / 180;
