// The three-dimensional view: anatomy, robot, outer tube, targets, contacts, camera.

import {
  DirectionalLight, HemisphereLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Anatomy } from "./anatomy.js";
import { Cameras } from "./cameras.js";
import { ContactArrows } from "./contacts.js";
import { OuterTubeView, exitOf } from "./outer_tube.js";
import { RobotTube } from "./robot.js";
import { TargetRings } from "./targets.js";

const [BELOW, ABOVE] = [12, 4]; // mm shown beyond the outer tube's exit and the robot's reach
const SLOW_MS = 45; // a frame that keeps the page busy for longer is drawn with fewer pixels from then on
const BLURRIEST = 0.6; // pixels of the drawing per pixel of the page, at the least
const WARMING = 4; // drawings before they are judged: the first ones prepare the graphics
const FEW = 15; // frames/s: what is slower is told
const LONGEST_MS = 700; // without a picture
const WATCHED = 20; // drawings over which that is judged

export class Stage {
  /** onSlow(frames per second): called once where the browser draws slowly. */
  constructor(canvas, onSlow = () => {}) {
    Object.assign(this, { canvas, onSlow, count: 0, spent: 0, isSlow: false, pause: 1.5 });
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(32, 1, 1, 2000);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
    this.controls.addEventListener("change", () => (this.isStale = true));
    this.cameras = new Cameras(this.camera, this.controls);
    this.anatomy = new Anatomy();
    this.robot = new RobotTube();
    this.tube = new OuterTubeView();
    this.targets = new TargetRings();
    this.contacts = new ContactArrows();
    this.scene.add(...[this.anatomy, this.robot, this.tube, this.targets, this.contacts].map((part) => part.group));
    this.light();
    this.watchSize();
    Object.assign(this, { isStale: true, sharpness: Math.min(2, globalThis.devicePixelRatio || 1), slow: 0, begun: null, next: 0 });
  }

  light() {
    const key = new DirectionalLight("#ffffff", 2.2);
    key.position.set(60, 50, 90);
    this.camera.add(key);
    this.scene.add(this.camera, new HemisphereLight("#ffffff", "#9aa0aa", 2));
  }

  watchSize() {
    new ResizeObserver(() => this.resize()).observe(this.canvas);
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setPixelRatio(this.sharpness);
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.isStale = true;
  }

  /** A new scene of the welcome message; resolves when the anatomy is there. */
  async build(scene, query, report) {
    this.radius = 1e3 * scene.robot.outer_radius;
    this.targets.build(scene.phantom.targets);
    this.frame(scene, scene.tube);
    await this.anatomy.load(scene.phantom.structures, query, report);
    this.isStale = true;
  }

  /** The camera looks at where a robot from this outer tube can go. */
  frame(scene, tube) {
    const tops = scene.phantom.levels.map((level) => 1e3 * level.z_high);
    const bottoms = scene.phantom.levels.map((level) => 1e3 * level.z_low);
    const { at } = exitOf(tube);
    const ends = [at.z - BELOW, at.z + 1e3 * scene.robot.length + ABOVE];
    this.cameras.frame(span(ends), span([Math.min(at.z, ...bottoms) - BELOW, Math.max(...tops) + ABOVE]));
  }

  update(state) {
    this.robot.update(state, this.radius);
    this.tube.update(state.tube, this.radius);
    this.targets.update(state);
    this.contacts.update(state.contacts ?? []);
    this.cameras.track(new Vector3(...state.tip).multiplyScalar(1e3));
    this.isStale = true;
  }

  /** Draws if anything changed, and says whether it did. Called once per frame of the browser; leaves a slow machine time for the controls. */
  draw() {
    const now = performance.now();
    if (this.begun !== null) this.pace(now);
    if (!this.isStale || now < this.next) return false;
    this.renderer.render(this.scene, this.camera);
    this.isStale = false;
    this.begun = now;
    return true;
  }

  /** A drawing is not over when its call returns, but when the browser comes back with its next frame. */
  pace(now) {
    const took = now - this.begun;
    this.begun = null;
    this.count += 1;
    if (this.count <= WARMING) return;
    this.next = took > SLOW_MS ? now + Math.min(this.pause * took, LONGEST_MS) : 0;
    this.slow = took > SLOW_MS ? this.slow + 1 : 0;
    this.judge(took);
    if (this.slow < 2) return;
    this.slow = 0;
    if (!this.anatomy.isCoarse) return this.coarsen();
    if (this.sharpness <= BLURRIEST) return;
    this.sharpness = Math.max(BLURRIEST, this.sharpness * Math.max(0.6, Math.sqrt(SLOW_MS / took)));
    this.resize();
  }

  /** Where the controls came too late although they were sent in time, drawing in software takes the server's time too. */
  giveWay() {
    this.pause = Math.min(1.5 * this.pause, 8);
  }

  /** Most of a slow browser's time goes into triangles. */
  coarsen() {
    this.anatomy.coarsen();
    this.targets.isCoarse = true;
    this.isStale = true;
  }

  judge(took) {
    this.spent += took > SLOW_MS ? took + Math.min(this.pause * took, LONGEST_MS) : took;
    if (this.isSlow || (this.count - WARMING) % WATCHED) return;
    const rate = (1e3 * WATCHED) / this.spent;
    this.spent = 0;
    this.isSlow = rate < FEW;
    if (this.isSlow) this.onSlow(rate);
  }
}

/** Middle (mm, on the cord's axis) and half the height (mm) of what lies between two heights. */
function span([from, to]) {
  return { centre: new Vector3(0, 0, (from + to) / 2), size: (to - from) / 2 };
}
