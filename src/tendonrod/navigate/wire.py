"""Scenario, snapshot and meshes as they go to the page: plain numbers, rounded, small. See `told`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from math import isfinite
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np

from .told import MOST_CONTACTS, MOST_POINTS

if TYPE_CHECKING:
    from .film import Playing
    from .outer_tube import OuterTube
    from .recovery import Trouble
    from .scenario import Scenario
    from .snapshot import Gauge, Snapshot

LENGTH, FORCE, PRESSURE, DIRECTION = 7, 6, 1, 5  # decimals: 0.1 um, 1 uN, 0.1 Pa


def scene(scenario: Scenario, gauges: Mapping[str, Gauge]) -> dict[str, Any]:
    """As `told.Scene`. gauges: those of a snapshot, for their names, bounds and units."""
    robot = scenario.robot
    return {
        "robot": {
            "name": robot.name,
            "torsion": str(robot.torsion),
            "length": float(robot.section.L),
            "outer_radius": scenario.outer_radius,
            "tendons": robot.n_tendons,
        },
        "phantom": _phantom(scenario),
        "limits": [
            {"name": name, "low": _number(each.low), "high": _number(each.high), "unit": each.unit}
            for name, each in gauges.items()
        ],
        "gravity": list(scenario.gravity),
        "tube": tube(scenario.tube),
    }


def _phantom(scenario: Scenario) -> dict[str, Any]:
    phantom = scenario.phantom
    structures = [
        {
            "name": name,
            "role": str(each.role),
            "is_wall": bool(each.is_wall),
            "url": f"/api/meshes/{quote(name, safe='')}.stl",
        }
        for name, each in phantom.structures.items()
    ]
    targets = [
        {
            "name": name,
            "level": each.level,
            "position": _row(each.position, LENGTH),
            "tolerance": float(each.tolerance),
            "side": each.side,
            "description": each.description,
        }
        for name, each in phantom.targets.items()
    ]
    levels = [_level(scenario, each) for each in phantom.levels]
    return {
        "name": phantom.name, "kind": phantom.kind, "structures": structures, "targets": targets, "levels": levels
    }  # fmt: skip


def _level(scenario: Scenario, level: Any) -> dict[str, Any]:
    from .scenario import default_tube

    phantom = scenario.phantom
    entry = phantom.entries.get(level.name)
    return {
        "name": level.name,
        "z_low": float(level.z_low),
        "z_high": float(level.z_high),
        "entry_height": _number(getattr(entry, "height", None)),
        "entry_depth": _number(getattr(entry, "depth", None)),
        "tube": None if entry is None else tube(default_tube(phantom, level.name, scenario.robot)),
    }


def state(
    snapshot: Snapshot, *, moving: bool, mode: str, recording: str | None, film: Playing | None = None,
    trouble: Trouble | None = None,
) -> str:  # fmt: skip
    """The snapshot as the text of a `told.State`; usually 3 to 7 kB."""
    count = len(snapshot.centerline)
    at = np.linspace(0, count - 1, min(count, MOST_POINTS)).round().astype(int)
    values = {
        "type": "state",
        "index": int(snapshot.index),
        "time": round(float(snapshot.time), 6),
        "insertion": round(float(snapshot.insertion), 7),
        "rotation": round(float(snapshot.rotation), 6),
        "tension": _row(snapshot.tension, FORCE),
        "tube": tube(snapshot.tube),
        "centerline": _row(snapshot.centerline[at], LENGTH),
        "clearance": {name: _row(each[at], LENGTH) for name, each in snapshot.clearance.items()},
        "pressure": _row(snapshot.pressure[at], PRESSURE),
        "contacts": _contacts(snapshot),
        "tip": _row(snapshot.tip, LENGTH),
        "tip_direction": _row(snapshot.tip_direction, DIRECTION),
        "targets": {name: round(float(each), LENGTH) for name, each in snapshot.target_distance.items()},
        "reached": list(snapshot.reached),
        "gauges": {name: _gauge(each) for name, each in snapshot.limits.items()},
        "warnings": [{"code": each.code, "text": each.text, "severity": each.severity} for each in snapshot.warnings],
        "in_range": bool(snapshot.in_range),
        "blocked": snapshot.blocked,
        "fault": None if trouble is None else asdict(trouble),
        "moving": moving,
        "mode": mode,
        "recording": recording,
        "replay": None if film is None else film._asdict(),
    }
    return json.dumps(values, separators=(",", ":"), allow_nan=False)


def tube(pose: OuterTube) -> dict[str, float]:
    """As `told.TubePose`."""
    return {name: round(value, 9) for name, value in asdict(pose).items()}


def stl(mesh: tuple[np.ndarray, np.ndarray], name: str) -> bytes:
    """Binary STL of vertices (n, 3) and faces (m, 3), in the vertices' own unit."""
    vertices, faces = (np.asarray(each) for each in mesh)
    corners = vertices[faces].astype("<f4")
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows = np.zeros(len(corners), dtype=kind)
    rows["normal"], rows["corners"] = normal / np.where(size > 0.0, size, 1.0), corners
    title = f"tendonrod {name}, m".encode("ascii", "replace")[:80].ljust(80)
    return title + np.uint32(len(rows)).astype("<u4").tobytes() + rows.tobytes()


def _contacts(snapshot: Snapshot) -> list[dict[str, Any]]:
    """The strongest, in their order along the body."""
    force = np.asarray(snapshot.contact_force)
    if not len(force):
        return []
    strongest = np.sort(np.argsort(-np.linalg.norm(force, axis=1), kind="stable")[:MOST_CONTACTS])
    columns = (
        _row(snapshot.contact_point[strongest], LENGTH),
        _row(force[strongest], FORCE),
        _row(snapshot.contact_pressure[strongest], PRESSURE),
    )
    return [
        {"point": point, "force": pull, "pressure": pressure} for point, pull, pressure in zip(*columns, strict=True)
    ]


def _gauge(gauge: Gauge) -> dict[str, Any]:
    bounds = {"value": _number(gauge.value), "low": _number(gauge.low), "high": _number(gauge.high)}
    return {**bounds, "unit": gauge.unit, "exceeded": bool(gauge.is_exceeded)}


def _row(values: Any, digits: int) -> list[Any]:
    """Rounded, as nested lists; None where not finite."""
    array = np.asarray(values, dtype=float)
    rounded = np.round(array, digits).tolist()
    return rounded if np.isfinite(array).all() else _without_nan(rounded)


def _without_nan(values: Any) -> Any:
    return (
        [_without_nan(each) for each in values] if isinstance(values, list) else (values if isfinite(values) else None)
    )


def _number(value: float | None) -> float | None:
    """To six digits; None where not finite."""
    return float(f"{float(value):.6g}") if value is not None and isfinite(value) else None
