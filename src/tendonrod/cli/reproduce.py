"""`tendonrod reproduce`: the report on the paper."""

from __future__ import annotations

from typing import Annotated

import typer

from . import output as out


def reproduce(
    output: Annotated[
        str, typer.Option(metavar="DIR", help="Directory of the report; made if need be.")
    ] = "out/reproduce",
) -> None:
    """Recompute the paper's results as an illustrated report.

    One page, index.html, with figures (PNG, SVG) and tables (CSV) beside it. Running it again is safe.
    """
    directory = out.directory("--output", output)

    from ..report import reproduce as write_report

    with out.progress_bar("reproducing") as watch:
        page = write_report(out=directory, watch=watch)
    out.say(f"Report: {page}")
