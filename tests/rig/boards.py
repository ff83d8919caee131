"""Emulated motor boards for tests: in simulated time over standard input, with a record of what moved."""

import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from tendonrod.rig import firmware
from tendonrod.rig.board_protocol import Answer, answer, command
from tendonrod.rig.interfaces import DeviceError

SANITIZED = ("-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
GREETING = command(1, "HELLO")
MOVE = (500, 3000, -200)  # um/s, um/s, mrad/s


def sanitized(folder: Path) -> Path:
    """The emulator with the compiler's sanitizers, where it has them."""
    try:
        return firmware.build(folder, options=SANITIZED)
    except DeviceError:
        return firmware.build(folder)


@dataclass(frozen=True)
class Heard:
    """What a board said, how many MOVEs it carried out, errors it told, and what each axis travelled (nm, nm, urad)."""

    lines: list[bytes]
    moves: int
    errors: int
    travelled: list[int]

    @property
    def answers(self) -> list[Answer]:
        """All lines as answers; `DamagedLine` where one is none."""
        return [answer(line) for line in self.lines]

    @property
    def stood_still(self) -> bool:
        """Whether nothing was carried out and nothing moved."""
        return self.moves == 0 and self.travelled == [0, 0, 0]


def hear(program: Path, data: bytes, *options: str) -> Heard:
    """Send bytes to a board that begins homed; a millisecond passes with every newline."""
    done = subprocess.run([program, "--stdio", "--homed", *options], input=data, capture_output=True, timeout=60)
    assert done.returncode == 0, done.stderr.decode()
    told = re.fullmatch(rb"moves (\d+) errors (\d+) travelled (\d+) (\d+) (\d+)\n", done.stderr)
    assert told, done.stderr
    moves, errors, *travelled = map(int, told.groups())
    return Heard(done.stdout.split(b"\n")[:-1], moves, errors, travelled)


def wait(milliseconds: int) -> bytes:
    """Empty lines, which the board passes over, for as long."""
    return b"\n" * milliseconds
