// The robot: a tube around the centreline, coloured by clearance or pressure. Its arrays are made once and rewritten.

import { BufferAttribute, BufferGeometry, Group, Mesh, MeshBasicMaterial, MeshStandardMaterial, SphereGeometry, Vector3 } from "three";
import { bodyClearance } from "../units.js";
import { SCALES, paint } from "./colours.js";

const RINGS = 128;
const SIDES = 14;
const SHINE = { vertexColors: true, transparent: true, opacity: 0.4, depthTest: false, depthWrite: false };

export class RobotTube {
  constructor() {
    this.group = new Group();
    this.colourBy = "clearance";
    this.geometry = emptyTube();
    this.material = new MeshStandardMaterial({ vertexColors: true, roughness: 0.5 });
    this.tip = new Mesh(new SphereGeometry(1, 18, 12), new MeshStandardMaterial({ roughness: 0.5 }));
    const tube = new Mesh(this.geometry, this.material);
    this.shine = new Mesh(this.geometry, new MeshBasicMaterial(SHINE)); // the same again through whatever lies before it
    this.shine.renderOrder = 20;
    tube.frustumCulled = this.shine.frustumCulled = false;
    this.group.add(tube, this.shine, this.tip);
  }

  /** state: of the messages (m); radius: the tube's, mm. */
  update(state, radius) {
    const points = state.centerline.map((p) => new Vector3(...p).multiplyScalar(1e3));
    this.group.visible = points.length > 1;
    if (!this.group.visible) return;
    this.place(points.slice(0, RINGS), radius);
    this.colour(state, Math.min(points.length, RINGS));
    this.tip.position.copy(points.at(-1));
    this.tip.scale.setScalar(radius);
  }

  place(points, radius) {
    const position = this.geometry.attributes.position;
    const normal = this.geometry.attributes.normal;
    transported(points).forEach(({ across, up }, ring) => {
      for (let side = 0; side <= SIDES; side += 1) {
        const angle = (2 * Math.PI * side) / SIDES;
        const n = across.clone().multiplyScalar(Math.cos(angle)).addScaledVector(up, Math.sin(angle));
        normal.setXYZ(ring * (SIDES + 1) + side, n.x, n.y, n.z);
        n.multiplyScalar(radius).add(points[ring]);
        position.setXYZ(ring * (SIDES + 1) + side, n.x, n.y, n.z);
      }
    });
    position.needsUpdate = normal.needsUpdate = true;
    this.geometry.setDrawRange(0, 6 * SIDES * (points.length - 1));
  }

  colour(state, rings) {
    const scale = SCALES[this.colourBy];
    const values = this.colourBy === "pressure" ? state.pressure ?? [] : bodyClearance(state.clearance);
    const colour = this.geometry.attributes.color;
    for (let ring = 0; ring < rings; ring += 1) {
      const value = values[ring] ?? (this.colourBy === "pressure" ? 0 : values.at(-1));
      const first = 3 * ring * (SIDES + 1);
      paint(scale, scale.factor * value, colour.array, first);
      for (let side = 1; side <= SIDES; side += 1) colour.array.copyWithin(first + 3 * side, first, first + 3);
    }
    colour.needsUpdate = true;
    this.tip.material.color.setRGB(...colour.array.subarray(3 * (rings - 1) * (SIDES + 1)).slice(0, 3));
  }
}

function emptyTube() {
  const tube = new BufferGeometry();
  for (const name of ["position", "normal", "color"]) {
    tube.setAttribute(name, new BufferAttribute(new Float32Array(3 * RINGS * (SIDES + 1)), 3));
  }
  tube.setIndex(bands());
  return tube;
}

function bands() {
  const index = [];
  for (let ring = 0; ring + 1 < RINGS; ring += 1) {
    for (let side = 0; side < SIDES; side += 1) {
      const a = ring * (SIDES + 1) + side;
      const b = a + SIDES + 1;
      index.push(a, b, a + 1, b, b + 1, a + 1);
    }
  }
  return index;
}

/** Directions across the curve at each point, carried along without twist. */
function transported(points) {
  let across = null;
  return points.map((point, i) => {
    const along = points[Math.min(i + 1, points.length - 1)].clone().sub(points[Math.max(i - 1, 0)]).normalize();
    across = (across ?? leastAlong(along)).addScaledVector(along, -across?.dot(along) || 0).normalize();
    return { across: across.clone(), up: along.clone().cross(across) };
  });
}

function leastAlong(along) {
  const axis = Math.abs(along.x) < 0.8 ? new Vector3(1, 0, 0) : new Vector3(0, 1, 0);
  return axis.addScaledVector(along, -axis.dot(along)).normalize();
}
