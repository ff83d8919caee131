"""Progressive motion: insertion, rotation and tension over time give the exposed shapes (paper, II-C)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import Fact, InvalidInput, NotConverged, numbers, whole
from ..robot import Robot, as_robot
from ..statics.equilibrium import solve
from ..statics.shape import Shape


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Motion:
    """Shapes of a progressive motion in order, with the commands that gave them.

    insertion (n,) in [0, 1]; rotation (n,) rad; tension (n, n_tendons) N; shapes: n `Shape`.
    """

    robot: Robot
    insertion: np.ndarray
    rotation: np.ndarray
    tension: np.ndarray
    shapes: tuple[Shape, ...]

    def __post_init__(self) -> None:
        for array in (self.insertion, self.rotation, self.tension):
            array.setflags(write=False)

    def __repr__(self) -> str:
        return f"Motion({self.robot.name}, {len(self.shapes)} steps)"

    @property
    def tip(self) -> np.ndarray:
        """(n, 3) path of the tip of the neutral axis, m, world frame."""
        return np.array([shape.tip for shape in self.shapes]).reshape(-1, 3)


def progress(robot: Robot, insertion, rotation, tension, samples: int | None = None, watch=None, **loads) -> Motion:
    """Solve a sequence of configurations, each started from the one before.

    - insertion (n,), rotation (n,) rad, tension (n,) or (n, n_tendons) N; a single number holds throughout. Rotation is
      that of the section frame at the outer tube's exit; 0 throughout is the paper's follow-the-leader law
      phi_p = 2 pi turns (eta - 1).
    - samples: sections per shape, evenly spread over the exposed length (None: the integrator's nodes).
    - watch(done, n) is called after each step.
    - loads: gravity, tip_force and the other keywords of `tendonrod.solve`; where tendons rub, the shape before is the
      history that friction holds on to.

    Raises `InvalidInput` and `NotConverged`, both of which name the row.
    """
    insertion, rotation, tension = _table(as_robot(robot), insertion, rotation, tension)
    samples = None if samples is None else whole("samples", samples, 2)
    shapes: list[Shape] = []
    for k, (eta, phi, tau) in enumerate(zip(insertion.tolist(), rotation.tolist(), tension, strict=True)):
        shapes.append(_step(robot, k, eta, phi, tau, samples, shapes[-1] if shapes else None, loads))
        if watch is not None:
            watch(k + 1, insertion.size)
    return Motion(robot=robot, insertion=insertion, rotation=rotation, tension=tension, shapes=tuple(shapes))


def _step(robot, k, eta, phi, tau, samples, start, loads) -> Shape:
    s = None if samples is None or not 0 <= eta <= 1 else np.linspace(0.0, eta * robot.length_na, samples)
    try:
        rubbing = {"history": start} if start is not None and robot.friction.any() else {}
        return solve(robot, tau, insertion=eta, rotation=phi, s=s, start=start, **rubbing | loads)
    except InvalidInput as error:
        field = error.field.replace("tensions", "tension")
        raise InvalidInput(f"row {k + 1}: {field}", error.value, error.allowed) from None
    except NotConverged as error:
        status, advice = f"row {k + 1}: {error.status}", error.advice
        raise NotConverged(
            status=status, load_factor=error.load_factor, residual=error.residual, advice=advice
        ) from None


def _table(robot: Robot, insertion, rotation, tension):
    columns = {"insertion": insertion, "rotation": rotation, "tension": tension}
    arrays = {
        name: np.atleast_1d(numbers(name, values, (0, 1, 2) if name == "tension" else (0, 1)))
        for name, values in columns.items()
    }
    rows = {name: array.shape[0] for name, array in arrays.items()}
    size = 0 if 0 in rows.values() else max(rows.values())
    for name, count in rows.items():
        if count not in (1, size):
            raise InvalidInput(name, Fact(f"{count} rows"), f"1 row, or as many as the others, {size}")
    tau = arrays["tension"]
    tau = tau[:, None] if tau.ndim == 1 else tau
    if tau.shape[1] not in (1, robot.n_tendons):
        raise InvalidInput("tension", Fact(f"{tau.shape[1]} columns"), f"one column per tendon, {robot.n_tendons}")
    full = np.broadcast_to(tau, (size, robot.n_tendons)).copy()
    return np.broadcast_to(arrays["insertion"], size).copy(), np.broadcast_to(arrays["rotation"], size).copy(), full
