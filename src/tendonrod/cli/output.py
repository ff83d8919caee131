"""What the commands write: text and JSON to standard output, notes and progress to standard error, files in one go."""

from __future__ import annotations

import contextlib
import csv
import json
import os
import re
import sys
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from ..errors import Fact, InvalidInput
from ..files import complete, file_name
from .streams import flush_or_drop, note

FIGURES = (".png", ".svg", ".pdf")
NARROWEST = 24  # characters of a wrapped column
CHUNK = 1 << 16
PATIENCE = 0.4  # s of work before a progress bar appears
BETWEEN_LINES = 5.0  # s from one line of progress to the next, where standard error is no terminal


def say(text: str) -> None:
    """Write ``text`` and a line end to standard output; end quietly where nobody reads it any more."""
    whole = text.rstrip("\n") + "\n"
    try:
        for start in range(0, len(whole), CHUNK):  # in parts: an unbuffered stream drops what is left of a broken write
            sys.stdout.write(whole[start : start + CHUNK])
        sys.stdout.flush()
    except BrokenPipeError:
        flush_or_drop(sys.stdout)
        import typer  # here, so that a note needs nothing that takes time to import

        raise typer.Exit(141) from None


def warn(sentences: Sequence[str]) -> None:
    """Each different warning once, on standard error."""
    for sentence in dict.fromkeys(sentences):
        note(f"warning: {' '.join(sentence.split())}")


def warn_steps(name: str, steps: Sequence[str], warnings: Sequence[Sequence[str]]) -> None:
    """The warnings of each step, one line for all that differ in their numbers only, with the words of the last."""
    found: dict[str, list[tuple[str, str]]] = {}
    for step, sentences in zip(steps, warnings, strict=True):
        for sentence in sentences:
            found.setdefault(re.sub(r"[-+.\de]*\d", "#", sentence), []).append((step, sentence))
    for same in found.values():
        (first, _), (last, sentence) = same[0], same[-1]
        where = f"{name} {first}" if len(same) == 1 else f"{len(same)} steps, {name} {first} to {last}; the last"
        warn([f"{where}: {sentence}"])


def say_json(values: Any) -> None:
    """Write plain numbers, texts, lists and dicts as JSON, floats in full precision, one line per top-level key."""
    if not isinstance(values, Mapping):
        say("[\n" + ",\n".join(f" {_dumped(value)}" for value in values) + "\n]")
    else:
        say("{\n" + ",\n".join(f" {_dumped(key)}: {_dumped(value)}" for key, value in values.items()) + "\n}")


def _dumped(value: Any) -> str:
    return json.dumps(value, allow_nan=False)


def fixed(value: float, digits: int) -> str:
    """``value`` with so many decimals; what rounds to zero has no sign."""
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def table(columns: Sequence[str], rows: Sequence[Sequence[str]], words: Sequence[int] = ()) -> str:
    """Aligned text; columns numbered in ``words`` are left-aligned, and the last of them is wrapped to the terminal.

    Numbers are never cut: where the terminal is too narrow, lines run on. No rules and no boxes, so that it reads well
    in a pipe too; headings, of two lines if they hold a line end, are bold on a terminal.
    """
    from rich.table import Table
    from rich.text import Text

    last = max(words, default=-1)
    grid = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold", show_header=any(columns))
    for i, name in enumerate(columns):
        justify = "left" if i in words else "right"
        grid.add_column(Text(name, justify=justify), justify=justify, no_wrap=i != last, overflow="fold")
    for row in rows:
        grid.add_row(*(Text(cell) for cell in row))
    fixed_part = [column for i, column in enumerate(zip(columns, *rows, strict=True)) if i != last]
    widths = [max(len(line) for cell in column for line in cell.split("\n")) for column in fixed_part]
    return _rendered(grid, least=sum(widths) + 2 * len(columns) + (NARROWEST if last >= 0 else 0))


def heading(text: str) -> str:
    """``text``, bold on a terminal."""
    from rich.text import Text

    return _rendered(Text(text, style="bold", no_wrap=False))


