// Where the camera stands: fixed directions of anatomy, and one that goes along with the tip.

import { Vector3 } from "three";

/** Direction from the looked-at point to the camera: +x dorsal, +y the patient's right, +z cranial (up in the picture). */
export const PRESETS = {
  Oblique: new Vector3(1, 0.9, 0.55),
  Whole: new Vector3(1, 0.9, 0.35),
  Dorsal: new Vector3(1, 0, 0),
  Ventral: new Vector3(-1, 0, 0),
  Left: new Vector3(0, -1, 0),
  Right: new Vector3(0, 1, 0),
  Cranial: new Vector3(-0.002, 0, 1), // a hair off the pole, so that dorsal is up
};

const ABOVE = 4; // mm

export class Cameras {
  /** onPreset(name): called with the direction in which it looks from now on, "" once the user has turned it. */
  constructor(camera, controls, onPreset = () => {}) {
    Object.assign(this, { camera, controls, onPreset, isFollowing: false, preset: "Oblique" });
    this.reach = this.whole = { centre: new Vector3(), size: 40 };
    this.tip = null;
    controls.addEventListener("start", () => this.leave());
  }

  /** What to look at, each {centre, size}: the middle and half the height (mm) of the robot's reach, and of all. */
  frame(reach, whole) {
    Object.assign(this, { reach, whole });
    this.go(this.preset);
  }

  /** Turned by hand: nothing is cut off any more as from above. */
  leave() {
    this.cut(false);
    this.onPreset("");
  }

  go(name) {
    this.preset = name;
    this.onPreset(name);
    const isAbove = name === "Cranial";
    const isWhole = name === "Whole";
    const { centre, size: most } = isWhole ? this.whole : this.reach;
    const target = this.tip && !isWhole && (this.isFollowing || isAbove) ? this.tip.clone() : centre.clone();
    if (isAbove) target.x = target.y = 0;
    const size = isAbove ? 13 : this.isFollowing && !isWhole ? 16 : most;
    this.controls.target.copy(target);
    this.camera.position.copy(PRESETS[name]).normalize().multiplyScalar(this.distance(size)).add(target);
    this.controls.update();
    this.cut(isAbove);
  }

  distance(size) {
    return (1.04 * size) / Math.tan((this.camera.fov * Math.PI) / 360);
  }

  /** From above, what lies more than a little cranial of the tip is cut off, or it would hide the section. */
  cut(isCut) {
    this.isCut = isCut;
    this.camera.near = isCut ? Math.max(1, this.camera.position.z - (this.tip?.z ?? 0) - ABOVE) : 1;
    this.camera.updateProjectionMatrix();
  }

  follow(isFollowing) {
    this.isFollowing = isFollowing;
    this.go(this.preset);
  }

  /** Goes along with the tip (mm), keeping the direction and distance the user chose. */
  track(tip) {
    const moved = (this.isFollowing || this.isCut) && this.tip ? tip.clone().sub(this.tip) : null;
    this.tip = tip.clone();
    if (!moved) return;
    if (this.isCut) moved.x = moved.y = 0;
    this.controls.target.add(moved);
    this.camera.position.add(moved);
  }
}
