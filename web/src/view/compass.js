// Small arrows that say which way dorsal, cranial and the patient's sides lie in the view.

import { Vector3 } from "three";
import { fitted } from "../panels/canvas.js";

const DIRECTIONS = { D: [1, 0, 0], V: [-1, 0, 0], R: [0, 1, 0], L: [0, -1, 0], Cr: [0, 0, 1], Cd: [0, 0, -1] };
const REACH = 0.36; // of the picture

export class Compass {
  constructor(canvas) {
    this.canvas = canvas;
  }

  draw(camera, theme) {
    const { context, width, height } = fitted(this.canvas);
    context.clearRect(0, 0, width, height);
    context.font = theme.font;
    context.textAlign = "center";
    context.textBaseline = "middle";
    const turn = camera.quaternion.clone().invert();
    const seen = Object.entries(DIRECTIONS).map(([name, axis]) => [name, new Vector3(...axis).applyQuaternion(turn)]);
    seen.sort((a, b) => a[1].z - b[1].z); // those that point away first
    for (const [name, at] of seen) ray(context, name, [width / 2 + REACH * width * at.x, height / 2 - REACH * height * at.y], at.z, [width / 2, height / 2], theme);
  }
}

function ray(context, name, [x, y], nearness, [cx, cy], theme) {
  context.globalAlpha = nearness < -0.3 ? 0.3 : 0.95;
  context.strokeStyle = theme.quiet;
  context.beginPath();
  context.moveTo(cx, cy);
  context.lineTo(cx + 0.78 * (x - cx), cy + 0.78 * (y - cy));
  context.stroke();
  context.fillStyle = theme.text;
  if (Math.hypot(x - cx, y - cy) > 8) context.fillText(name, x, y);
  context.globalAlpha = 1;
}
