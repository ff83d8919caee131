// Targets as rings of their tolerance around the cord's axis direction; a reached one is filled and green.

import { DoubleSide, Group, Mesh, MeshBasicMaterial, SphereGeometry, TorusGeometry } from "three";

const COLOURS = { waiting: "#7f8ea0", next: "#ffd166", reached: "#35c98f" };

export class TargetRings {
  constructor() {
    this.group = new Group();
    this.rings = new Map();
    this.chosen = null;
  }

  build(targets) {
    this.group.clear();
    this.rings.clear();
    for (const target of targets) this.rings.set(target.name, this.add(target));
  }

  add(target) {
    const radius = 1e3 * target.tolerance;
    const one = new Group();
    const ring = new Mesh(new TorusGeometry(radius, Math.max(0.07, 0.06 * radius), 8, 40), flat());
    const core = new Mesh(new SphereGeometry(radius, 20, 14), flat(0.12));
    ring.renderOrder = core.renderOrder = 9;
    one.add(ring, core);
    one.position.set(...target.position.map((x) => 1e3 * x));
    this.group.add(one);
    return { one, ring, core };
  }

  update(state) {
    const reached = new Set(state.reached);
    for (const [name, { one, ring, core }] of this.rings) {
      const kind = reached.has(name) ? "reached" : name === this.chosen ? "next" : "waiting";
      for (const mesh of [ring, core]) mesh.material.color.set(COLOURS[kind]);
      core.material.opacity = kind === "reached" ? 0.45 : kind === "next" ? 0.25 : 0.06;
      ring.material.opacity = kind === "waiting" ? 0.55 : 1;
      one.scale.setScalar(name === this.chosen ? 1.06 : 1);
    }
  }
}

function flat(opacity = 1) {
  return new MeshBasicMaterial({ transparent: true, opacity, side: DoubleSide, depthWrite: false });
}
