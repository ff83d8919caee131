// All that shows and nothing that acts: 3D view, section, gauges, targets, warnings, strip chart, events.

import { SCALES, legendStops } from "./view/colours.js";
import { Compass } from "./view/compass.js";
import { Events } from "./panels/events.js";
import { Gauges } from "./panels/gauges.js";
import { Section } from "./view/section.js";
import { Stage } from "./view/stage.js";
import { Strip } from "./panels/strip.js";
import { TargetList, placeOf } from "./panels/target_list.js";
import { Theme } from "./panels/theme.js";
import { ViewBar } from "./panels/view_bar.js";
import { Warnings } from "./panels/warnings.js";
import { Anatomy } from "./view/anatomy.js";
import { byId, setText } from "./panels/elements.js";

const SLOW = { gauges: 90, section: 70, strip: 160 }; // ms between redrawings of each
const MOVED = 1e-3; // m, from which a moved outer tube is framed anew
const REACHED = /^target (.+) is reached$/; // as the server says it
const LATE = /^no command for /; // likewise
const seconds = () => performance.now() / 1e3;

export class Picture {
  constructor(store, query) {
    Object.assign(this, { store, query, framesDrawn: 0, isFresh: false, drawn: {}, beforeDrawing: () => {} });
    this.stage = makeStage((rate) => this.admitSlow(rate));
    this.anatomy = this.stage?.anatomy ?? new Anatomy();
    this.strip = new Strip(byId("strip"));
    this.events = new Events(byId("events"), (severity, text, ago) => this.strip.mark(severity, seconds() - ago, text));
    this.compass = new Compass(byId("compass"));
    this.gauges = new Gauges(byId("gauges"));
    this.warnings = new Warnings(byId("banner"), byId("warnings"));
    this.targets = new TargetList(byId("targets"), byId("targets-count"), (name) => this.choose(name));
    this.section = new Section(byId("section"), this.anatomy);
    this.viewBar = new ViewBar(this.stage, this.anatomy, (key) => this.colourBy(key));
    this.theme = new Theme(byId("theme"), () => this.touch());
    this.listen();
    this.colourBy("clearance");
    requestAnimationFrame(() => this.frame());
  }

  listen() {
    this.store.on("welcome", (message) => this.welcome(message));
    this.store.on("state", (state) => this.take(state));
    this.store.on("event", (event) => this.tell(event));
    this.store.on("error", (error) => this.events.add(error.text, "warning", this.store.time));
    this.store.on("connection", (isConnected) => this.connect(isConnected));
  }

  welcome({ scene, past }) {
    this.build(scene);
    this.recall(past);
  }

  connect(isConnected) {
    if (!isConnected) this.lost ??= seconds();
    this.touch();
  }

  /** What was told and shown while this page was not there, or not connected. */
  recall(past) {
    const missed = this.lost === undefined ? Infinity : seconds() - this.lost;
    this.lost = undefined;
    this.strip.recall(past, seconds(), missed);
    for (const event of past.events) if (event.ago < missed) this.list(event);
  }

  tell(event) {
    this.warnings.hear(event);
    if (LATE.test(event.text) && this.store.control.you) this.stage?.giveWay();
    this.list(event);
  }

  list({ text, severity, time, record, ago }) {
    const [, name] = text.match(REACHED) ?? [];
    const about = { ago, inRecord: record };
    if (name) this.events.add(`${placeOf(name)} ${name.split("@")[1]} reached`, "good", time, about);
    else this.events.add(this.named(text), severity, time, about);
  }

  /** Our own name, such as page-3, says nothing to who sits here. */
  named(text) {
    return text.replaceAll(new RegExp(`\\b${this.store.client}\\b`, "g"), "this page");
  }

  async build(scene) {
    const isKnown = JSON.stringify(scene) === this.scene;
    if (isKnown) return; // a reconnection: the meshes are there
    this.scene = JSON.stringify(scene);
    this.framed = scene.tube.height;
    for (const part of [this.gauges, this.targets, this.strip, this.section]) part.build(scene);
    const report = (text) => this.events.add(text, "warning");
    await (this.stage ? this.stage.build(scene, this.query, report) : this.anatomy.load(scene.phantom.structures, this.query, report));
    this.section.build(scene);
    this.viewBar.build();
    this.touch();
  }

