"""Inputs of a solve by name, such as "tip_force[0]" or "loads[1].mass": which there are, their values, changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import InvalidInput
from ..rotation import exp_so3
from .problem import Request

STEP = 2e-6  # relative, of central differences at fixed strains
MATERIAL = ("youngs_modulus", "shear_modulus", "density", "_factor")  # stiffness or weight is linear in them
LINEAR = ("gravity", "tip_force", "tip_moment", "distributed_force", "distributed_moment")  # three columns each
COUNTS = dict.fromkeys(LINEAR, 3) | {"exit_position": 3, "exit_rotation": 3, "exit_tilt": 2, "exit_offset": 2}
Scalar = tuple[str, int | None, float, bool]  # input, its entry, natural size, whether the imbalance is linear in it


def named(stem: str, i: int | None) -> str:
    """Name of one number, such as "tip_force[0]"; without an index where its input is a single number."""
    return stem if i is None else f"{stem}[{i}]"


def sides(asked: Request, stem: str, i: int | None, scale: float, linear: bool):
    """(request changed up, request changed down or None, size of the difference) of one number."""
    name = named(stem, i)
    if linear and not asked.robot.friction.any():
        return change(asked, name, scale), None, scale
    half = STEP * scale
    try:
        return change(asked, name, half), change(asked, name, -half), 2.0 * half
    except InvalidInput:  # at the edge of what is allowed
        return change(asked, name, half), asked, half


def numbers_of(asked: Request, name: str) -> list[Scalar]:
    """Every number that ``name`` stands for."""
    T, stem = asked.robot.n_tendons, name.partition("[")[0]
    if stem == "loads":
        return _numbers_of_load(asked, name)
    counts = {"tensions": T, "displacements": T} | COUNTS
    if stem in counts:
        indices = range(counts[stem]) if stem == name else [_index(name, counts[stem])]
        linear = stem in LINEAR or stem in ("tensions", "displacements")
        scale = asked.robot.length_na if stem in ("exit_position", "exit_offset") else 1.0
        driven = ~np.isnan(asked.pulled)
        wrong = {"tensions": driven, "displacements": ~driven}.get(stem, [])
        for i in indices if any(wrong) else ():
            if wrong[i]:
                allowed = "an input that was given: this tendon was driven otherwise"
                raise InvalidInput("inputs", named(stem, i), allowed)
        return [(stem, i, scale, linear) for i in indices]
    if name in ("insertion", "rotation"):
        return [(name, None, 1.0, False)]
    parameters = asked.robot.parameters()
    if name not in parameters:
        valid = [*counts, "insertion", "rotation", "loads[0].force", *parameters]
        raise InvalidInput("inputs", name, "one of " + ", ".join(valid))
    zero = 1.0 / asked.robot.length_na if "precurvature" in name else 1e-2 * asked.robot.length_na
    scale = abs(parameters[name]) or (1.0 if "turns" in name or "angle" in name else zero)
    return [(name, None, scale, name.endswith(MATERIAL))]


def _numbers_of_load(asked: Request, name: str) -> list[Scalar]:
    head, _, field = name.partition("].")
    stem, _, part = field.partition("[")
    index = head.removeprefix("loads[")
    if not (index.isdigit() and int(index) < len(asked.loads)):
        raise InvalidInput("inputs", name, f"loads[i].field with i from 0 to {len(asked.loads) - 1}")
    value = getattr(asked.loads[int(index)], stem, None)
    if value is None or stem == "frame":
        raise InvalidInput("inputs", name, "a number or vector of that load which was given")
    if isinstance(value, float):
        return [(name, None, asked.robot.length_na if stem != "mass" else 1.0, stem == "mass")]
    indices = [_index(f"{stem}[{part}", 3)] if part else range(3)
    return [(f"{head}].{stem}", i, 1.0 if stem != "offset" else 1e-3, stem != "offset") for i in indices]


def _index(name: str, count: int) -> int:
    text = name.partition("[")[2].removesuffix("]")
    if not (text.isdigit() and int(text) < count):
        raise InvalidInput("inputs", name, f"with an index from 0 to {count - 1}")
    return int(text)


def change(asked: Request, column: str, by: float) -> Request:
    """The request with one number, named as in `Jacobian.names`, changed by so much."""
    stem, _, rest = column.partition("[")
    if stem == "loads":
        return _with_load(asked, column, by)
    if not rest:
        if column in ("insertion", "rotation"):
            return replace(asked, **{column: getattr(asked, column) + by})
        return replace(asked, robot=asked.robot.replace(**{column: asked.robot.parameters()[column] + by}))
    i = int(rest.removesuffix("]"))
    if stem in ("exit_position", "exit_rotation"):
        pose = np.eye(4) if asked.pose is None else asked.pose.copy()
        step = by * np.eye(3)[i]
        if stem == "exit_position":
            pose[:3, 3] += step
        else:
            pose[:3, :3] = exp_so3(step) @ pose[:3, :3]
        return replace(asked, pose=pose)
    field = {"displacements": "pulled", "exit_tilt": "tilt", "exit_offset": "offset"}.get(stem, stem)
    values = np.array(getattr(asked, field), dtype=float)
    values[i] += by
    return replace(asked, **{field: values if field in ("tensions", "pulled") else tuple(values.tolist())})


def _with_load(asked: Request, column: str, by: float) -> Request:
    head, _, field = column.partition("].")
    i, (stem, _, part) = int(head.removeprefix("loads[")), field.partition("[")
    value = getattr(asked.loads[i], stem)
    if part:
        changed = list(value)
        changed[int(part.removesuffix("]"))] += by
    else:
        changed = value + by
    loads = list(asked.loads)
    loads[i] = replace(loads[i], **{stem: changed})
    return replace(asked, loads=tuple(loads))


def value_of(asked: Request, column: str) -> float:
    """What an input, named as in `Jacobian.names`, is now."""
    stem, _, rest = column.partition("[")
    if not rest:
        own = column in ("insertion", "rotation")
        return float(getattr(asked, column) if own else asked.robot.parameters()[column])
    if stem == "loads":
        index, _, name = rest.partition("].")
        name, _, part = name.partition("[")
        found = getattr(asked.loads[int(index)], name)
        return float(found[int(part.removesuffix("]"))] if part else found)
    i = int(rest.removesuffix("]"))
    if stem == "exit_rotation":
        return 0.0
    if stem == "exit_position":
        return 0.0 if asked.pose is None else float(asked.pose[i, 3])
    field = {"displacements": "pulled", "exit_tilt": "tilt", "exit_offset": "offset"}.get(stem, stem)
    return float(getattr(asked, field)[i])
