"""What `tendonrod trial` prints."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING, Any

from . import output
from .shape_page import listed

if TYPE_CHECKING:
    import numpy as np

    from ..measurement.trial import Tracker, Trial

LONGEST = 100  # characters of what a file says of its origin that are shown
SHOWN = 8  # row numbers told of each fate


def _fates(found: Any) -> list[tuple[str, str, int, list[int]]]:
    """(tracker, fate, how many, their row numbers from 1), the kept ones first; missing poses by what was said."""
    from ..measurement.trial import KEPT, MISSING_POSE

    told = []
    for each, fates, states in zip(found.trackers, found.fates.T, found.state.T, strict=True):
        rows: dict[str, list[int]] = {}
        for k, (fate, state) in enumerate(zip(fates, states, strict=True), 1):
            said = f"{fate} ({state})" if fate == MISSING_POSE and state else fate
            rows.setdefault(said, []).append(k)
        order = sorted(rows, key=lambda fate: (fate != KEPT, -len(rows[fate])))
        told += [(each.name, fate, len(rows[fate]), rows[fate]) for fate in order]
    return told


def _place(found: Trial, tracker: Tracker) -> str:
    from ..measurement.trial import BASE

    if tracker.on == BASE:
        return "base, fixed"
    return "tip" if tracker.at is None else f"{1e3 * tracker.at:.6g} mm of {1e3 * found.robot.length_na:.6g} mm"


def _ranges(found: Any) -> list[tuple[str, str, str, int]]:
    """(quantity, from, to, how many samples have it)."""
    import numpy as np

    T = found.robot.n_tendons
    rows = [("time (s)", found.time)]
    rows += [(f"tension{_of(i, T)} (N)", found.tensions[:, i]) for i in range(T)]
    rows += [(f"displacement{_of(i, T)} (mm)", 1e3 * found.displacements[:, i]) for i in range(T)]
    rows += [("insertion", found.insertion), ("rotation (deg)", np.degrees(found.rotation))]
    return [(name, *_ends(values)) for name, values in rows]


def _of(i: int, T: int) -> str:
    return f" {i + 1}" if T > 1 else ""


def _ends(values: np.ndarray) -> tuple[str, str, int]:
    import numpy as np

    known = values[np.isfinite(values)]
    if not known.size:
        return "-", "-", 0
    return f"{known.min():.6g}", f"{known.max():.6g}", int(known.size)


def _rate(found: Trial) -> float | None:
    """Samples per second: one over the median step between times."""
    import numpy as np

    steps = np.diff(found.time)
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    return float(1.0 / np.median(steps)) if steps.size else None


def page(found: Trial) -> str:
    """What a trial holds and which samples count, as text for people."""
    n, rate = found.time.size, _rate(found)
    title = f"{found.name}: {found.robot.name}, {n} sample{'s' * (n != 1)}" + (f", {rate:.4g} per s" if rate else "")
    known = "known" if found.T_world_field is not None else "not known: positions are in the frame of the field"
    facts = [("gravity", f"({listed(found.gravity)}) m/s2, world"), ("T_world_field", known)]
    if found.quality_limit is not None:
        facts.append(("quality limit", f"{1e3 * found.quality_limit:.6g} mm"))
    facts += [(f"tracker {each.name}", _tracker_text(found, each)) for each in found.trackers]
    facts += [(key, _short(text)) for key, text in found.origin.items() if key != "columns not read"]
    fates = [(name, fate, str(count), _rows(rows, count, n)) for name, fate, count, rows in _fates(found)]
    ranges = [(name, low, high, str(count)) for name, low, high, count in _ranges(found)]
    return "\n\n".join(
        (
            output.heading(title),
            output.table(("", ""), facts, words=(0, 1)),
            output.table(("", "from", "to", "samples"), ranges, words=(0,)),
            output.table(("tracker", "fate", "samples", "rows"), fates, words=(0, 1, 3)),
        )
    )


def _short(text: str) -> str:
    """``text`` on one line, cut where it is long."""
    line = " ".join(text.split())
    return line if len(line) <= LONGEST else f"{line[:LONGEST]}... ({len(line)} characters; --json shows all)"


def _tracker_text(found: Trial, each: Tracker) -> str:
    parts = [_place(found, each)]
    if any(each.offset) or any(each.point):
        parts.append(f"sensor ({', '.join(f'{1e3 * value:.6g}' for value in each.arm)}) mm from the tube's axis")
    parts.append("turn not known" if each.turn is None else f"turn ({listed([degrees(a) for a in each.turn])}) deg")
    return ", ".join([*parts, *([f"{1e3 * each.mass:.6g} g"] if each.mass else [])])


def _rows(rows: list[int], count: int, n: int) -> str:
    if count == n:
        return "all"
    return ", ".join(str(row) for row in rows[:SHOWN]) + (", ..." if count > SHOWN else "")


def as_dict(found: Trial) -> dict[str, Any]:
    """The same, SI, for JSON, with the numbers of all rows."""
    plain = {name: getattr(found, name) for name in ("name", "quality_limit", "position_noise", "orientation_noise")}
    known = None if found.T_world_field is None else found.T_world_field.tolist()
    return {
        **plain,
        "robot": found.robot.name,
        "samples": found.time.size,
        "rate": _rate(found),
        "gravity": list(found.gravity),
        "T_world_field": known,
        "tension_noise": found.tension_noise,
        "trackers": [
            {
                "name": each.name,
                "on": each.on,
                "at": each.at,
                "arm": list(each.arm),
                "turn": each.turn,
                "mass": each.mass,
            }
            for each in found.trackers
        ],
        "ranges": {name: [low, high, count] for name, low, high, count in _numbers(found)},
        "fates": [
            {"tracker": name, "fate": fate, "samples": count, "rows": rows} for name, fate, count, rows in _fates(found)
        ],
        "origin": dict(found.origin),
        "notes": found.notes,
        "units": "SI",
    }


def _numbers(found: Trial):
    import numpy as np

    for name in ("time", "tensions", "displacements", "insertion", "rotation"):
        values = getattr(found, name)
        known = values[np.isfinite(values)]
        yield name, *((float(known.min()), float(known.max())) if known.size else (None, None)), int(known.size)
