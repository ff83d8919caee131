"""`write_page`: one self-contained HTML page with its figures and tables beside it, complete or not at all."""

from __future__ import annotations

import os
import platform
import tempfile
from collections.abc import Callable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InvalidInput
from .chapter import Cell, Number, Picture, Table, plain

if TYPE_CHECKING:
    from jinja2 import Environment

PAGE = "index.html"


def write_page(
    out: str | os.PathLike[str],
    template: str,
    title: str,
    tables: Sequence[Table],
    pictures: Sequence[Picture],
    facts: Mapping[str, Any],
    more: Sequence[Callable[[Path], object]] = (),
    watch: Callable[[int, int, str], None] | None = None,
    **known: Any,
) -> Path:
    """Write index.html from a template that extends page.html.j2, each figure as PNG and SVG, each table as CSV.

    out: directory, made if need be; files of the same names are replaced once all are there, others left alone. more:
    called with the folder to write other files to. watch(done, total, what) is called before each figure. known: more
    that the template knows by name. Returns the page's path. Raises `InvalidInput` where ``out`` cannot be written.
    """
    out = Path(out)
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".writing-", dir=out) as name:
            folder = Path(name)
            for table in tables:
                table.write(folder / f"{table.name}.csv")
            for write in more:
                write(folder)
            images = _drawn(pictures, folder, watch)
            text = render(template, tables, images, facts, title=title, **known)
            (folder / PAGE).write_text(text, encoding="utf-8")
            for file in sorted(folder.iterdir(), key=lambda file: file.name == PAGE):  # the page last
                os.replace(file, out / file.name)
    except OSError as error:
        raise InvalidInput("out", str(out), f"a directory that can be written ({error.strerror or error})") from None
    return out / PAGE


def render(
    template: str, tables: Sequence[Table], images: Mapping[str, str], facts: Mapping[str, Any], **more: Any
) -> str:
    """The page as one HTML text. images: figure name -> data URI, in the order of their numbers."""
    known = {
        "facts": facts,
        "tables": {table.name: table for table in tables},
        "table_number": {table.name: k for k, table in enumerate(tables, 1)},
        "figure_number": {name: k for k, name in enumerate(images, 1)},
        "images": images,
        "versions": versions(),
    }
    return _environment().get_template(template).render(known | more)


def _environment() -> Environment:
    """Jinja with this package's templates, the filters ``cell`` and ``html`` and the test ``number``."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    templates = files("tendonrod.report") / "templates"
    found = Environment(
        loader=FunctionLoader(lambda name: (templates / name).read_text(encoding="utf-8")),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    found.filters["cell"] = lambda cell: str(cell) if isinstance(cell, Number) else Markup(cell)
    found.filters["html"] = Markup
    found.tests["number"] = _is_number
    return found


def _is_number(cell: Cell) -> bool:
    """Whether a cell is to be aligned as a number."""
    return isinstance(cell, Number) or not any(letter.isalpha() for letter in plain(cell))


def versions() -> str:
    """What the page was computed with."""
    import matplotlib
    import numba
    import numpy
    import scipy

    from .. import __version__

    modules = (numpy, scipy, numba, matplotlib)
    libraries = ", ".join(f"{module.__name__} {module.__version__}" for module in modules)
    return f"tendonrod {__version__}, Python {platform.python_version()}, {libraries}, on {platform.machine()}"


def _drawn(pictures: Sequence[Picture], folder: Path, watch: Callable[[int, int, str], None] | None) -> dict[str, str]:
    images = {}
    for k, picture in enumerate(pictures):
        if watch is not None:
            watch(k, len(pictures), f"figure {picture.name}")
        images[picture.name] = picture.write(folder)
    return images
