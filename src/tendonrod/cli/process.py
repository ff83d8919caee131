"""One run of the command line: from its arguments to its exit status, and to whatever is said of it on the way."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from collections.abc import Iterator

from .streams import flush_or_drop, note


def run(given: list[str]) -> int:
    """The exit status after the command that ``given`` asks for."""
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - for the rest of the process
    if sys.stdout is None:
        return _failed("error: standard output is closed", 1)
    try:
        with _streams(), _interrupts_reach_us():
            return _run(given)
    except KeyboardInterrupt:
        return _failed("interrupted", 130)


def _run(given: list[str]) -> int:
    import typer  # here and not above, so that an interrupt while it is imported is answered too

    from ..errors import InvalidInput, TendonrodError
    from .app import app
    from .failure import UsageError, as_invalid_input

    try:
        status = typer.main.get_command(app).main(args=given, prog_name="tendonrod", standalone_mode=False)
    except UsageError as error:
        return _failed(f"error: {as_invalid_input(error)}", 2)
    except InvalidInput as error:
        return _failed(f"error: {error}", 2)
    except TendonrodError as error:
        return _failed(f"error: {error}", 1)
    except typer.Abort:
        return _failed("interrupted", 130)
    except OSError as error:
        return _failed(f"error: {error.filename or 'standard output'} cannot be used: {error.strerror or error}", 1)
    except SystemExit as error:  # typer's own answer to a closed pipe
        return int(error.code or 0)
    return _failed("interrupted", 130) if status == 130 else int(status or 0)


def _failed(text: str, status: int) -> int:
    note(" ".join(text.split()))
    return status


@contextlib.contextmanager
def _streams() -> Iterator[None]:
    """Streams that show names which the terminal cannot; what a broken one still holds stays unsaid."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError):
            stream.reconfigure(errors="backslashreplace")  # pyright: ignore - a name the terminal cannot show
    try:
        yield
    finally:
        flush_or_drop(sys.stdout)
        flush_or_drop(sys.stderr)


@contextlib.contextmanager
def _interrupts_reach_us() -> Iterator[None]:
    """An interrupt that comes inside a callback from C, where Python can only report it, is sent once more."""
    main_thread = threading.main_thread().ident
    before = sys.unraisablehook

    def again(found) -> None:
        if issubclass(found.exc_type, KeyboardInterrupt) and main_thread is not None:
            threading.Timer(0.02, signal.pthread_kill, (main_thread, signal.SIGINT)).start()  # also wakes a sleeper
        else:
            before(found)

    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = before
