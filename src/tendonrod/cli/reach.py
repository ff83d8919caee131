"""`tendonrod reach`: which targets of a phantom a robot reaches, and the scripts that lead there."""

from __future__ import annotations

import sys
from math import degrees
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput
from . import output as out
from .arguments import Json, in_words, whole

if TYPE_CHECKING:
    from ..navigate.reach import Reach
    from ..navigate.scenario import Scenario

OPTIONS = {"phantom": "PHANTOM"} | {name: f"--{name}" for name in ("scene", "levels", "robot", "torsion")}
COLUMNS = ("target", "reached", "nearest\n(mm)", "least gap\n(mm)", "insertion\n(mm)", "tension\n(N)", "in the way")


def reach(
    phantom: Annotated[str | None, typer.Argument(metavar="PHANTOM", hidden=True)] = None,
    target: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="As ventral@T10, or ventral or T10 for all such; repeat it. Default: all."),
    ] = None,
    levels: Annotated[str | None, typer.Option(metavar="A-B", help="Vertebrae of the phantom, as T8-L2.")] = None,
    robot: Annotated[str | None, typer.Option(metavar="ROBOT", help="A preset or a file; exonav-1 by default.")] = None,
    torsion: Annotated[
        str | None, typer.Option(metavar="MODEL", help="published, open_section or homogenized, the default here.")
    ] = None,
    scene: Annotated[
        str | None, typer.Option(metavar="FILE.toml", help="Robot, phantom, gravity and limits, units in its keys.")
    ] = None,
    seed: Annotated[str, typer.Option(metavar="WHOLE", help="Of the search; the same seed gives the same ways.")] = "0",
    output: Annotated[
        str | None, typer.Option(metavar="DIR", help="Write a page, figures, a table and a script for each target.")
    ] = None,
    json: Json = False,
) -> None:
    """Look for a way to each target of a phantom, and carry it out with contact.

    PHANTOM is printed, the default, anatomical, or the path of a phantom's TOML file. The outer tube is put where the
    way asks for it. A target that is not reached is given with the nearest approach and with what is in the way.
    """
    drawn_by = whole("--seed", seed, 0, 2**32 - 1)
    folder = None if output is None else out.directory("--output", output)
    from ..navigate.reach import reach as reached
    from ..navigate.scenariofile import read_scenario

    with in_words(OPTIONS):
        scenario = read_scenario(scene, phantom=phantom, levels=levels, robot=robot, torsion=torsion)
    out.warn(scenario.phantom.doubts())
    names = _chosen(scenario, target or [])
    results = []
    with out.progress_bar("looking for ways") as watch:
        for k, name in enumerate(names):
            results.append(reached(scenario, name, drawn_by, _Rising(watch, k, len(names))))
    if folder is not None:
        _write(folder, scenario, results)
    if json:
        out.say_json(as_dict(scenario, results))
    else:
        out.say(page(scenario, results))


class _Rising:
    """Progress over targets, each of which takes nobody knows how many searches: it rises all the same."""

    def __init__(self, watch: Any, k: int, count: int) -> None:
        self._watch, self._k, self._count, self._done = watch, k, count, dict[str, float]()

    def __call__(self, what: str, done: int, of: int) -> None:
        self._done[what] = max(self._done.get(what, 0.0), done / of)
        share = 1.0 - 1.0 / (1.0 + sum(self._done.values()))
        self._watch(self._k + share, self._count, f"target {self._k + 1} of {self._count}, {what}")


def _chosen(scenario: Scenario, asked: list[str]) -> list[str]:
    """Full names, in the phantom's order."""
    known = tuple(scenario.phantom.targets)
    for each in asked:
        if not any(each in (name, *name.split("@")) for name in known):
            kinds, levels = ({name.split("@")[k]: None for name in known} for k in (0, 1))
            allowed = f"one of {', '.join(kinds)}, of the levels {', '.join(levels)}, or both as {known[0]}"
            raise InvalidInput("--target", Fact(each), allowed)
    return [name for name in known if not asked or any(each in (name, *name.split("@")) for each in asked)]


def _write(folder: Any, scenario: Scenario, results: list[Reach]) -> None:
    from ..report.reach import reach_page

    command = " ".join(["tendonrod", *sys.argv[1:]])
    with out.filling("--output", folder), out.progress_bar("drawing") as watch:
        path = reach_page(folder, scenario, results, command, watch)
    out.note(f"wrote {path}, with a script for each target beside it")


def page(scenario: Scenario, results: list[Reach]) -> str:
    """For people."""
    done = sum(each.reached and each.within_limits for each in results)
    title = f"{scenario.robot.name}, torsion {scenario.robot.torsion}, in the phantom {scenario.phantom.name}: "
    rows = [
        [
            each.target,
            "yes" if each.reached and each.within_limits else "no",
            out.fixed(1e3 * each.nearest, 2),
            out.fixed(1e3 * min(gap.value for gap in each.metrics.clearance.values()), 2),
            out.fixed(1e3 * each.approach.insertion * scenario.robot.section.L, 1),
            out.fixed(each.approach.tension, 3),
            _blame(each),
        ]
        for each in results
    ]
    heading = out.heading(f"{title}{done} of {len(results)} targets reached inside all limits")
    return f"{heading}\n\n{out.table(COLUMNS, rows, words=(0, 1, 6))}"


def _blame(found: Reach) -> str:
    if found.reached and found.within_limits:
        return ""
    pressed, text = found.pressed, " or ".join(found.limited_by) or "no single structure"
    if pressed is None or pressed.metrics.pressure is None:
        return text
    return f"{text}; pressed with {1e-3 * pressed.metrics.pressure.value:.0f} kPa: {1e3 * pressed.nearest:.1f} mm"


def as_dict(scenario: Scenario, results: list[Reach]) -> dict[str, Any]:
    """For JSON, SI."""
    return {
        "robot": scenario.robot.name,
        "torsion": scenario.robot.torsion,
        "phantom": scenario.phantom.name,
        "targets": [_result(each) for each in results],
    }


def _result(found: Reach) -> dict[str, Any]:
    way = found.approach
    return {
        "target": found.target,
        "reached": found.reached,
        "within_limits": found.within_limits,
        "nearest": found.nearest,
        "limited_by": list(found.limited_by),
        "insertion": way.insertion,
        "tension": way.tension,
        "rotation_deg": degrees(way.rotation),
        "tube": {name: getattr(way.tube, name) for name in ("height", "offset", "depth", "tilt", "lean")},
        "metrics": found.metrics.to_dict(),
        "pressed": None if found.pressed is None else _result(found.pressed),
    }