  take(state) {
    this.strip.add(state, seconds());
    this.warnings.hear(state);
    if (Math.abs(state.tube.height - this.framed) > MOVED) this.stage?.frame(this.store.scene, state.tube);
    this.framed = state.tube.height;
    this.isFresh = true;
  }

  /** Said once: who drives must not take a slow picture for a slow robot. */
  admitSlow(rate) {
    const text = `This browser draws slowly (${Math.max(1, Math.round(rate))} frames/s): the picture is coarser for it, the controls do not wait for it`;
    this.events.add(text, "info", this.store.time);
  }

  choose(name) {
    if (this.stage) this.stage.targets.chosen = name;
    this.touch();
  }

  colourBy(key) {
    if (this.stage) this.stage.robot.colourBy = key;
    showLegend(SCALES[key]);
    this.touch();
  }

  /** Draws everything anew with the next frame. */
  touch() {
    this.isFresh = true;
    this.drawn = {};
    if (!this.theme) return;
    this.anatomy.dress(this.theme.colours);
    if (this.stage) this.stage.targets.isLight = this.theme.colours.isLight;
  }

  frame() {
    requestAnimationFrame(() => this.frame());
    const { state } = this.store;
    const now = performance.now();
    this.beforeDrawing();
    if (state && this.store.scene && this.isFresh) {
      this.stage?.update(state);
      this.isFresh = false;
      this.framesDrawn += 1;
      this.isBehind = true;
    }
    if (this.stage?.draw()) this.compass.draw(this.stage.camera, this.theme.colours);
    if (!state) return this.warnings.update(null, this.lostText());
    if (this.isDue("gauges", now)) this.panels(state);
    if (this.isBehind && this.isDue("section", now)) this.section.draw(state, this.theme.colours);
    if (this.isDue("strip", now)) this.strip.draw(seconds(), this.theme.colours);
    this.isBehind = false;
  }

  isDue(what, now) {
    const patience = this.stage?.isSlow ? 3 : 1;
    if (now - (this.drawn[what] ?? -Infinity) < patience * SLOW[what]) return false;
    this.drawn[what] = now;
    return true;
  }

  panels(state) {
    this.gauges.update(state);
    this.targets.update(state);
    this.warnings.update(state, this.lostText());
    setText(byId("section-level"), levelAt(this.store.scene.phantom.levels, state.tip[2]));
  }

  lostText() {
    return this.store.connected || !this.store.scene ? "" : "Connection lost: stopped. Connecting again …";
  }
}

/** The level at the height z (m), two names between them. */
function levelAt(levels, z) {
  const inside = levels.find((one) => z >= one.z_low && z <= one.z_high);
  if (inside) return inside.name;
  const above = levels.filter((one) => one.z_low > z).at(-1);
  const below = levels.find((one) => one.z_high < z);
  if (above && below) return `${above.name}–${below.name}`;
  return above ? `below ${above.name}` : below ? `above ${below.name}` : "";
}

function makeStage(onSlow) {
  try {
    return new Stage(byId("view"), onSlow);
  } catch {
    byId("view-missing").hidden = false; // no WebGL: the rest of the page needs none
    return null;
  }
}

function showLegend(scale) {
  const canvas = byId("scale");
  const context = canvas.getContext("2d");
  const blend = context.createLinearGradient(0, 0, canvas.width, 0);
  for (const [share, colour] of legendStops(scale)) blend.addColorStop(share, colour);
  context.fillStyle = blend;
  context.fillRect(0, 0, canvas.width, canvas.height);
  const last = scale.ticks.length - 1;
  setText(byId("legend-text"), scale.text);
  byId("ticks").replaceChildren(...scale.ticks.map((tick, i) => {
    const one = document.createElement("span");
    one.textContent = i === last ? `≥ ${tick}` : String(tick);
    one.style.left = `${(100 * tick) / scale.ticks[last]}%`;
    return one;
  }));
}