def _rendered(item: Any, least: int = 0) -> str:
    console = _console(sys.stdout)
    console.width = max(console.width, least)
    with console.capture() as captured:
        console.print(item, highlight=False)
    return "\n".join(line.rstrip() for line in captured.get().splitlines())


def _console(stream: IO[str]):
    from rich.console import Console

    return Console(file=stream, width=None if stream.isatty() else 100_000, markup=False, emoji=False)


@contextlib.contextmanager
def progress_bar(what: str) -> Iterator[Any]:
    """A function watch(done, total, what=None) for long work: a bar on a terminal, else a line every few seconds."""
    if not sys.stderr.isatty():
        yield _Lines(what).watch
        return
    bar = _Bar(what)
    try:
        yield bar.watch
    finally:
        bar.stop()


class _Lines:
    def __init__(self, what: str) -> None:
        self.what, self.last = what, time.monotonic()

    def watch(self, done: float, total: float, what: str | None = None) -> None:
        if time.monotonic() - self.last >= BETWEEN_LINES and done < total:
            self.last = time.monotonic()
            note(f"{what or self.what}: {100 * done / total:.0f} %")


class _Bar:
    def __init__(self, what: str) -> None:
        self.what, self.began, self.progress, self.task = what, time.monotonic(), None, None

    def watch(self, done: float, total: float, what: str | None = None) -> None:
        what = what or self.what
        if self.progress is None:
            if time.monotonic() - self.began < PATIENCE or done >= total:
                return
            from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

            columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"))
            self.progress = Progress(*columns, TimeRemainingColumn(), console=_console(sys.stderr), transient=True)
            self.progress.start()
            self.task = self.progress.add_task(what, total=total)
        self.progress.update(self.task, completed=done, total=total, description=what)  # pyright: ignore

    def stop(self) -> None:
        if self.progress is not None:
            self.progress.stop()


def target(option: str, path: str | None, suffixes: Sequence[str]) -> Path | None:
    """The file that an option names, checked before the work begins; None where the option is not given."""
    if path is None:
        return None
    file_name(option, Fact(path or "''"), suffixes)
    found = Path(os.path.realpath(path))
    if not found.parent.is_dir():
        raise InvalidInput(option, Fact(path), f"in a directory that exists; {Path(path).parent} does not")
    if found.exists() and not found.is_file():
        raise InvalidInput(option, Fact(path), "a file")
    return found


def directory(option: str, path: str) -> Path:
    """The directory that an option names, made if need be before the work begins."""
    found = Path(path)
    try:
        found.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InvalidInput(option, Fact(path), "a directory, not a file") from None
    except OSError as error:
        raise InvalidInput(option, Fact(path), f"a directory that can be made: {error.strerror or error}") from None
    return found


@contextlib.contextmanager
def written(option: str, path: Path) -> Iterator[None]:
    """The library writes ``path``: its complaint about the file names the option, and what was written is noted."""
    try:
        yield
    except InvalidInput as error:
        if str(error.value) != str(path):
            raise
        raise InvalidInput(option, Fact(str(path)), error.allowed) from None
    note(f"wrote {path}")


@contextlib.contextmanager
def filling(option: str, directory: Path | None) -> Iterator[None]:
    """The library writes into ``directory``: its complaint about that or a file there names the option and it."""
    try:
        yield
    except InvalidInput as error:
        if directory is None or not _is_in(error.value, directory):
            raise
        raise InvalidInput(option, Fact(str(directory)), error.allowed) from None


def _is_in(value: object, directory: Path) -> bool:
    return isinstance(value, str) and directory in (Path(value), *Path(value).parents)


def write_table(option: str, path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a CSV file."""
    with written(option, path), complete(option, path) as draft, draft.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(header)
        table.writerows(rows)


def write_figure(option: str, path: Path | None, draw) -> None:
    """Save the figure that ``draw()`` returns, if a path is given."""
    if path is None:
        return
    from ..plot import save

    with written(option, path):
        save(draw(), path)
