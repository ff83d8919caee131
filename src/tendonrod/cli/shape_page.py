"""The text that `tendonrod shape` prints."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees
from typing import TYPE_CHECKING

from . import output
from .shape_data import LOADS

if TYPE_CHECKING:
    from ..scenefile import Scene
    from ..statics.shape import Shape

SHOWN = 11  # sections in the printed table
MOST_CONTACTS = 20  # places of contact in the printed table
_LEGEND = "x, y, z: neutral axis; axis: centre of the tube; u: curvature and twist in the\nsection frame."
_SECTION_COLUMNS = (
    *("s\nmm", "x\nmm", "y\nmm", "z\nmm", "axis x\nmm", "axis y\nmm", "axis z\nmm"),
    *("u_x\n1/m", "u_y\n1/m", "u_z\n1/m"),
)
_CONTACT_COLUMNS = (
    "contact\ns mm",
    "gap\num",
    "force\nmN",
    "force\nx mN",
    "force\ny mN",
    "force\nz mN",
    "line force\nN/m",
)


def listed(values, digits: int = 6) -> str:
    """Numbers with commas between them."""
    return ", ".join(f"{value:.{digits}g}" for value in values)


def page(solved: Shape, loads: Mapping[str, tuple[float, ...]], angle: float, pulled, scene: Scene) -> list[str]:
    """Blocks of text: what was asked and found, the sections, the contacts."""
    robot = solved.robot
    blocks = [output.heading(f"{robot.name}, torsion {robot.torsion}")]
    facts = _asked(solved, loads, angle, pulled, scene) + _found(solved, scene)
    blocks += [output.table(("", "", ""), facts, words=(0, 1, 2))]
    blocks += [output.table(_SECTION_COLUMNS, _sections(solved)), _LEGEND]
    return blocks + ([_contacts(solved)] if solved.contacts is not None and solved.contacts.s.size else [])


def _asked(solved: Shape, loads, angle: float, pulled, scene: Scene) -> list[tuple[str, str, str]]:
    facts = [("tensions", listed(solved.tensions) or "no tendons", "N")]
    if pulled is not None:
        facts.append(
            ("displacements", ", ".join("-" if each is None else f"{1e3 * each:.6g}" for each in pulled), "mm")
        )
    facts.append(("gravity", listed(loads["gravity"]), "m/s2"))
    facts += [
        (name.replace("_", " "), listed(loads[name]), unit)
        for name, unit in LOADS.items()
        if name != "gravity" and any(loads[name])
    ]
    if scene.name:
        walls = [type(each).__name__.lower() for each in scene.surfaces]
        exit_moved = ["exit"] if scene.arguments.keys() & {"exit_pose", "exit_tilt", "exit_offset"} else []
        facts.append(("scene", ", ".join([*scene.names, *exit_moved, *walls]) or "empty", scene.name))
    facts.append(("insertion", f"{solved.insertion:.6g}", f"of {1e3 * solved.robot.length_na:.5f} mm"))
    return facts + ([("rotation", f"{degrees(angle):.6g}", "deg")] if angle else [])


def _found(solved: Shape, scene: Scene) -> list[tuple[str, str, str]]:
    facts = [
        ("tip, neutral axis", _fixed(1e3 * solved.tip), "mm"),
        ("tip, tube axis", _fixed(1e3 * solved.centerline[-1]), "mm"),
        ("tip direction", _fixed(solved.rotation[-1][:, 2]), ""),
        ("moment at exit", listed(1e3 * solved.moment[0], 5), "N mm"),
    ]
    if solved.contacts is not None:
        facts += _touching(solved, scene)
    return [*facts, ("solved in", _effort(solved), "")]


def _touching(solved: Shape, scene: Scene) -> list[tuple[str, str, str]]:
    import numpy as np

    found = solved.contacts
    if found is None or found.s.size == 0:
        gap = scene.arguments["surface"].distance(solved.centerline)[0]
        gap = gap - solved.robot.outer_radius(solved.material_coordinate)
        k = int(np.argmin(gap))
        return [("contact", "none", f"nearest {1e3 * gap[k]:.4g} mm, at s = {1e3 * solved.s[k]:.4g} mm")]
    first, last = 1e3 * found.s[[0, -1]]
    where = f"at s = {first:.4g} mm" if first == last else f"from s = {first:.4g} to {last:.4g} mm"
    size = 1e3 * np.linalg.norm(found.total)
    return [("contact force", listed(1e3 * found.total, 5), f"mN, {size:.4g} mN in all, {where}")]


def _contacts(solved: Shape) -> str:
    """At most so many places, evenly chosen; the most loaded one is always among them."""
    import numpy as np

    found = solved.contacts
    assert found is not None
    size = found.s.size
    chosen = np.linspace(0, size - 1, min(size, MOST_CONTACTS)).round().astype(int)
    rows = []
    for k in np.unique([*chosen, int(np.argmax(found.force))]):
        force = 1e3 * found.force[k] * found.normal[k]
        line = f"{found.line_force[k]:.4g}" if found.line_force[k] > 0.0 else "tip"
        numbers = [output.fixed(1e6 * float(found.gap[k]), 2), f"{1e3 * found.force[k]:.4g}"]
        rows.append(
            [output.fixed(1e3 * float(found.s[k]), 3), *numbers, *(output.fixed(each, 4) for each in force), line]
        )
    text = output.table(_CONTACT_COLUMNS, rows)
    return text if len(rows) == size else f"{text}\n\n{len(rows)} of {size} places of contact; --json has all."


def _effort(solved: Shape) -> str:
    if solved.iterations == 0:
        return "closed form"
    iterations = "1 iteration" if solved.iterations == 1 else f"{solved.iterations} iterations"
    return f"{iterations}, scaled residual {solved.residual:.1e}"


def _sections(solved: Shape) -> list[list[str]]:
    import numpy as np

    rows = []
    for k in np.unique(np.linspace(0, solved.s.size - 1, min(SHOWN, solved.s.size)).round().astype(int)):
        lengths = 1e3 * np.array([solved.s[k], *solved.position[k], *solved.centerline[k]])
        rows.append([output.fixed(value, 3) for value in lengths] + [output.fixed(value, 2) for value in solved.u[k]])
    return rows


def _fixed(values, digits: int = 4) -> str:
    return ", ".join(output.fixed(value, digits) for value in values)
