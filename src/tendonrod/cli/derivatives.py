"""Derivatives of the tip as tables in units of the workshop: `--jacobian` and `--compliance`."""

from __future__ import annotations

import re
from math import radians
from typing import TYPE_CHECKING, Any

from ..errors import Fact, InvalidInput
from . import output

if TYPE_CHECKING:
    import numpy as np

    from ..robot import Robot
    from ..scenefile import Scene
    from ..statics.derivatives import Jacobian
    from ..statics.shape import Shape

# Unit in which a change is told, and that unit in SI.
_INPUTS = {
    **dict.fromkeys(("tensions", "tip_force"), ("N", 1.0)),
    **dict.fromkeys(("displacements", "exit_position", "exit_offset"), ("mm", 1e-3)),
    **dict.fromkeys(("rotation", "exit_rotation", "exit_tilt"), ("deg", radians(1.0))),
    "gravity": ("m/s2", 1.0),
    "insertion": ("%", 1e-2),
    "tip_moment": ("N mm", 1e-3),
    "distributed_force": ("N/m", 1.0),
    "distributed_moment": ("N", 1.0),
}
_OF_POINT = {"force": ("N", 1.0), "moment": ("N mm", 1e-3), "mass": ("g", 1e-3)}
_OF_DISTRIBUTED = {
    **dict.fromkeys(("force", "force_end"), ("N/m", 1.0)),
    **dict.fromkeys(("moment", "moment_end"), ("N", 1.0)),
}
_OF_FILES = {  # by the unit in the key of a robot file
    "mm": ("mm", 1e-3),
    "mm2": ("mm2", 1e-6),
    "mm4": ("mm4", 1e-12),
    "deg": ("deg", radians(1.0)),
    "gpa": ("GPa", 1e9),
    "n": ("N", 1.0),
    "m3": ("kg/m3", 1.0),
    "m": ("1/m", 1.0),
}
_NOTHING = 1e-9  # of the largest number in a row: what is smaller is rounding
_MOTION = ("x\nmm", "y\nmm", "z\nmm", "turn x\ndeg", "turn y\ndeg", "turn z\ndeg")


def jacobian_inputs(text: str, scene: Scene) -> tuple[str, ...]:
    """The names after --jacobian as `Shape.jacobian` takes them; loads may be called as in the scene file."""
    names = [name.strip() for name in text.split(",")]
    if "" in names:
        raise InvalidInput("--jacobian", Fact(text or "''"), "names with commas between them, as tensions,insertion")
    numbers = {each: f"loads[{i}]" for i, each in enumerate(scene.names)}
    for name in names:
        table = re.match(r"(point|mass|distributed)\b(\[\d+\])?", name)
        if table and table[0] not in numbers:
            known = (
                f"of one of the loads {', '.join(scene.names)}" if scene.names else "left out: --scene gives no load"
            )
            raise InvalidInput("--jacobian", Fact(name), known)
    return tuple(re.sub(r"^\w+\[\d+\](?=\.)", lambda found: numbers.get(found[0], found[0]), name) for name in names)


def derivatives(solved: Shape, inputs: tuple[str, ...]) -> Jacobian:
    """`Shape.jacobian` whose errors name the option."""
    try:
        return solved.jacobian(*inputs)
    except InvalidInput as error:
        if error.field != "inputs":
            raise
        raise InvalidInput("--jacobian", Fact(str(error.value)), error.allowed) from None


def jacobian_table(found: Jacobian, robot: Robot, scene: Scene) -> str:
    """One row per input: motion of the tip, and of the tensions where they follow from displacements."""
    import numpy as np

    files = {f"loads[{i}]": name for i, name in enumerate(scene.names)}
    follows = [i for i in range(robot.n_tendons) if found.tensions[i].any() and not _given(found, i)]
    columns = [*_MOTION, *(f"tension {i + 1}\nN" if robot.n_tendons > 1 else "tension\nN" for i in follows)]
    rows = []
    for k, name in enumerate(found.names):
        unit, scale = _unit(name, robot, scene)
        motion = np.concatenate([1e3 * found.position[-1, :, k], np.degrees(found.rotation[-1, :, k])])
        table, dot, rest = name.partition(".")
        shown = f"{files.get(table, table)}{dot}{rest}"
        rows.append([shown, f"per {unit}", *_cells(scale * motion), *_cells(scale * found.tensions[follows, k])])
    return output.table(("tip by\n", "\n", *columns), rows, words=(0, 1))


def compliance_table(compliance: np.ndarray) -> str:
    """One row per force and moment on the tip."""
    import numpy as np

    rows = []
    for k, name in enumerate([f"{what} {axis}" for what in ("force", "moment") for axis in "xyz"]):
        unit, scale = _OF_POINT[name[:-2]]
        motion = np.concatenate([1e3 * compliance[:3, k], np.degrees(compliance[3:, k])])
        rows.append([name, f"per {unit}", *_cells(scale * motion)])
    return output.table(("tip compliance\n", "\n", *_MOTION), rows, words=(0, 1))


def _given(found: Jacobian, i: int) -> bool:
    return f"tensions[{i}]" in found.names


def _cells(values: Any) -> list[str]:
    largest = max((abs(value) for value in values), default=0.0)
    return [f"{value:.4g}" if abs(value) > _NOTHING * largest else "0" for value in values]


def _unit(name: str, robot: Robot, scene: Scene) -> tuple[str, float]:
    stem, _, rest = name.partition("[")
    if stem in _INPUTS:
        return _INPUTS[stem]
    if stem == "loads":
        i, _, field = rest.partition("].")
        field = field.partition("[")[0]
        spread = scene.names[int(i)].startswith("distributed")
        return (_OF_DISTRIBUTED if spread else _OF_POINT).get(field, ("mm", 1e-3))
    return _OF_FILES.get(_file_key(name, robot).rpartition("_")[2], ("1", 1.0))


def _file_key(name: str, robot: Robot) -> str:
    """The key in a robot file of a parameter."""
    from ..parameters import TENDON_KEYS, body_keys, tendon_names

    keys = body_keys(robot.body)
    keys = keys | {flat: TENDON_KEYS[own] for flat, (_, own) in tendon_names(robot.tendons).items()}
    return keys.get(name) or keys.get(name.rpartition("_")[0], name)
