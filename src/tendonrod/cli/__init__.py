"""The command line: `tendonrod COMMAND`, see `app`.

Results go to standard output, everything else to standard error. Exit status: 0 done; 1 a solve did not converge or the
output could not be written; 2 bad input or usage, said in one line; 130 interrupted; 141 the reader of the output went
away.

An interrupt is answered from the first line of `main` on, so next to nothing is imported above it. What comes before is
Python's own start, which nobody can guard.
"""

from __future__ import annotations

import _signal as signal  # pyright: ignore[reportMissingImports] - signal itself first imports enum, for 5 ms
import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line with ``arguments`` (those of the process if None) and return its exit status."""
    if arguments is None:
        return _whole_process()
    from .process import run

    return run(list(arguments))


def _whole_process() -> int:
    """Until there is a command that can be interrupted in good order, an interrupt ends the process where it is."""
    before = signal.getsignal(signal.SIGINT)
    if before == signal.SIG_IGN:  # as of a job in the background
        from .process import run

        return run(sys.argv[1:])
    signal.signal(signal.SIGINT, _leave)
    from . import app, failure  # noqa: F401 - takes half a second
    from .process import run

    try:
        signal.signal(signal.SIGINT, before)
        return run(sys.argv[1:])
    except KeyboardInterrupt:  # while it was about to begin or to return
        return 130
    finally:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the process ends: there is nothing more to interrupt


def _leave(*_) -> None:
    """End here and now: an exception in the middle of others' imports would come out as whatever they make of it."""
    try:
        print("tendonrod: interrupted", file=sys.stderr, flush=True)
    finally:
        os._exit(130)
