// The axial section at the tip, seen from cranial with dorsal up: cut from the same meshes as the 3D view.

import { SCALES, inkOf, paint } from "./colours.js";
import { fitted } from "../panels/canvas.js";
import { bodyClearance, fixed } from "../units.js";

const MARGIN = 1.25; // picture's half width over the reach of cord and canal
const NEAR_LEVEL = 6; // mm along the cord within which a target belongs to the section

export class Section {
  constructor(canvas, anatomy) {
    Object.assign(this, { canvas, anatomy, half: 12, targets: [], radius: 0.6 });
  }

  build(scene) {
    this.targets = scene.phantom.targets;
    this.radius = 1e3 * scene.robot.outer_radius;
    const inside = this.anatomy.parts.filter((part) => ["cord", "dura"].includes(part.role));
    this.half = MARGIN * Math.max(8, ...inside.map((part) => reachAcross(part.slicer.positions))) + 2;
  }

  draw(state, theme) {
    const { context, width, height } = fitted(this.canvas);
    const scale = Math.min(width, height) / (2 * this.half);
    const at = ([x, y]) => [width / 2 - scale * y, height / 2 - scale * x]; // right in the picture is the patient's left
    const [x, y, z] = state.tip.map((value) => 1e3 * value);
    context.clearRect(0, 0, width, height);
    this.tissue(context, at, z, theme);
    this.rings(context, at, scale, z, state, theme);
    this.body(context, at, scale, state, [x, y], theme);
    labels(context, width, height, theme);
    scaleBar(context, width, height, scale, theme);
    write(context, `z ${fixed(z, 1)} mm`, "right", [width - 8, height - 8], theme);
  }

  tissue(context, at, z, theme) {
    for (const part of this.anatomy.parts) {
      if (!part.mesh.visible) continue;
      context.beginPath();
      for (const loop of part.slicer.cut(z)) trace(context, loop.map(at));
      context.globalAlpha = part.role === "cord" ? 0.75 : part.role === "bone" || part.is_wall ? 0.28 : 0.14;
      context.fillStyle = context.strokeStyle = inkOf(part.look, theme);
      context.fill("evenodd");
      context.globalAlpha = 0.95;
      context.lineWidth = 1.2;
      context.stroke();
      context.globalAlpha = 1;
    }
  }

  rings(context, at, scale, z, state, theme) {
    for (const target of this.targets) {
      const [x, y, height] = target.position.map((value) => 1e3 * value);
      if (Math.abs(height - z) > NEAR_LEVEL) continue;
      context.beginPath();
      context.arc(...at([x, y]), 1e3 * target.tolerance * scale, 0, 2 * Math.PI);
      context.globalAlpha = 1 - 0.7 * (Math.abs(height - z) / NEAR_LEVEL);
      context.strokeStyle = state.reached?.includes(target.name) ? theme.good : theme.target;
      context.lineWidth = 2;
      context.stroke();
      context.globalAlpha = 1;
    }
  }

  /** The body behind the tip as a trace, the tip as a disc of the tube's size in its colour. */
  body(context, at, scale, state, tip, theme) {
    context.beginPath();
    state.centerline.forEach(([x, y], i) => context[i ? "lineTo" : "moveTo"](...at([1e3 * x, 1e3 * y])));
    context.strokeStyle = theme.trace;
    context.lineWidth = 1.5;
    context.stroke();
    const colour = [0, 0, 0];
    paint(SCALES.clearance, 1e3 * (bodyClearance(state.clearance).at(-1) ?? 9), colour, 0);
    context.beginPath();
    context.arc(...at(tip), this.radius * scale, 0, 2 * Math.PI);
    context.fillStyle = `rgb(${colour.map((value) => Math.round(255 * value)).join(" ")})`;
    context.fill();
    context.strokeStyle = theme.text;
    context.stroke();
  }
}

function reachAcross(positions) {
  let reach = 0;
  for (let i = 0; i < positions.length; i += 3) reach = Math.max(reach, Math.abs(positions[i]), Math.abs(positions[i + 1]));
  return reach;
}

function trace(context, points) {
  points.forEach((point, i) => context[i ? "lineTo" : "moveTo"](...point));
  context.closePath();
}

function labels(context, width, height, theme) {
  write(context, "Dorsal", "center", [width / 2, 14], theme);
  write(context, "Ventral", "center", [width / 2, height - 8], theme);
  write(context, "R", "left", [8, 14], theme);
  write(context, "L", "right", [width - 8, 14], theme);
}

/** Words with a rim of the ground, so that they can be read over tissue. */
function write(context, text, align, [x, y], theme) {
  Object.assign(context, { font: theme.font, textBaseline: "alphabetic", textAlign: align, lineWidth: 3, lineJoin: "round",
    strokeStyle: theme.ground, fillStyle: theme.text });
  context.strokeText(text, x, y);
  context.fillText(text, x, y);
}

function scaleBar(context, width, height, scale, theme) {
  const length = 5;
  for (const [colour, lineWidth] of [[theme.ground, 5], [theme.text, 2]]) {
    Object.assign(context, { strokeStyle: colour, lineWidth });
    context.beginPath();
    context.moveTo(8, height - 22);
    context.lineTo(8 + length * scale, height - 22);
    context.stroke();
  }
  write(context, `${length} mm`, "left", [8, height - 8], theme);
}
