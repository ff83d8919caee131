// Turns and zooms the 3D view by the keyboard while the view has the focus; a key that moves the robot does only that.

const TURN = Math.PI / 36;
const ZOOM = 0.92;

const DEEDS = {
  ArrowLeft: (controls) => controls.rotateLeft(TURN),
  ArrowRight: (controls) => controls.rotateLeft(-TURN),
  ArrowUp: (controls) => controls.rotateUp(TURN),
  ArrowDown: (controls) => controls.rotateUp(-TURN),
  "+": (controls) => controls.dollyIn(ZOOM),
  "=": (controls) => controls.dollyIn(ZOOM),
  "-": (controls) => controls.dollyOut(ZOOM),
};

/** canvas: of the view. cameras: of its stage; null where there is none. */
export function turnByKeys({ canvas, cameras, bindings }) {
  if (!cameras) return;
  canvas.addEventListener("keydown", (event) => {
    const deed = DEEDS[event.key];
    if (!deed || bindings.actionOf(event.code) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    cameras.leave();
    deed(cameras.controls);
  });
}
