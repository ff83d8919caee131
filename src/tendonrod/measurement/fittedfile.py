"""What a fit leaves for later use: the robot's file with identified numbers and their sources, and the bench's scene.

A world of the fit is that of its trials: origin at the outer tube's exit as the trials believe it, gravity as they say.
"""

from __future__ import annotations

import datetime
import hashlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path

import numpy as np

from ..errors import InvalidInput
from ..loads import LumpedMass
from ..parameters import TENDON_KEYS, body_keys, tendon_names
from ..robot import Robot
from ..robotfile_writing import robot_from_text, robot_text, write_text
from ..scenefile_writing import scene_text
from .identification import Fit
from .rounding import span, with_error
from .setup import BENCH, Setup
from .trial import Trial
from .unknowns import unknowns

SCENE = "fitted-scene.toml"
NAMED = 6  # files named in a source; all of them are told on top of the file
HEX = 12  # digits of a checksum
NOT_IN_FILES = tuple(
    name for name in BENCH if name not in ("tip_mass", "base_roll") and not name.startswith(("base_", "gravity_"))
)


@dataclass(frozen=True, kw_only=True)
class Provenance:
    """Whence a fit came. files: (name, sha256 in hex) of each trial's, in their order. date: ISO.

    given: names of numbers that were held at a value said by hand.
    """

    files: tuple[tuple[str, str], ...] = ()
    given: tuple[str, ...] = ()
    date: str = field(default_factory=lambda: datetime.date.today().isoformat())


def checksums(paths: Sequence[str | PathLike[str]]) -> tuple[tuple[str, str], ...]:
    """(name, sha256 in hex) of each file. Raises `InvalidInput` where one cannot be read."""
    found = []
    for path in map(Path, paths):
        try:
            found.append((path.name, hashlib.sha256(path.read_bytes()).hexdigest()))
        except OSError as error:
            raise InvalidInput("paths", str(path), f"a readable file: {error.strerror or error}") from None
    return tuple(found)


def write_fitted(fit: Fit, directory: str | PathLike[str], provenance: Provenance | None = None) -> tuple[Path, ...]:
    """Write fitted-ROBOT.toml and fitted-scene.toml into ``directory``, which exists; the paths written.

    Without a robot's file where the trials are of several. Raises `InvalidInput` where they cannot be written.
    """
    told, folder = provenance or Provenance(), Path(directory)
    texts = {folder / SCENE: fitted_scene_text(fit, told)}
    if (robot := fitted_robot(fit, told)) is not None:
        texts = {folder / robot_file(robot): robot_text(robot, [*remarks(fit, told), *_not_in_robot(fit)]), **texts}
    for path, text in texts.items():
        write_text("fitted file", path, text)
    return tuple(texts)


def robot_file(robot: Robot) -> str:
    """The name of its file."""
    return f"fitted-{re.sub(r'[^A-Za-z0-9_.+-]+', '_', robot.name)}.toml"


def fitted_robot(fit: Fit, provenance: Provenance | None = None) -> Robot | None:
    """The robot with the identified numbers, as its file says them, and with their sources; None for several robots.

    A number that has no decimal form in its file's unit is off by a last binary digit (`robotfile_writing`).
    """
    robots = list(dict.fromkeys(fit.setup.robot_of(each) for each in fit.trials))
    if len(robots) != 1:
        return None
    sources = dict(robots[0].sources) | _sources(fit, robots[0], provenance or Provenance())
    named = Robot(name=robots[0].name, body=robots[0].body, tendons=robots[0].tendons, sources=sources)
    return robot_from_text(robot_text(named), named.name)


def fitted_scene_text(fit: Fit, provenance: Provenance | None = None) -> str:
    """The scene file of the bench: the exit's place and the mass at the tip; what it cannot say is in its comments."""
    setup = fit.setup
    masses = (LumpedMass(mass=setup.tip_mass),) if setup.tip_mass > 0.0 else ()
    comments = [*remarks(fit, provenance or Provenance()), *_usage(fit), *_not_in_scene(fit)]
    return scene_text(exit_pose=setup.exit_pose, loads=masses, comments=comments)


def _sources(fit: Fit, robot: Robot, provenance: Provenance) -> dict[str, str]:
    """Key of the robot's file -> where its number comes from, of those that were identified or given by hand."""
    found: dict[str, list[str]] = {}
    for name in provenance.given:
        if name not in BENCH:
            said = f"given by hand, not identified, {_with_what(provenance)}"
            found.setdefault(file_key(robot, name), []).append(said)
    for i, name in enumerate(fit.names):
        if name not in BENCH:
            found.setdefault(file_key(robot, name), []).append(_identified(fit, i, provenance))
    several = {key: len(texts) > 1 for key, texts in found.items()}
    return {key: "; ".join(texts) if several[key] else texts[0] for key, texts in found.items()}


