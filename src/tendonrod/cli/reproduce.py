"""`tendonrod reproduce`: the report on the paper."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..errors import Fact, InvalidInput
from . import output as out


def reproduce(
    output: Annotated[
        str, typer.Option(metavar="DIR", help="Directory of the report; made if need be.")
    ] = "out/reproduce",
) -> None:
    """Recompute the paper's results as an illustrated report.

    One page, index.html, with figures (PNG, SVG) and tables (CSV) beside it. Running it again is safe.
    """
    directory = chosen_directory(output)

    from ..report import reproduce as write_report

    with out.progress_bar("reproducing") as watch:
        page = write_report(out=directory, watch=watch)
    out.say(f"Report: {page}")


def chosen_directory(text: str) -> Path:
    directory = Path(text)
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InvalidInput("--output", Fact(text), "a directory, not a file") from None
    except OSError as error:
        raise InvalidInput("--output", Fact(text), f"a directory that can be made: {error.strerror or error}") from None
    return directory
