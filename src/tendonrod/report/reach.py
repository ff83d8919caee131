"""`reach_page`: which targets of a phantom a robot reaches, by what commands, and what stops it at the others."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..navigate.script import write_script
from .chapter import Cell, Number, Picture, Table, mm
from .page import write_page

if TYPE_CHECKING:
    from ..navigate.reach import Reach
    from ..navigate.scenario import Scenario

HEADER = (
    "target", "reached", "nearest (mm)", "least gap (mm)", "to", "insertion (mm)", "tension (N)", "rotation (deg)",
    "exit height (mm)", "offset (mm)", "depth (mm)", "tilt (deg)", "lean (deg)",
)  # fmt: skip
HINDERED = ("target", "nearest (mm)", "in the way", "nearest when pressed (mm)", "contact pressure then (kPa)")


def reach_page(
    out: str | os.PathLike[str],
    scenario: Scenario,
    results: Sequence[Reach],
    command: str = "",
    watch: Callable[[int, int, str], None] | None = None,
) -> Path:
    """Write index.html, its figures (PNG, SVG), its table (CSV), and a script for each target to the directory ``out``.

    command: what made it, for the reader. watch(done, total, what) is called before each figure. Returns the path of
    index.html. Raises `InvalidInput` where ``out`` cannot be written.
    """
    from ..plot.reach import reach_map, sections_figure

    pictures = [
        Picture(name="reach", draw=partial(reach_map, results, scenario.phantom)),
        Picture(name="sections", draw=partial(sections_figure, results)),
    ]
    scripts = [partial(_write_script, found=each, command=command) for each in results]
    missed = [each for each in results if not (each.reached and each.within_limits)]
    tables = [Table(name="targets", header=HEADER, rows=[_row(each) for each in results])]
    if missed:
        tables.append(Table(name="missed", header=HINDERED, rows=[_hindered(each) for each in missed]))
    title = f"What {scenario.robot.name} reaches in the phantom “{scenario.phantom.name}”"
    return write_page(out, "reach.html.j2", title, tables, pictures, _facts(scenario, results, command), scripts, watch)


def script_name(target: str) -> str:
    """File of the script to ``target``."""
    return f"{target.replace('@', '-')}.csv"


def _write_script(folder: Path, found: Reach, command: str) -> None:
    robot, phantom = found.scenario.robot, found.scenario.phantom
    says = [
        f"{found.target}, {robot.name} ({robot.torsion} torsion), phantom {phantom.name}: {_said(found)}.",
        *([f"Made by: {command}"] if command else []),
        f"Run it: tendonrod navigate --script {script_name(found.target)} --headless",
    ]
    write_script(folder / script_name(found.target), found.moves, says)


def _said(found: Reach) -> str:
    ends = f"the tip comes within {mm(found.nearest)} mm"
    return f"{ends}, inside all limits" if found.within_limits else f"{ends}, but limits are exceeded"


def _row(found: Reach) -> list[Cell]:
    from ..plot.reach import least_gap

    way, (name, gap) = found.approach, least_gap(found)
    tube, length = way.tube, found.scenario.robot.section.L
    return [
        found.target, "yes" if found.reached and found.within_limits else "no", mm(found.nearest), mm(gap), name,
        mm(way.insertion * length), Number(way.tension, 3), Number(degrees(way.rotation), 1),
        *(mm(getattr(tube, key)) for key in ("height", "offset", "depth")),
        *(Number(degrees(getattr(tube, key)), 1) for key in ("tilt", "lean")),
    ]  # fmt: skip


def _hindered(found: Reach) -> list[Cell]:
    pressed = found.pressed
    first: list[Cell] = [found.target, mm(found.nearest), " or ".join(found.limited_by) or "no single structure"]
    if pressed is None or pressed.metrics.pressure is None:
        return [*first, "", ""]
    return [*first, mm(pressed.nearest), Number(1e-3 * pressed.metrics.pressure.value, 1)]


def _facts(scenario: Scenario, results: Sequence[Reach], command: str) -> dict[str, Any]:
    done = [each for each in results if each.reached and each.within_limits]
    missed = [each for each in results if each not in done]
    return {
        "robot": scenario.robot.name,
        "torsion": scenario.robot.torsion,
        "phantom": scenario.phantom.name,
        "total": len(results),
        "done": len(done),
        "missed": [_missed(each) for each in missed],
        "worst": mm(max((each.nearest for each in done), default=0.0)),
        "tension": Number(scenario.limits.tension, 2),
        "pressure": Number(1e-3 * scenario.limits.pressure, 1),
        "command": command,
    }


def _missed(found: Reach) -> dict[str, Any]:
    """What is said of a target that was not reached."""
    pressed = found.pressed
    facts: dict[str, Any] = {
        "target": found.target, "nearest": mm(found.nearest, 1), "within": found.within_limits, "pressed": None,
        "blame": " or the ".join(found.limited_by),
    }  # fmt: skip
    if pressed is not None and pressed.metrics.pressure is not None:
        facts |= {"pressed": mm(pressed.nearest, 1), "pressure": Number(1e-3 * pressed.metrics.pressure.value, 0)}
    return facts
