"""What the user typed, as numbers and robots; every error names the option."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .. import errors
from ..errors import Fact, InvalidInput, finite, nonnegative, one_of

if TYPE_CHECKING:
    from ..measurement.trial import Trial
    from ..robot import Robot
    from ..scenefile import Scene

RobotName = Annotated[str, typer.Argument(metavar="ROBOT", hidden=True)]  # the help text tells what it is
Torsion = Annotated[
    str | None,
    typer.Option(metavar="MODEL", help="published, open_section or homogenized, instead of the robot's own torsion."),
]
Gravity = Annotated[str, typer.Option(metavar="X,Y,Z", help="Gravity in the world frame, m/s2.")]
Json = Annotated[bool, typer.Option("--json", help="Print results as JSON, SI units, full precision.")]
CentroidWeight = Annotated[
    bool,
    typer.Option("--centroid-weight", help="Weight acts at the section's centre of mass, not on its neutral axis."),
]
SceneFile = Annotated[
    str | None,
    typer.Option(
        metavar="FILE.toml", help="Loads, place of the exit and surfaces, from a file with units in its keys."
    ),
]
Figure = Annotated[str | None, typer.Option(metavar="FILE", help="Draw to a .png, .svg or .pdf file.")]


def number(option: str, text: str, check: Callable[..., float] = finite, *bounds: float) -> float:
    """``text`` as a number that passes ``check``, one of those in `tendonrod.errors`."""
    try:
        return check(option, _number_or_text(text), *bounds)
    except InvalidInput as error:
        if not isinstance(_number_or_text(text.replace(",", ".")), float) or "," not in text:
            raise
        allowed = f"{error.allowed}, written with a decimal point, not a comma"
        raise InvalidInput(option, Fact(text), allowed) from None


def whole(option: str, text: str, low: int, high: int) -> int:
    """``text`` as a whole number from ``low`` to ``high``."""
    try:
        value = int(text)
    except ValueError:
        value = _typed(text)
    return errors.whole(option, value, low, high)


def vector(option: str, text: str) -> tuple[float, float, float]:
    """``text`` such as "-9.81,0,0" as three finite numbers."""
    entries = [_number_or_text(part) for part in text.split(",")]
    try:
        x, y, z = (finite(option, entry) for entry in entries)
    except (ValueError, InvalidInput):
        raise InvalidInput(option, _typed(text), "3 finite numbers with commas between them, as -9.81,0,0") from None
    return x, y, z


def tensions(robot: Robot, texts: Sequence[str]) -> tuple[float, ...]:
    """One tension (N) per tendon; zero for all where the option is not given."""
    values = tuple(number("--tension", text, nonnegative) for text in texts)
    if values and len(values) != robot.n_tendons:
        allowed = f"given once per tendon; {robot.name} has {robot.n_tendons}"
        raise InvalidInput("--tension", Fact(",".join(texts)), allowed)
    return values or (0.0,) * robot.n_tendons


def displacements(robot: Robot, text: str | None) -> list[float | None] | None:
    """Pulled length (m) of each tendon, None for one driven by its tension; None where the option is missing."""
    if text is None:
        return None
    entries = [entry.strip() for entry in text.split(",")]
    if all(entry in ("", "-") for entry in entries) or len(entries) != robot.n_tendons:
        form = "a number" if robot.n_tendons == 1 else f"{robot.n_tendons} entries with commas between them"
        allowed = f"{form}, mm" + (", nothing or - for a tendon driven by its tension" if robot.n_tendons > 1 else "")
        if robot.n_tendons == 0:
            allowed = f"left out: {robot.name} has no tendons"
        raise InvalidInput("--displacement", _typed(text), allowed)
    return [None if entry in ("", "-") else 1e-3 * number("--displacement", entry) for entry in entries]


def chosen_scene(path: str | None) -> Scene:
    """The scene on file, an empty one where the option is missing."""
    from ..scenefile import Scene, read_scene

    return Scene(name="") if path is None else read_scene(path, "--scene")


def chosen_robot(source: str, torsion: str | None = None) -> Robot:
    """The robot, with another torsion model if one is asked for."""
    from ..robot import load_robot
    from ..section import TORSION_MODELS

    if torsion is not None:
        one_of("--torsion", torsion, TORSION_MODELS)
    return with_torsion(load_robot(source), torsion)


def bench_robot(source: str, torsion: str | None) -> Robot:
    """The robot with the torsion asked for; without one the homogenized, which is nearest to the real tubes."""
    from ..section import NotchedTube

    robot = chosen_robot(source, torsion)
    if torsion is None and isinstance(robot.body, NotchedTube) and robot.body.stiffness_factors is not None:
        return robot.replace(torsion="homogenized")
    return robot


def with_torsion(robot: Robot, torsion: str | None) -> Robot:
    """The robot with another torsion model, None for its own."""
    from ..section import TORSION_MODELS, NotchedTube

    if torsion is None:
        return robot
    one_of("--torsion", torsion, TORSION_MODELS)
    if not isinstance(robot.body, NotchedTube):
        raise InvalidInput("--torsion", Fact(torsion), f"left out: {robot.name} is a plain rod, its torsion is GJ")
    try:
        return robot.replace(torsion=torsion)
    except InvalidInput as error:
        if error.field != "stiffness_factors":
            raise
        needed = f"published or open_section: {robot.name} has no [material.stiffness_factors]"
        raise InvalidInput("--torsion", Fact(torsion), needed) from None


@contextmanager
def in_words(words: Mapping[str, str]) -> Iterator[None]:
    """The library's fields as the options that they came from."""
    try:
        yield
    except InvalidInput as error:
        raise InvalidInput(words.get(error.field, error.field), error.value, error.allowed) from None


def chosen_trials(paths: list[str], robot: Robot | None, torsion: str | None) -> list[Trial]:
    """The trials; files that do not name their robot are read with ``robot``."""
    from ..measurement.loading import load_trials

    found = []
    with in_words({"path": "TRIAL", "robot": "--robot"}):
        for path in paths:
            options: dict[str, Any] = {} if Path(path).suffix.lower() == ".nc" else {"robot": robot}
            found.extend(load_trials([path], **options))
    names = Counter(each.name for each in found)
    if len(paths) > 1 and max(names.values()) > 1:
        twice = names.most_common(1)[0][0]
        raise InvalidInput("TRIAL", Fact(twice), "given once; two of the files have a trial of this name")
    return found if robot is not None else [replace(each, robot=with_torsion(each.robot, torsion)) for each in found]


def _number_or_text(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def _typed(text: str) -> str:
    """As typed where that can be read on one line, else in quotes."""
    return Fact(text) if text.strip() and text.isprintable() else text
