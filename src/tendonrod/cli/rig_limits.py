"""What a bench is asked for, held against its limits before anything opens; a refusal names option, unit and reason."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from math import degrees
from typing import TYPE_CHECKING

from ..errors import Fact, InvalidInput
from .shape_page import listed

if TYPE_CHECKING:
    from ..rig.drives import Machine
    from ..rig.limits import Limits
    from .rig_bench import Chosen


def limits_for(place: Chosen) -> Limits:
    """The interlock's limits, of model and bench file. Raises `InvalidInput` for a robot that its load alone spoils."""
    from ..rig.trials import limits_of

    try:
        return limits_of(place.source, place.rate)[0]
    except InvalidInput as error:
        if error.field != "load":
            raise
        field, value = _heaviest(place)
        raise InvalidInput(field, Fact(value), error.allowed) from None


def admit(limits: Limits, place: Chosen, field: str, tension: float, what: str = "") -> None:
    """Raise `InvalidInput` where ``tension`` (N) is above the soft limit. what: it is, as in "its highest, "."""
    most = limits.soft * limits.tension
    if not tension <= most:
        allowed = f"at most {most:.4g} N, the soft limit: {limits.soft:g} of {_origin(limits, place)}"
        raise InvalidInput(field, Fact(f"{what}{tension:.4g} N"), allowed)


def admit_turns(machine: Machine, field: str, rotation: Sequence[float], insertion: Sequence[float]) -> None:
    """Raise `InvalidInput` where the motor cannot turn as the section's ``rotation`` (rad) over ``insertion`` asks."""
    from ..rig.drives import TaskFailed, full_turn

    way = [machine.turn(eta, phi) for eta, phi in zip(insertion, rotation, strict=True)]
    try:
        full_turn(way[0], way, machine.rotation)
    except TaskFailed:
        there, goes = (_span(each) for each in ((machine.rotation.low, machine.rotation.high), way))
        law = f"rotation {'-' if machine.turns < 0.0 else '+'} {360 * abs(machine.turns):g} deg x (insertion - 1)"
        allowed = (
            f"such that the motor, at {law}, stays {there} deg, full turns aside; it would go {goes} deg. "
            "The column is the rotation of the section at the outer tube's exit: 0 throughout follows the leader"
        )
        raise InvalidInput(field, Fact(f"{_span(rotation)} deg"), allowed) from None


def machine_of(place: Chosen, limits: Limits) -> Machine:
    """What tasks know of the bench, as far as it is known before it opens."""
    from ..rig.drives import Machine

    robot = place.source.robot
    return Machine(length=robot.section.L, turns=robot.turns, rotation=limits.rotation)


@contextmanager
def rates_in_words() -> Iterator[None]:
    """The screw's rate as the option that it came from, in mm/s."""
    try:
        yield
    except InvalidInput as error:
        if error.field != "screw_rate":
            raise
        allowed = re.sub(r"the axis' speed, ([-+.\de]+), in m/s", _screws_speed, error.allowed)
        raise InvalidInput("--screw-rate-mm-s", Fact(f"{1e3 * float(str(error.value)):g}"), allowed) from None


def _screws_speed(found: re.Match[str]) -> str:
    return f"the screw's speed, {1e3 * float(found[1]):g} mm/s"


def _heaviest(place: Chosen) -> tuple[str, str]:
    """The option or key that loads the robot, and what it says."""
    gravity = f"{','.join(f'{x:g}' for x in place.source.gravity)} m/s2"
    if place.asked.tracker_mass is not None:
        return "--tracker-mass-g", f"{place.asked.tracker_mass} with gravity {gravity}"
    return ("--gravity" if place.asked.gravity is not None else f"{place.file}: bench.gravity_m_s2"), gravity


def _hung(place: Chosen) -> str:
    """Robot, torsion, mass and gravity."""
    from ..rig.benches import loads_of

    robot, mass = place.source.robot, sum(each.mass for each in loads_of(place.source))
    hangs = f"{1e3 * mass:g} g and " if mass else ""
    return f"{robot.name}, torsion {robot.torsion}, with {hangs}gravity ({listed(place.source.gravity)}) m/s2"


def _origin(limits: Limits, place: Chosen) -> str:
    """Where the limit of the tension comes from."""
    from ..rig.model_limits import SHARE

    if "tension" in place.source.limits:
        return f"limits.tension_n = {limits.tension:g} in {place.file}"
    return (
        f"{limits.tension:.4g} N, which is {SHARE:g} of what brings {_hung(place)}, to the end of linear elasticity; "
        "limits.tension_n of a bench file sets another"
    )


def _span(angles: Sequence[float]) -> str:
    return f"from {degrees(min(angles)):.4g} to {degrees(max(angles)):.4g}"