def file_key(robot: Robot, name: str) -> str:
    """The key of a robot file that holds the number ``name``; a vector's for its parts."""
    of_tendons = {flat: f"tendons[{i}].{TENDON_KEYS[own]}" for flat, (i, own) in tendon_names(robot.tendons).items()}
    keys = body_keys(robot.body) | of_tendons
    return keys.get(name) or keys[name.rpartition("_")[0]]


def _identified(fit: Fit, i: int, provenance: Provenance) -> str:
    said = f"identified: {_told(fit, i)} from {_files(fit, provenance)}, {_with_what(provenance)}"
    return f"{said}, free: {', '.join(fit.names)}"


def _told(fit: Fit, i: int) -> str:
    unknown, error = fit.unknowns[i], float(fit.standard_errors[i])
    value = with_error(unknown, float(fit.values[i]), error, "+-")
    return f"{value} (95 %: {span(unknown, float(fit.low[i]), float(fit.high[i]), error)})"


def _files(fit: Fit, provenance: Provenance) -> str:
    count = len(fit.trials)
    number = f"{count} trial{'s' if count > 1 else ''}"
    if not provenance.files:
        return f"{number} {', '.join(each.name for each in fit.trials[:NAMED])}{' ...' if count > NAMED else ''}"
    shown = provenance.files[:NAMED]
    names, sums = ", ".join(name for name, _ in shown), ", ".join(digest[:HEX] for _, digest in shown)
    return f"{number} {names}{' ...' if count > NAMED else ''} (sha256 {sums})"


def _with_what(provenance: Provenance) -> str:
    from .. import __version__

    return f"tendonrod {__version__}, {provenance.date}"


def remarks(fit: Fit, provenance: Provenance) -> list[str]:
    """Lines that tell the whole provenance of a fit."""
    lines = [f"Identified from trials by tendonrod identify; {_with_what(provenance)}."]
    lines += sorted({f"Trials made by {each.origin['made by']}." for each in fit.trials if "made by" in each.origin})
    lines += [f"trial {line}" for line in _trial_lines(fit, provenance)]
    lines += [f"identified: {unknown.name} = {_told(fit, i)}" for i, unknown in enumerate(fit.unknowns)]
    lines += [f"given by hand: {_value(fit, name)}" for name in provenance.given]
    lines.append(f"RMSE {1e3 * fit.rmse_before:.3g} -> {1e3 * fit.rmse:.3g} mm over {int(fit.used.sum())} poses")
    return [*lines, *(f"note: {each}" for each in fit.sentences)]


def _trial_lines(fit: Fit, provenance: Provenance) -> Iterator[str]:
    for i, trial in enumerate(fit.trials):
        name, digest = provenance.files[i] if i < len(provenance.files) else ("", "")
        yield f"{trial.name}" + (f": {name}, sha256 {digest}" if name else "")


def _value(fit: Fit, name: str) -> str:
    (unknown,) = unknowns((name,), fit.trials, fit.setup)
    return f"{name} = {unknown.told(unknown.start, 6)}"


def _not_in_robot(fit: Fit) -> list[str]:
    """What the fit says of the bench, which no robot file can say."""
    return [f"of the bench, not of the robot: {_value(fit, name)}" for name in _departed(fit.setup, BENCH)]


def _not_in_scene(fit: Fit) -> list[str]:
    lines = [f"no scene can say: {_value(fit, name)}" for name in _departed(fit.setup, NOT_IN_FILES)]
    return [*lines, *_tracker_masses(fit.trials)]


def _departed(setup: Setup, names: Sequence[str]) -> list[str]:
    usual = Setup()
    return [name for name in names if getattr(setup, name) != getattr(usual, name)]


def _usage(fit: Fit) -> list[str]:
    """The command that solves the bench's robot, for each gravity of the trials."""
    robot = fitted_robot(fit)
    name = "ROBOT.toml" if robot is None else robot_file(robot)
    pulls = dict.fromkeys(fit.setup.gravity_of(each) for each in fit.trials)
    return [f"use: tendonrod shape {name} --tension N --gravity {_vector(pull)} --scene {SCENE}" for pull in pulls]


def _vector(values: Sequence[float]) -> str:
    return ",".join(f"{value + 0.0:.9g}" for value in values)


def _tracker_masses(trials: Sequence[Trial]) -> list[str]:
    """Masses that ride in the trials but are not in the scene."""
    heavy = [(trial, each, at) for trial in trials for each, at in zip(trial.trackers, trial.places, strict=True)]
    return [
        f"not in this scene: tracker {each.name} of {trial.name}, {1e3 * each.mass:g} g at {1e3 * at:.6g} mm"
        for trial, each, at in heavy
        if each.mass > 0.0 and np.isfinite(at)
    ]
