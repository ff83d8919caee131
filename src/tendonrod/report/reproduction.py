"""`reproduce`: compute every chapter, draw, and write the page with its figures and tables beside it."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from ..robot import load_robot
from . import paper
from .bending import bending_chapter, fan, torsion_chapter
from .chapter import Chapter
from .corrections import chapter as corrections_chapter
from .corrections import misprint_effects
from .devices import chapter as devices_chapter
from .following import chapter as following_chapter
from .following import plans
from .forensics import chapter as forensics_chapter
from .forensics import forensics
from .gravity import chapter as gravity_chapter
from .gravity import effect
from .page import write_page

Watch = Callable[[int, int, str], None]
_COMPUTED, _PICTURES = 8, 12  # steps of the progress display


def reproduce(out: str | os.PathLike[str] = "out/reproduce", steps: int = 20, watch: Watch | None = None) -> Path:
    """Recompute the paper's simulation results and write the report; returns the path of its index.html.

    out: directory, made if need be; files of the same names in it are replaced, unchanged ones of an older report go,
    all others stay. steps: of each follow-the-leader plan, the paper's is 20. watch(done, total, what) is called as the
    work goes on. Raises `InvalidInput` where ``out`` cannot be written.
    """
    tell = _Progress(watch)
    chapters = compute(steps, tell)
    page = write_page(
        out,
        "report.html.j2",
        "ExoNav recomputed",
        [table for chapter in chapters for table in chapter.tables],
        [picture for chapter in chapters for picture in chapter.pictures],
        {chapter.name: chapter.facts for chapter in chapters},
        watch=lambda done, total, what: tell(what),
        chapters=chapters,
        section_number={chapter.name: k for k, chapter in enumerate(chapters, 1)},
    )
    tell("done")
    return page


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
