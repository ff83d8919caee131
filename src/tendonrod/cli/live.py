"""The live view of a bench: what it does, on a terminal as it happens, else in a line every few seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable
from math import degrees
from typing import TYPE_CHECKING, Any

from . import output as out

if TYPE_CHECKING:
    from ..rig.live_tip import LiveTip
    from ..rig.loop import Moment, Watch

EVERY = 0.1  # s between two pictures of the terminal
BAR = 40  # characters
KEYS = (("space, Esc", "emergency stop, all stand still"), ("Ctrl-C", "release the tension and end"))
SURE = 0.02  # share that must be done before the rest is told from it


class LiveView:
    """Progress, phase, tension and target, insertion, time left, state and fault of what runs on a bench.

    A context; `begin` says what comes, `watch` is handed to the trial. length: L_na, m. also: called with each moment
    first. tip: how far the tip is from its reference, None where that is not known. Keys are read elsewhere.
    """

    def __init__(self, length: float, also: Watch | None = None, tip: LiveTip | None = None) -> None:
        self.length, self.title, self._live, self._shown, self._also = length, "", None, 0.0, also
        self._tip = tip
        self._began: tuple[float, float] | None = None

    def __enter__(self) -> LiveView:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.live import Live

            console = Console(file=sys.stderr, markup=False, emoji=False, highlight=False)
            self._live = Live(console=console, auto_refresh=False, transient=True)
            self._live.start()
        self._shown = time.monotonic()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None

    def begin(self, title: str) -> None:
        """Name what comes next, such as a trial; the bench is opened and its axes homed first."""
        self.title, self._began = title, None
        if self._live is not None:
            self._draw([("", "opening the bench, homing its axes")], 0.0)

    def watch(self, moment: Moment) -> None:
        """Show a moment, if it is time to; a fault's first at once."""
        if self._also is not None:
            self._also(moment)
        if self._tip is not None:
            self._tip.watch(moment)
        now = time.monotonic()
        if self._began is None or moment.task.progress <= self._began[1]:  # on its way to the start, or taking up
            self._began = now, moment.task.progress
        every = out.BETWEEN_LINES if self._live is None else EVERY
        if now - self._shown < every:
            return
        self._shown = now
        if self._live is None:
            out.note(f"{self.title}: {told(moment, self.length, self._tip_error(moment))}")
        else:
            left = self._left(now, moment.task.progress)
            self._draw(rows(moment, self.length, left, self._tip_error(moment)), moment.task.progress)

    def _tip_error(self, moment: Moment) -> float:
        return float("nan") if self._tip is None else self._tip.error(moment)

    def _left(self, now: float, progress: float) -> float:
        """s until it is done, if it goes on as it went; NaN where that cannot be said yet."""
        assert self._began is not None
        began, first = self._began
        done = progress - first
        return (now - began) * (1.0 - progress) / done if done > SURE else float("nan")

    def _draw(self, lines: list[tuple[str, str]], progress: float) -> None:
        live: Any = self._live
        live.update(picture(self.title, lines, progress), refresh=True)


def picture(title: str, lines: list[tuple[str, str]], progress: float) -> Any:
    """Title, bar, names and texts, keys: one row each, wrapped by words where the terminal is narrow."""
    from rich.progress_bar import ProgressBar
    from rich.table import Table
    from rich.text import Text

    def table(rows: Iterable[tuple[str, str]], style: str) -> Table:
        grid = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
        grid.add_column(no_wrap=True, min_width=len(KEYS[0][0]))
        for name, text in rows:
            grid.add_row(Text(name, style="dim"), Text(text, style="bold red" if name == "fault" else style))
        return grid

    page = Table.grid()  # a bar ends no line by itself, a row does
    for row in (Text(title, style="bold"), ProgressBar(total=1.0, completed=progress, width=BAR)):
        page.add_row(row)
    page.add_row(table(lines, ""))
    page.add_row(table(KEYS, "dim"))
    return page


def rows(moment: Moment, length: float, left: float, tip: float = float("nan")) -> list[tuple[str, str]]:
    """What the terminal shows, name and text; left: s, tip: m from the reference, NaN where they are not known."""
    at = moment.sample
    found = [
        ("phase", f"{_phase(moment)}, {100 * moment.task.progress:.0f} %{_ahead(left)}"),
        ("tension", _tension(moment)),
        ("insertion", f"{at.translation.position / length:.3f}, {1e3 * at.translation.position:.2f} mm"),
        *([("tip", f"{1e3 * tip:.2f} mm from the reference")] if tip == tip else []),
        ("rotation", f"{degrees(at.rotation.position):.1f} deg"),
        ("screw", f"{1e3 * at.screw.position:.2f} mm"),
        ("state", moment.state.value),
    ]
    return found if moment.fault is None else [*found, ("fault", str(moment.fault))]


def told(moment: Moment, length: float, tip: float = float("nan")) -> str:
    """The same in one line."""
    at = moment.sample.translation.position / length
    text = f"{100 * moment.task.progress:.0f} %, {_phase(moment)}, insertion {at:.3f}, tension {_tension(moment)}"
    text += f", tip {1e3 * tip:.2f} mm from the reference" if tip == tip else ""
    return f"{text}, {moment.state.value}" if moment.fault is None else f"{text}; {moment.fault}"


def _phase(moment: Moment) -> str:
    return str(getattr(moment.task, "phase", "") or moment.task.name)


def _tension(moment: Moment) -> str:
    tension, target = moment.sample.force.tension, moment.command.target
    if target != target:
        return f"{tension:.3f} N"
    return f"{tension:.3f} N, target {target:.3f} N, error {1e3 * (target - tension):+.0f} mN"


def _ahead(left: float) -> str:
    if left != left:
        return ""
    minutes, seconds = divmod(round(left), 60)
    return f", about {minutes} min {seconds} s left" if minutes else f", about {seconds} s left"
