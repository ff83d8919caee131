"""`write_bench`: the page of follow-the-leader trials on a bench, the paper's Fig. 8, beside what the paper prints."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, asdict, fields, is_dataclass
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InvalidInput
from ..rig.inserted import Inserted, inserted
from ..rig.record_layout import as_json
from ..rig.trials import Followed
from . import paper
from .chapter import Cell, Number, Picture, Table, interval, listed, mm
from .page import write_page

UNSAID = "the record does not say"
DIFFERING = ("profile", "feed_forward")  # of a header: what may tell trials of one page apart
_NOT_COMPARED = ("robot", "gravity", "injections")  # of a setup: said elsewhere


def write_bench(
    found: Sequence[Followed],
    out: str | os.PathLike[str],
    watch: Callable[[int, int, str], None] | None = None,
) -> Path:
    """Write index.html with figures and tables of ``found`` into the directory ``out``; returns the page's path.

    found: trials of one robot, target, gravity; the figures draw the model and the profile of the first. A trial that a
    fault ended is shown as far as it came. watch(done, total, what): called before each figure. Raises `InvalidInput`
    for no trial, trials of different robots, targets or gravity, and where ``out`` cannot be written.
    """
    _check(found)
    names, ways = trial_names(found), [inserted(each) for each in found]
    return write_page(
        out,
        "bench.html.j2",
        f"{found[0].robot.name}: follow-the-leader on the bench",
        [tip_table(found, names, ways), trial_table(found, names, ways)],
        _pictures(found, names, ways),
        facts(found, names, ways),
        watch=watch,
    )


def _check(found: Sequence[Followed]) -> None:
    if not found:
        raise InvalidInput("trials", found, "one or more")
    kinds = {(each.robot.name, each.robot.torsion, each.target, tuple(each.gravity)) for each in found}
    if len(kinds) > 1:
        raise InvalidInput("trials", sorted(map(str, kinds)), "of one robot, torsion, target and gravity")


def trial_names(found: Sequence[Followed]) -> list[str]:
    """trial 1, trial 2, ..., each with what tells it from the others."""
    headers = [each.record.header for each in found]
    differing = [key for key in DIFFERING if len({str(header.get(key)) for header in headers}) > 1]
    told = [", ".join(_difference(key, header.get(key)) for key in differing) for header in headers]
    return [f"trial {k}{f' ({text})' if text else ''}" for k, text in enumerate(told, 1)]


def _difference(key: str, value: object) -> str:
    return f"{'with' if value else 'no'} feed-forward" if key == "feed_forward" else str(value)


def tip_table(found: Sequence[Followed], names: Sequence[str], ways: Sequence[Inserted]) -> Table:
    """Root mean square distances of the tip from the reference: trials, model, paper."""
    rows: list[list[Cell]] = [
        [_whole(name), *map(_mm, way.tip_rmse), "–", Number(len(way.tip_error), 0)]
        for name, way in zip(names, ways, strict=True)
    ]
    rows.append(["model at the profile’s tension, to <i>η</i> = 1", *map(_mm, planned_rmse(found[0])), "–", "–"])
    printed = [(f"the paper’s trial {k}", value) for k, value in enumerate(paper.FTL_TIP_RMSE_TRIALS, 1)]
    printed.append(("the paper’s simulation", paper.FTL_TIP_RMSE_SIMULATED))
    rows += [[name, "–", "–", mm(value), "–"] for name, value in printed]
    header = ("tip RMSE (mm)", "by projection", "at the same insertion", "metric not stated", "frames")
    return Table(name="tip", header=header, rows=rows)


def trial_table(found: Sequence[Followed], names: Sequence[str], ways: Sequence[Inserted]) -> Table:
    """How each trial ran and ended."""
    rows: list[list[Cell]] = [
        [
            _whole(name),
            *_run(each),
            *(_mN(value) for value in (way.error_rms, way.error_max)),
            Number(way.frames, 0),
            Number(way.lost, 0),
            ended(each),
            escape(each.record.condition),
        ]
        for name, each, way in zip(names, found, ways, strict=True)
    ]
    header = (
        "", "seed", "duration (s)", "periods", "longest (ms)", "tension error, rms (mN)", "largest (mN)",
        "tracker frames", "lost", "ended", "record",
    )  # fmt: skip
    return Table(name="trials", header=header, rows=rows)


def _run(each: Followed) -> list[Cell]:
    outcome, seed = each.outcome, each.record.header.get("seed")
    length = Number(1e3 * outcome.longest, 2)
    return ["–" if seed is None else str(seed), Number(outcome.duration, 1), Number(outcome.periods, 0), length]


def ended(each: Followed) -> str:
    """How a trial ended, in words."""
    if each.outcome.is_done:
        return "done"
    return escape(f"fault: {each.outcome.fault}" if each.outcome.fault else "ended by who watched")


def planned_rmse(found: Followed) -> tuple[float, float]:
    """Root mean square errors (m) of the tip of the model along the profile: by projection, at the same insertion."""
    from ..plot.bench_lines import planned_tip, tip_errors

    by_projection, at_insertion = np.sqrt(np.mean(tip_errors(found, *planned_tip(found)) ** 2, axis=0)).tolist()
    return by_projection, at_insertion


def facts(found: Sequence[Followed], names: Sequence[str], ways: Sequence[Inserted]) -> dict[str, Any]:
    """What the page's sentences say."""
    first, headers = found[0], [each.record.header for each in found]
    done = sum(each.outcome.is_done for each in found)
    return {
        "robot": escape(first.robot.name),
        "trials": len(found),
        "is_virtual": all(_is_virtual(each) for each in found),
        "bench": _each(escape(str(header.get("bench", "unnamed bench"))) for header in headers),
        "torsion": first.robot.torsion,
        "target": Number(first.target, 2),
        "gravity": ", ".join(f"{x:g}".replace("-", "−") for x in first.gravity),
        "profiles": _each(escape(each.profile.name) for each in found),
        "rate": _each(_said(header.get("rate"), "Hz") for header in headers),
        "gains": _each(map(_gains, headers)),
        "done": done,
        "ends": [f"{name}: {ended(each)}" for name, each in zip(names, found, strict=True) if not each.outcome.is_done],
        "out": [f"{name} never set out" for name, way in zip(names, ways, strict=True) if not len(way.time)],
        "rmse": [_spread([way.tip_rmse[k] for way in ways], 1e3, 2) for k in (0, 1)],
        "planned": [mm(value) for value in planned_rmse(first)],
        "paper": listed(mm(value) for value in paper.FTL_TIP_RMSE_TRIALS),
        "simulated": mm(paper.FTL_TIP_RMSE_SIMULATED),
        "error_rms": _spread([way.error_rms for way in ways], 1e3, 1),
        "error_max": _spread([way.error_max for way in ways], 1e3, 1),
        "is_papers": _of_the_papers(first),
        "is_rehearsal": any(header.get("rehearsal") for header in headers),
        "set_out": any(np.isfinite(way.error_rms) for way in ways),
        "commands_papers": any(each.profile.name == "paper" for each in found),
        "has_tip": any(len(way.tip) for way in ways),
    } | _of_the_bench(headers)


