"""Firmware of the motor board in portable C, and how to build and run it as an emulator on this machine.

`board.c`, `motion.c`, `line.c` and `config.c` are the board's; hardware is behind `hal.h`. `hal_emulator.c` and
`emulator.c` take its place here. `python -m tendonrod.rig.firmware` runs a board to rehearse a bench on. Nothing of
this has met a real board; docs/bench_protocol.rst says what one needs.
"""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from ..interfaces import DeviceError

FOLDER = Path(__file__).parent
PORTABLE = ("board.c", "motion.c", "line.c", "config.c")
EMULATOR = ("hal_emulator.c", "emulator.c")
CONFIG_OF_REHEARSAL = FOLDER / "config_rehearsal.c"
STRICT = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic")


def build(
    folder: str | Path, *, compiler: str = "gcc", options: tuple[str, ...] = (), config: str | Path | None = None
) -> Path:
    """Compile the emulator into ``folder``, which must exist; the path of the executable.

    ``config``: a board's numbers in place of those of `config.c`. ``options`` are handed to the compiler, such as
    ``-fsanitize=address,undefined``. Raises `DeviceError` where there is no compiler, or where it refuses; nothing else
    is run or written.
    """
    program = Path(folder) / "bench-emulator"
    sources = [str(FOLDER / name) for name in (*PORTABLE, *EMULATOR) if config is None or name != "config.c"]
    sources += [] if config is None else [str(config)]
    command = [compiler, *STRICT, *options, f"-I{FOLDER}", "-o", str(program), *sources, "-lm"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    except FileNotFoundError:
        raise DeviceError(f"{compiler}: no such compiler; the emulated board is built by one, gcc by default") from None
    if done.returncode:
        raise DeviceError(f"{compiler} refuses the firmware: {' '.join(done.stderr.split())[:300]}")
    return program


@dataclass(frozen=True, kw_only=True)
class Emulator:
    """An emulated board that runs: the port it answers at, and its process, to be disturbed by tests."""

    port: str
    process: subprocess.Popen


@contextmanager
def running(program: str | Path, *options: str) -> Iterator[Emulator]:
    """Run a built emulator on a pseudo-terminal until the block is left; options as emulator.c lists them.

    It also ends with this process, however that ends, since it then loses its standard input.
    """
    command = [str(program), *options]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            port = process.stdout.readline().strip()
            if not port:
                raise DeviceError(f"{program}: the emulated board did not start")
            yield Emulator(port=port, process=process)
        finally:
            process.kill()


@contextmanager
def rehearsal(config: str | Path = CONFIG_OF_REHEARSAL, *options: str) -> Iterator[Emulator]:
    """Build and run a board with ``config``'s numbers and ExoNav 1's tendon, nearly taut at the references.

    Unlike the plain emulator it can be driven by `rig hold`, `ftl` and the other tasks. ``options`` as `running` takes
    them. Raises `DeviceError` as `build` does.
    """
    with TemporaryDirectory() as folder, running(build(folder, config=config), "--rehearsal", *options) as emulator:
        yield emulator
