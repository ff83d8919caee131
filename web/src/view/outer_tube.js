// The outer tube at the robot's entry. Height, offset, depth, tilt and lean are the server's OuterTube.

import { CylinderGeometry, DoubleSide, Group, Mesh, MeshStandardMaterial, RingGeometry, Vector3 } from "three";

const LENGTH = 34; // mm drawn; how long the real one is plays no part
const UP = new Vector3(0, 1, 0);

/** Where the tube ends (mm) and its direction: +x dorsal, +y the patient's right, +z cranial; lean points it ventrally. */
export function exitOf(tube) {
  const direction = new Vector3(-Math.sin(tube.lean), Math.sin(tube.tilt) * Math.cos(tube.lean), Math.cos(tube.tilt) * Math.cos(tube.lean));
  return { at: new Vector3(tube.depth, tube.offset, tube.height).multiplyScalar(1e3), direction };
}

export class OuterTubeView {
  constructor() {
    this.group = new Group();
    this.material = new MeshStandardMaterial({ color: "#a9b4bd", roughness: 0.35, metalness: 0.65, side: DoubleSide });
    this.body = new Mesh(new CylinderGeometry(1, 1, LENGTH, 28, 1, true), this.material);
    this.rim = new Mesh(new RingGeometry(0.8, 1, 28), this.material);
    this.body.position.y = -LENGTH / 2;
    this.rim.rotation.x = -Math.PI / 2;
    this.group.add(this.body, this.rim);
  }

  update(tube, radius) {
    const { at, direction } = exitOf(tube);
    this.group.position.copy(at);
    this.group.quaternion.setFromUnitVectors(UP, direction);
    this.group.scale.set(1.3 * radius, 1, 1.3 * radius);
  }
}