def _of_the_bench(headers: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Friction, mass and noise as the records have them; what departs from the defaults."""
    setups = [header.get("setup") or {} for header in headers]
    noises = {(setup.get("tracker") or {}).get("position_noise") for setup in setups}
    (noise,) = noises if len(noises) == 1 else (None,)
    return {
        "tendon_friction": _each(_said(setup.get("tendon_friction")) for setup in setups),
        "outer_friction": _each(_said(setup.get("outer_friction"), "N") for setup in setups),
        "mass": _each(map(_masses, headers)),
        "noise": None if noise is None else [mm(np.sqrt(2.0 / 3.0) * noise), mm(noise)],
        "departures": list(dict.fromkeys(text for setup in setups for text in departures(setup))),
        "disturbed": sum(bool(setup.get("injections")) for setup in setups),
    }


def _masses(header: Mapping[str, Any]) -> str:
    masses = [each.get("mass") for each in header.get("trackers", ())]
    return listed(UNSAID if mass is None else _said(1e3 * mass, "g") for mass in masses) if masses else "no tracker"


def _each(texts: Iterable[str]) -> str:
    """Those that differ."""
    return listed(dict.fromkeys(texts))


def departures(setup: Mapping[str, Any]) -> list[str]:
    """Numbers of a recorded virtual setup that are not the defaults of `VirtualSetup`, as a bench file says them."""
    from ..rig.benchfile_units import in_file_units
    from ..rig.virtual.setup import VirtualSetup

    usual = {each.name: _default(each) for each in fields(VirtualSetup) if each.name not in _NOT_COMPARED}
    given, plain = (dict(_flat(json.loads(as_json(each)))) for each in (setup, usual))
    other = [in_file_units(key, given[key]) for key in plain if key in given and given[key] != plain[key]]
    return [f"{key} = {_text(value)}" for key, value in other]


def _default(each: Any) -> Any:
    value = each.default_factory() if each.default_factory is not MISSING else each.default
    return asdict(value) if is_dataclass(value) and not isinstance(value, type) else value


def _flat(tree: Mapping[str, Any], above: str = "") -> list[tuple[str, Any]]:
    """(dotted name, value) of all leaves."""
    found = []
    for key, value in tree.items():
        found += _flat(value, f"{above}{key}.") if isinstance(value, Mapping) else [(f"{above}{key}", value)]
    return found


def _pictures(found: Sequence[Followed], names: Sequence[str], ways: Sequence[Inserted]) -> list[Picture]:
    from ..plot import bench as plots
    from ..plot import bench_space

    marks = paper.FTL_TIP_RMSE_TRIALS if _of_the_papers(found[0]) else ()
    draw = {
        "tip": partial(plots.tip_figure, marks=marks),
        "path": bench_space.path_figure,
        "bodies": bench_space.bodies_figure,
        "tension": plots.tension_figure,
        "control": plots.control_figure,
    }
    if not any(len(way.tip) for way in ways):
        draw = {name: draw[name] for name in ("tension", "control")}
    return [Picture(name=name, draw=partial(each, found, names)) for name, each in draw.items()]


def _is_virtual(each: Followed) -> bool:
    header = each.record.header
    return bool(header.get("virtual", str(header.get("bench", "")).startswith("virtual")))


def is_papers(robot: str, target: float, gravity: Sequence[float], end: float = 1.0) -> bool:
    """Whether robot, target (N), gravity (m/s2) and the insertion at the end are those of the paper's trials."""
    same = robot == "exonav-1" and abs(target - paper.LARGEST_TENSION) < 1e-9 and end == 1.0
    return same and bool(np.allclose(gravity, paper.GRAVITY))


def _of_the_papers(each: Followed) -> bool:
    return is_papers(each.robot.name, each.target, each.gravity, each.record.header.get("end", 1.0))


def _said(value: float | None, unit: str = "") -> str:
    return UNSAID if value is None else f"{value:g} {unit}".strip()


def _gains(header: Mapping[str, Any]) -> str:
    kp, ki = (header.get(key) for key in ("kp", "ki"))
    ahead = ", with feed-forward" if header.get("feed_forward") else ""
    return UNSAID if kp is None or ki is None else f"{1e3 * kp:g} (mm/s)/N and {1e3 * ki:g} (mm/s²)/N{ahead}"


def _text(value: Any) -> str:
    return escape(json.dumps(value)).replace("&quot;", "")


def _mm(value: float) -> Cell:
    return "–" if np.isnan(value) else mm(value)


def _mN(value: float) -> Cell:
    return "–" if np.isnan(value) else Number(1e3 * value, 1)


def _whole(name: str) -> str:
    """A name that is not broken at its spaces."""
    return escape(name).replace(" ", "\u00a0")


def _spread(values: Sequence[float], factor: float, digits: int) -> str:
    known = [factor * value for value in values if np.isfinite(value)]
    return interval(known, digits) if known else "–"
