"""From a solved body to a `Snapshot`: clearances, contacts, targets, gauges and warnings."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees, isfinite
from types import MappingProxyType
from typing import Any

import numpy as np

from .mechanics import Body
from .ranges import Condition, condition_of
from .scenario import Scenario
from .snapshot import Gauge, Notice, Snapshot
from .touch import Touch, touch_of

TOUCHING = 1e-5  # m, by which a wall may be entered: the contact's tolerance
ROUGH = 5e-5  # m, error of a shape that is told
AT_STOP = 1e-9  # of a range


def observed(scenario: Scenario, body: Body, **course: Any) -> Snapshot:
    """The snapshot of ``body``; course: index, time, blocked, reached (so far) of `Snapshot`, and more ``warnings``."""
    shape, phantom = body.shape, scenario.phantom
    radius = scenario.robot.outer_radius(shape.material_coordinate)
    clearance = {name: distance - radius for name, distance in phantom.clearance(shape.centerline).items()}
    touch, condition = touch_of(scenario, shape), condition_of(shape)
    gauges = _gauges(scenario, body, touch, condition)
    told = (*course.pop("warnings", ()), *_warnings(scenario, body, gauges, clearance, condition))
    distances = _distances(scenario, shape.centerline[-1])
    return Snapshot(
        posture=body.posture, tube=scenario.tube, s=shape.s, centerline=shape.centerline, frames=shape.rotation,
        radius=_frozen(radius), clearance=_frozen_all(clearance), contact_point=touch.point,
        contact_force=_frozen(touch.force), contact_pressure=_frozen(touch.pressure),
        contact_structure=touch.structure, pressure=_frozen(touch.along), target_distance=MappingProxyType(distances),
        reached=_reached(scenario, distances, course.pop("reached", ())), limits=MappingProxyType(gauges),
        warnings=told, in_range=_holds(gauges, condition), **course,
    )  # fmt: skip


def _distances(scenario: Scenario, tip: np.ndarray) -> dict[str, float]:
    off = scenario.target_positions - tip
    return dict(zip(scenario.phantom.targets, np.sqrt((off * off).sum(axis=1)).tolist(), strict=True))


def _reached(scenario: Scenario, distances: Mapping[str, float], before: tuple[str, ...]) -> tuple[str, ...]:
    targets = scenario.phantom.targets
    new = [name for name, far in distances.items() if far <= targets[name].tolerance and name not in before]
    return (*before, *new)


def _gauges(scenario: Scenario, body: Body, touch: Touch, condition: Condition) -> dict[str, Gauge]:
    limits, posture = scenario.limits, body.posture
    pressure = float(touch.pressure[touch.is_soft].max(initial=0.0))
    force = float(np.linalg.norm(touch.force.sum(axis=0)))
    allowed = limits.buckling * condition.euler if isfinite(condition.euler) else 0.0
    return {
        "insertion": _stop(posture.insertion, 0.0, limits.insertion, "1"),
        "rotation": _stop(posture.rotation, -limits.rotation, limits.rotation, "rad"),
        "tension": _stop(max(posture.tension, default=0.0), 0.0, limits.tension, "N"),
        "strain": _upper(condition.strain, limits.strain, "1"),
        "pressure": _upper(pressure, limits.pressure, "Pa"),
        "push": Gauge(value=condition.push, low=0.0, high=allowed, unit="N", is_exceeded=condition.push > allowed),
        "contact_force": Gauge(value=force, low=0.0, high=float("inf"), unit="N", is_exceeded=False),
    }


def _stop(value: float, low: float, high: float, unit: str) -> Gauge:
    return Gauge(value=value, low=low, high=high, unit=unit, is_exceeded=False)


def _upper(value: float, high: float, unit: str) -> Gauge:
    return Gauge(value=value, low=0.0, high=high, unit=unit, is_exceeded=value > high)


def _holds(gauges: Mapping[str, Gauge], condition: Condition) -> bool:
    """Whether the model's own assumptions hold: too much pressure on tissue is bad, but well computed."""
    return not (gauges["strain"].is_exceeded or gauges["push"].is_exceeded or condition.lifted or condition.closed)


def _warnings(scenario, body: Body, gauges, clearance, condition: Condition) -> tuple[Notice, ...]:
    found = [
        *_at_stops(scenario, gauges),
        *_beyond(scenario, gauges, condition),
        *_inside(clearance, body),
        *_rough(body),
    ]
    return tuple(Notice(code=code, text=text, severity=severity) for code, text, severity in found)


def _at_stops(scenario: Scenario, gauges: Mapping[str, Gauge]):
    length = 1e3 * scenario.robot.section.L  # as the drive and the page count it
    says = {
        "insertion": lambda x: f"insertion {length * x:.1f} mm",
        "rotation": lambda x: f"rotation {degrees(x):.0f} deg",
        "tension": lambda x: f"tension {x:.3g} N",
    }
    for name, text in says.items():
        gauge = gauges[name]
        near = AT_STOP * (gauge.high - gauge.low)
        if gauge.value >= gauge.high - near and gauge.high > gauge.low:
            yield f"{name}-stop", f"{text(gauge.value)} is the most that is allowed", "info"
        elif name == "rotation" and gauge.value <= gauge.low + near:
            yield f"{name}-stop", f"{text(gauge.value)} is the least that is allowed", "info"


def _beyond(scenario: Scenario, gauges: Mapping[str, Gauge], condition: Condition):
    strain, pressure, push = (gauges[name] for name in ("strain", "pressure", "push"))
    if strain.is_exceeded:
        where = f"at {1e3 * condition.strain_at:.1f} mm from the exit"
        text = f"strain {100 * strain.value:.3f} % {where} is past the {100 * strain.high:.3f} % of linear elasticity"
        yield "strain", f"{text}: the model is wrong here", "limit"
    if condition.closed:
        yield "closure", "the notches close: the model is wrong here", "limit"
    if condition.lifted:
        which = ", ".join(map(str, condition.lifted))
        text = f"tendon {which} lifts off its wall at {gauges['tension'].value:.3f} N"
        yield "lift-off", f"{text}: it runs shorter than the model has it; pull more", "warning"
    if push.is_exceeded:
        text = f"{1e3 * push.value:.1f} mN push on the robot, whose Euler load at this length is"
        yield "euler", f"{text} {1e3 * condition.euler:.1f} mN: it may buckle", "limit"
    if pressure.is_exceeded:
        text = f"contact pressure {1e-3 * pressure.value:.1f} kPa on soft tissue is above"
        yield "pressure", f"{text} {1e-3 * pressure.high:.1f} kPa", "limit"


def _rough(body: Body):
    error = body.shape.error_estimate
    if error > ROUGH:
        yield "accuracy", f"the shape is known to {1e3 * error:.2g} mm only, because of its contact", "info"


def _inside(clearance: Mapping[str, np.ndarray], body: Body):
    for name, gap in clearance.items():
        deepest = int(gap.argmin())
        if gap[deepest] < -2.0 * TOUCHING:
            where = f"{1e3 * float(body.shape.s[deepest]):.1f} mm from the exit"
            yield "inside", f"the tube enters the {name} by {-1e3 * gap[deepest]:.2f} mm, {where}", "warning"


def _frozen(array: np.ndarray) -> np.ndarray:
    array.setflags(write=False)
    return array


def _frozen_all(arrays: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
    return MappingProxyType({name: _frozen(array) for name, array in arrays.items()})
