// Arrows at the places of contact: the push of the robot on the tissue, long by force.

import { ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Vector3 } from "three";

const MOST = 32;
export const PER_NEWTON = 250; // mm of arrow per newton
const RANGE = [2, 14]; // mm
const UP = new Vector3(0, 1, 0);

export class ContactArrows {
  constructor() {
    this.group = new Group();
    const material = new MeshBasicMaterial({ color: "#ff4d8d", transparent: true, opacity: 0.95, depthTest: false });
    const shaft = new CylinderGeometry(0.14, 0.14, 1, 8).translate(0, -0.5, 0);
    const head = new ConeGeometry(0.42, 1.2, 14).translate(0, -0.6, 0);
    this.arrows = Array.from({ length: MOST }, () => arrow(shaft, head, material));
    this.group.add(...this.arrows);
  }

  /** contacts: {point (m), force on the robot (N)}; the arrow ends at the point and shows the reaction. */
  update(contacts) {
    this.arrows.forEach((one, i) => this.aim(one, contacts[i]));
  }

  aim(one, contact) {
    const force = contact && new Vector3(...contact.force).negate();
    const size = force?.length() ?? 0;
    one.visible = size > 1e-6;
    if (!one.visible) return;
    one.position.set(...contact.point.map((x) => 1e3 * x));
    one.quaternion.setFromUnitVectors(UP, force.divideScalar(size));
    one.children[0].scale.y = Math.min(RANGE[1], Math.max(RANGE[0], PER_NEWTON * size));
  }
}

function arrow(shaft, head, material) {
  const one = new Group();
  one.add(new Mesh(shaft, material), new Mesh(head, material));
  one.visible = false;
  for (const part of one.children) part.renderOrder = 21; // through whatever lies before it, as the robot
  return one;
}
