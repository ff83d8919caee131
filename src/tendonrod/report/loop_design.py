"""`design_page`: the tension loop on one page, with its diagram, margins, step responses and gains."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import positive
from ..rig import design
from ..rig.design import Loop, at_insertions, margins, suggested, with_gains
from .chapter import Number, Picture, Table
from .page import write_page

if TYPE_CHECKING:
    from ..plot.loop_design import Trace
    from ..robot import Robot

INSERTIONS = (0.05, 0.25, 0.5, 0.75, 1.0)
COMPLIANCE = 0.51e-3  # m/N: 0.3 m of a 0.1 mm nitinol tendon
HEADER = (
    "insertion <i>η</i>",
    "compliance (mm/N)",
    "damping (-)",
    "crossover (rad/s)",
    "phase margin (deg)",
    "gain margin (-)",
    "delay margin (ms)",
    "bandwidth (rad/s)",
)


def design_page(
    out: str | os.PathLike[str],
    robot: Robot,
    tension: float = 0.7,
    gravity=(0.0, 0.0, 0.0),
    compliance: float = COMPLIANCE,
    insertions: Sequence[float] = INSERTIONS,
    screw_rate: float = 1e-3,
    traces: Mapping[str, Trace] | None = None,
    **loop: float,
) -> Path:
    """Write the page and its figures (PNG, SVG) and tables (CSV) to the directory ``out``; the path of its index.html.

    tension: N; gravity: m/s2; compliance: of the tendon itself, m/N; screw_rate: m/s; traces: runs that are compared,
    such as {"PI": ..., "PI + feed-forward": ...}; loop: lag, delay, filter of `Loop`, s. The torsion model is the
    robot's, and the page says which. Raises `InvalidInput`.
    """
    positive("screw_rate", screw_rate)
    insertions = sorted(insertions)
    paper = at_insertions(robot, insertions, tension, gravity, compliance, **loop)
    best = suggested([each.compliance for each in paper], **loop)
    chosen = with_gains(paper, best.kp, best.ki)
    tables = [
        _table(name, loops, insertions) for name, loops in (("margins-paper", paper), ("margins-suggested", chosen))
    ]
    facts = _facts(robot, tension, paper, chosen, screw_rate)
    pictures = _pictures(paper, chosen, insertions, screw_rate, traces or {})
    return write_page(out, "loop_design.html.j2", f"The tension loop of {robot.name}", tables, pictures, facts)


def _pictures(
    paper: Sequence[Loop], chosen: Sequence[Loop], insertions: Sequence[float], screw_rate: float,
    traces: Mapping[str, Trace],
) -> list[Picture]:  # fmt: skip
    from ..plot.loop_design import comparison_figure, loop_diagram, margins_figure, step_figure

    pictures = [
        Picture(name="loop", draw=loop_diagram),
        Picture(name="margins", draw=partial(margins_figure, paper, chosen, insertions)),
        Picture(name="steps", draw=partial(step_figure, paper, chosen, insertions, screw_rate)),
    ]
    return [*pictures, Picture(name="comparison", draw=partial(comparison_figure, traces))] if traces else pictures


def _table(name: str, loops: Sequence[Loop], insertions: Sequence[float]) -> Table:
    rows = []
    for eta, loop in zip(insertions, loops, strict=True):
        found = margins(loop)
        values = (1e3 * loop.compliance, loop.damping, found.crossover, found.phase, found.gain, 1e3 * found.delay)
        digits = (3, 2, 1, 1, 2, 1, 1)
        numbers = [Number(x, n) for x, n in zip((*values, found.bandwidth), digits, strict=True)]
        rows.append([Number(eta, 2), *numbers])
    return Table(name=name, header=HEADER, rows=rows)


def _facts(
    robot: Robot, tension: float, paper: Sequence[Loop], chosen: Sequence[Loop], screw_rate: float
) -> dict[str, Any]:
    """What the page's sentences say."""
    worst, full, wide = margins(paper[0]), margins(paper[-1]), 1e3 * screw_rate
    return {
        "torsion": robot.torsion,
        "tension": Number(tension, 2),
        "kp": Number(1e3 * chosen[0].kp, 1),
        "ki": Number(1e3 * chosen[0].ki, 1),
        "lag": Number(1e3 * paper[0].lag, 1),
        "delay": Number(1e3 * paper[0].delay, 1),
        "filter": Number(1e3 * paper[0].filter, 1),
        "worst": Number(worst.phase, 0),
        "full": Number(full.phase, 0),
        "worst_gain": Number(worst.gain, 1),
        "phase": Number(design.PHASE_MARGIN, 0),
        "damping": Number(design.DAMPING, 1),
        "rate": Number(1e3 * screw_rate, 2),
        "steady": Number(wide / paper[0].kp, 0),
        "steady_suggested": Number(wide / chosen[0].kp, 0),
    }
