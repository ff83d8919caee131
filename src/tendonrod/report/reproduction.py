"""`reproduce`: compute every chapter, draw, and write the page with its figures and tables beside it."""

from __future__ import annotations

import os
import platform
import tempfile
from collections.abc import Callable, Iterator, Sequence
from importlib.resources import files
from pathlib import Path

from ..errors import InvalidInput
from ..robot import load_robot
from . import paper
from .bending import bending_chapter, fan, torsion_chapter
from .chapter import Cell, Chapter, Number, Picture, Table, plain
from .corrections import chapter as corrections_chapter
from .corrections import misprint_effects
from .devices import chapter as devices_chapter
from .following import chapter as following_chapter
from .following import plans
from .forensics import chapter as forensics_chapter
from .forensics import forensics
from .gravity import chapter as gravity_chapter
from .gravity import effect

Watch = Callable[[int, int, str], None]
_COMPUTED, _PICTURES = 8, 12  # steps of the progress display


def reproduce(out: str | os.PathLike[str] = "out/reproduce", steps: int = 20, watch: Watch | None = None) -> Path:
    """Recompute the paper's simulation results and write the report; returns the path of its index.html.

    out: directory, made if need be; files of the same names in it are replaced, all others are left alone. steps: of
    each follow-the-leader plan, the paper's is 20. watch(done, total, what) is called as the work goes on. Raises
    `InvalidInput` where ``out`` cannot be written.
    """
    tell = _Progress(watch)
    chapters = compute(steps, tell)
    out = Path(out)
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".writing-", dir=out) as folder:
            page = _write(chapters, Path(folder), tell)
            for file in sorted(Path(folder).iterdir(), key=lambda file: file == page):  # the page last
                os.replace(file, out / file.name)
    except OSError as error:
        raise InvalidInput("out", str(out), f"a directory that can be written ({error.strerror or error})") from None
    tell("done")
    return out / "index.html"


def compute(steps: int = 20, tell: Callable[[str], None] = lambda _: None) -> list[Chapter]:
    """All chapters in order, computed but not drawn; tell(what) is called before each part."""
    robots = [load_robot(name) for name in paper.PROTOTYPES]
    tell("sections and limits")
    devices = devices_chapter(robots)
    following = following_chapter(plans(robots[0], steps, tell))
    tell("shape against tension")
    bending = bending_chapter([fan(robot) for robot in robots])
    tell("torsion models")
    torsion = torsion_chapter(robots)
    tell("the paper's Table I")
    gravity = gravity_chapter([effect(robot) for robot in robots])
    tell("what would be enough for it")
    enough = forensics_chapter([forensics(robot) for robot in robots])
    tell("misprints")
    corrections = corrections_chapter(misprint_effects(robots[0]), robots)
    return [devices, following, bending, torsion, gravity, enough, corrections]


class _Progress:
    """Counts the calls and passes them on."""

    def __init__(self, watch: Watch | None) -> None:
        self.watch, self.done = watch, -1

    def __call__(self, what: str) -> None:
        self.done += 1
        if self.watch is not None:
            self.watch(self.done, _COMPUTED + _PICTURES, what)


def _write(chapters: Sequence[Chapter], folder: Path, tell: Callable[[str], None]) -> Path:
    for chapter in chapters:
        for table in chapter.tables:
            table.write(folder / f"{table.name}.csv")
    images = {}
    for picture in _pictures(chapters):
        tell(f"figure {picture.name}")
        images[picture.name] = picture.write(folder)
    page = folder / "index.html"
    page.write_text(render(chapters, images), encoding="utf-8")
    return page


def render(chapters: Sequence[Chapter], images: dict[str, str]) -> str:
    """The page as one self-contained HTML text; ``images``: figure name -> data URI."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    templates = files("tendonrod.report") / "templates"
    environment = Environment(
        loader=FunctionLoader(lambda name: (templates / name).read_text(encoding="utf-8")),
        undefined=StrictUndefined,
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["cell"] = lambda cell: str(cell) if isinstance(cell, Number) else Markup(cell)
    environment.filters["html"] = Markup
    environment.tests["number"] = _is_number
    return environment.get_template("report.html.j2").render(
        chapters=chapters,
        facts={chapter.name: chapter.facts for chapter in chapters},
        figure_number={picture.name: k for k, picture in enumerate(_pictures(chapters), 1)},
        table_number={table.name: k for k, table in enumerate(_tables(chapters), 1)},
        section_number={chapter.name: k for k, chapter in enumerate(chapters, 1)},
        tables={table.name: table for table in _tables(chapters)},
        images=images,
        versions=_versions(),
    )


def _is_number(cell: Cell) -> bool:
    return isinstance(cell, Number) or not any(letter.isalpha() for letter in plain(cell))


def _pictures(chapters: Sequence[Chapter]) -> Iterator[Picture]:
    return (picture for chapter in chapters for picture in chapter.pictures)


def _tables(chapters: Sequence[Chapter]) -> Iterator[Table]:
    return (table for chapter in chapters for table in chapter.tables)


def _versions() -> str:
    import matplotlib
    import numba
    import numpy
    import scipy

    from .. import __version__

    modules = (numpy, scipy, numba, matplotlib)
    libraries = ", ".join(f"{module.__name__} {module.__version__}" for module in modules)
    return f"tendonrod {__version__}, Python {platform.python_version()}, {libraries}, on {platform.machine()}"
