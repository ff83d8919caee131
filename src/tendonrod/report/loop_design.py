"""`design_page`: the tension loop on one page, with its diagram, margins, step responses and gains."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import positive
from ..rig import design
from ..rig.design import Designed, Loop, largest_error, margins
from .chapter import Number, Picture, Table
from .page import write_page

if TYPE_CHECKING:
    from ..plot.loop_design import Trace

HEADER = (
    "insertion <i>η</i>",
    "compliance (mm/N)",
    "damping (-)",
    "crossover (rad/s)",
    "phase margin (deg)",
    "gain margin (-)",
    "delay margin (ms)",
    "bandwidth (rad/s)",
    "error as the screw starts (mN)",
)


def design_page(
    out: str | os.PathLike[str],
    found: Designed,
    screw_rate: float = 1e-3,
    traces: Mapping[str, Trace] | None = None,
    source: str = "ROBOT",
) -> Path:
    """Write the page and its figures (PNG, SVG) and tables (CSV) to the directory ``out``; the path of its index.html.

    found: of `rig.design.designed`; screw_rate: m/s; traces: runs that are compared, such as {"PI": ..., "PI +
    feed-forward": ...}; source: the robot, and its torsion model, as a command names them. Raises `InvalidInput`.
    """
    rate = positive("screw_rate", screw_rate)
    kinds = (("margins-paper", found.paper), ("margins-suggested", found.suggested))
    tables = [_table(name, loops, found.insertions, rate) for name, loops in kinds]
    facts = _facts(found, tables, rate) | {"command": command(found, source)}
    pictures = _pictures(found, rate, traces or {})
    return write_page(out, "loop_design.html.j2", f"The tension loop of {found.robot.name}", tables, pictures, facts)


def command(found: Designed, source: str) -> str:
    """The line that runs a trial with the suggested gains."""
    kp, ki = found.gains
    pull = ",".join(f"{x:g}" for x in found.gravity)
    loaded = f" --gravity={pull}" if any(found.gravity) else ""
    gains = f"--kp {1e3 * kp:.3g} --ki {1e3 * ki:.3g}"
    return f"tendonrod rig ftl {source} --target {found.tension:g}{loaded} {gains} --output trials"


def _pictures(found: Designed, rate: float, traces: Mapping[str, Trace]) -> list[Picture]:
    from ..plot.loop_design import comparison_figure, loop_diagram, margins_figure, step_figure

    loops = (found.paper, found.suggested, found.insertions)
    pictures = [
        Picture(name="loop", draw=loop_diagram),
        Picture(name="margins", draw=partial(margins_figure, *loops)),
        Picture(name="steps", draw=partial(step_figure, *loops, rate)),
    ]
    return [*pictures, Picture(name="comparison", draw=partial(comparison_figure, traces))] if traces else pictures


def _table(name: str, loops: Sequence[Loop], insertions: Sequence[float], rate: float) -> Table:
    rows = []
    for eta, loop in zip(insertions, loops, strict=True):
        found = margins(loop)
        values = (1e3 * loop.compliance, loop.damping, found.crossover, found.phase, found.gain, 1e3 * found.delay)
        digits = (3, 2, 1, 1, 2, 1, 1, 1)
        all_values = (*values, found.bandwidth, 1e3 * largest_error(loop, rate))
        rows.append([Number(eta, 2), *(Number(x, n) for x, n in zip(all_values, digits, strict=True))])
    return Table(name=name, header=HEADER, rows=rows)


def _facts(found: Designed, tables: Sequence[Table], rate: float) -> dict[str, Any]:
    """What the page's sentences say."""
    first, chosen = found.paper[0], found.suggested[0]
    worst, full = margins(first), margins(found.paper[-1])
    peaks = [max(tables[k].rows, key=_error_of) for k in (0, 1)]
    return {
        "robot": found.robot.name,
        "torsion": found.robot.torsion,
        "tension": Number(found.tension, 2),
        "gravity": ", ".join(f"{x:g}".replace("-", "−") for x in found.gravity),
        "compliance": Number(1e3 * found.compliance, 2),
        "kp": Number(1e3 * chosen.kp, 1),
        "ki": Number(1e3 * chosen.ki, 1),
        "lag": Number(1e3 * first.lag, 1),
        "delay": Number(1e3 * first.delay, 1),
        "filter": Number(1e3 * first.filter, 1),
        "worst": Number(worst.phase, 0),
        "full": Number(full.phase, 0),
        "worst_gain": Number(worst.gain, 1),
        "phase": Number(design.PHASE_MARGIN, 0),
        "damping": Number(design.DAMPING, 1),
        "rate": Number(1e3 * rate, 2),
        "bound": [Number(1e3 * rate / loop.kp, 0) for loop in (first, chosen)],
        "peak": [peak[-1] for peak in peaks],
        "peak_at": [peak[0] for peak in peaks],
    }


def _error_of(row: Sequence[Any]) -> float:
    return row[-1].value
