// Targets as rings of their tolerance around the cord's axis direction; a reached one is filled and green.

import { DoubleSide, Group, Mesh, MeshBasicMaterial, SphereGeometry, TorusGeometry } from "three";
import { nearestOf } from "../units.js";

/** On dark, on light; told from tissue, robot and contact arrows. */
const COLOURS = {
  waiting: ["#a99bff", "#6a4bd8"], nearest: ["#ffffff", "#2a1a80"], chosen: ["#ffd166", "#b97a00"], reached: ["#35c98f", "#0f8a56"],
};
const FILL = { waiting: 0.1, nearest: 0.22, chosen: 0.28, reached: 0.5 };

export class TargetRings {
  constructor() {
    this.group = new Group();
    this.rings = new Map();
    this.chosen = null;
    this.isLight = this.isCoarse = false;
  }

  build(targets) {
    this.group.clear();
    this.rings.clear();
    for (const target of targets) this.rings.set(target.name, this.add(target));
  }

  add(target) {
    const radius = 1e3 * target.tolerance;
    const one = new Group();
    const ring = new Mesh(new TorusGeometry(radius, Math.max(0.12, 0.1 * radius), 5, 28), flat());
    const core = new Mesh(new SphereGeometry(radius, 14, 9), flat(0.12));
    ring.renderOrder = core.renderOrder = 9;
    one.add(ring, core);
    one.position.set(...target.position.map((x) => 1e3 * x));
    this.group.add(one);
    return { one, ring, core };
  }

  update(state) {
    const reached = new Set(state.reached);
    const nearest = nearestOf(state);
    for (const [name, { one, ring, core }] of this.rings) {
      const kind = reached.has(name) ? "reached" : name === this.chosen ? "chosen" : name === nearest ? "nearest" : "waiting";
      for (const mesh of [ring, core]) mesh.material.color.set(COLOURS[kind][this.isLight ? 1 : 0]);
      core.material.opacity = FILL[kind];
      core.visible = !this.isCoarse || kind !== "waiting";
      ring.material.opacity = kind === "waiting" ? 0.85 : 1;
      one.scale.setScalar(kind === "chosen" || kind === "nearest" ? 1.12 : 1);
    }
  }
}

function flat(opacity = 1) {
  return new MeshBasicMaterial({ transparent: true, opacity, side: DoubleSide, depthWrite: false });
}
