"""`design_page`: the tension loop on one page, with its diagram, margins, step responses and gains."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InvalidInput, positive
from ..report.chapter import Number, Picture, Table
from . import design
from .design import Loop, at_insertions, margins, suggested, with_gains
from .design_figures import Trace, comparison_figure, loop_diagram, margins_figure, step_figure

if TYPE_CHECKING:
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
    pictures = [
        Picture(name="loop", draw=loop_diagram),
        Picture(name="margins", draw=partial(margins_figure, paper, chosen, insertions)),
        Picture(name="steps", draw=partial(step_figure, paper, chosen, insertions, screw_rate)),
    ]
    if traces:
        pictures.append(Picture(name="comparison", draw=partial(comparison_figure, traces)))
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for table in tables:
            table.write(folder / f"{table.name}.csv")
        images = {picture.name: picture.write(folder) for picture in pictures}
        page = folder / "index.html"
        page.write_text(_render(robot, tension, paper, chosen, tables, images, screw_rate), encoding="utf-8")
    except OSError as error:
        raise InvalidInput("out", str(out), f"a directory that can be written ({error.strerror or error})") from None
    return page


def _table(name: str, loops: Sequence[Loop], insertions: Sequence[float]) -> Table:
    rows = []
    for eta, loop in zip(insertions, loops, strict=True):
        found = margins(loop)
        values = (1e3 * loop.compliance, loop.damping, found.crossover, found.phase, found.gain, 1e3 * found.delay)
        digits = (3, 2, 1, 1, 2, 1, 1)
        numbers = [Number(x, n) for x, n in zip((*values, found.bandwidth), digits, strict=True)]
        rows.append([Number(eta, 2), *numbers])
    return Table(name=name, header=HEADER, rows=rows)


def _render(robot, tension, paper, chosen, tables, images, screw_rate: float) -> str:
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    environment = Environment(undefined=StrictUndefined, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["html"] = Markup
    source = (files("tendonrod.rig") / "design.html.j2").read_text(encoding="utf-8")
    style = (files("tendonrod.report") / "templates" / "style.css").read_text(encoding="utf-8")
    worst, full, wide = margins(paper[0]), margins(paper[-1]), 1e6 * screw_rate
    return environment.from_string(source).render(
        style=Markup(style),
        robot=robot,
        tension=Number(tension, 2),
        tables={table.name: table for table in tables},
        images=images,
        kp=Number(1e3 * chosen[0].kp, 1),
        ki=Number(1e3 * chosen[0].ki, 1),
        lag=Number(1e3 * paper[0].lag, 1),
        delay=Number(1e3 * paper[0].delay, 1),
        filter=Number(1e3 * paper[0].filter, 1),
        worst=Number(worst.phase, 0),
        full=Number(full.phase, 0),
        worst_gain=Number(worst.gain, 1),
        phase=Number(design.PHASE_MARGIN, 0),
        damping=Number(design.DAMPING, 1),
        rate=Number(1e3 * screw_rate, 2),
        steady=Number(wide / paper[0].kp / 1e3, 0),
        steady_suggested=Number(wide / chosen[0].kp / 1e3, 0),
    )
