"""`write_page`: one self-contained HTML page with its figures and tables beside it, complete or not at all."""

from __future__ import annotations

import os
import platform
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InvalidInput
from .chapter import Cell, Number, Picture, Table, plain
from .manifest import left_behind, manifest

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
    beside: Sequence[str] = (),
    **known: Any,
) -> Path:
    """Write index.html from a template that extends page.html.j2, each figure as PNG and SVG, each table as CSV.

    out: directory, made if need be; files of the same names are replaced once all are there. What an older page of the
    same template wrote there and this one does not goes, if nobody has changed it; all else is left alone. more: called
    with the folder to write other files to. watch(done, total, what) is called before each figure. beside: names of
    files in ``out`` that belong to the page and were written before it. known: more that the template knows by name.
    Returns the page's path. Raises `InvalidInput` where ``out`` cannot be written.
    """
    out = Path(out)
    with _refused(out):
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".writing-", dir=out) as name:
            folder = Path(name)
            for table in tables:
                table.write(folder / f"{table.name}.csv")
            for write in more:
                write(folder)
            images = _drawn(pictures, folder, watch)
            text = render(template, tables, images, facts, title=title, **known)
            belongings = [*folder.iterdir(), *(out / each for each in beside if (out / each).is_file())]
            (folder / PAGE).write_text(text + manifest(template, belongings), encoding="utf-8")
            _moved(folder, out, left_behind(out / PAGE, template, [each.name for each in belongings]))
    return out / PAGE


@contextmanager
def _refused(out: Path) -> Iterator[None]:
    """Whatever cannot be written, the error names ``out``, not a draft in it."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
    except InvalidInput as error:
        if error.field != "figure":
            raise
        reason = error.allowed.removeprefix("writable: ")
    else:
        return
    raise InvalidInput("out", str(out), f"a directory that can be written ({reason})")


def _moved(folder: Path, out: Path, stale: Iterable[Path]) -> None:
    """Put the files of ``folder`` into ``out``, the page last, when what is ``stale`` has gone."""
    for file in folder.iterdir():
        if file.name != PAGE:
            os.replace(file, out / file.name)
    for file in stale:
        file.unlink(missing_ok=True)
    os.replace(folder / PAGE, out / PAGE)


def render(
    template: str, tables: Sequence[Table], images: Mapping[str, str], facts: Mapping[str, Any], **more: Any
) -> str:
    """The page as one HTML text. images: figure name -> data URI, in the order of their numbers."""
    known = {
        "facts": facts,
        "tables": {table.name: table for table in tables},
        "table_number": {table.name: k for k, table in enumerate(tables, 1)},
        "figure_number": {name: k for k, name in enumerate(images, 1)},
        "numeric": {table.name: _numeric(table) for table in tables},
        "images": images,
        "versions": versions(),
    }
    return _environment().get_template(template).render(known | more)


def _environment() -> Environment:
    """Jinja with this package's templates and the filters ``cell`` and ``html``."""
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
    return found


def _numeric(table: Table) -> list[bool]:
    """Whether each column is aligned as numbers: one of its cells is a `Number`, or most of them have no letters."""
    return [_are_numbers(column) for column in zip(*table.rows, strict=True)]


def _are_numbers(cells: Sequence[Cell]) -> bool:
    words = [any(letter.isalpha() for letter in plain(cell)) for cell in cells if not isinstance(cell, Number)]
    return len(words) < len(cells) or sum(words) < 0.5 * len(words)


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
