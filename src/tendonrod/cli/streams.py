"""Lines on standard error, and what is left in a broken stream; needs nothing that takes time to import."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import IO

INDENT = "  "  # of the lines after the first, on a terminal


def note(text: str) -> None:
    """One message on standard error: one line in a pipe or file, broken between words on a terminal."""
    with contextlib.suppress(OSError):
        print(_fitted(f"tendonrod: {text}", _width(sys.stderr)), file=sys.stderr, flush=True)


def flush_or_drop(stream: IO[str]) -> None:
    """Write what ``stream`` still holds; where that fails, send it nowhere, so that Python's last flush is silent."""
    try:
        stream.flush()
    except OSError:
        with contextlib.suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _width(stream: IO[str]) -> int:
    """Characters in a line of the terminal that ``stream`` is; 0 where it is none, or does not say."""
    try:
        return os.get_terminal_size(stream.fileno()).columns
    except (OSError, ValueError, AttributeError):
        return 0


def _fitted(text: str, width: int) -> str:
    """Broken between words; a word that is longer, such as a path, is left whole."""
    if not 2 * len(INDENT) < width < len(text):
        return text
    import textwrap

    return textwrap.fill(
        text, width, subsequent_indent=INDENT, break_long_words=False, break_on_hyphens=False, replace_whitespace=False
    )
