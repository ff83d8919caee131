"""`python -m tendonrod.rig.firmware`: an emulated board to rehearse a bench on, until Ctrl-C."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ..interfaces import DeviceError
from . import CONFIG_OF_REHEARSAL, rehearsal

TRY = (
    "an emulated board answers at {port} until Ctrl-C. With a bench file of yours, and no hardware:\n"
    "  tendonrod rig hold --tension 0.3 --duration 5 --bench my-bench.toml --rehearse {port} --output rehearsal"
)


def main(arguments: list[str] | None = None) -> int:
    """Run the board; its port is the one line of standard output. Returns the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tendonrod.rig.firmware", description=__doc__)
    parser.add_argument(
        "--config", metavar="FILE.c", type=Path, default=CONFIG_OF_REHEARSAL, help="the board's numbers, like config.c"
    )
    config = parser.parse_args(arguments).config
    try:
        with rehearsal(config) as board:
            print(TRY.format(port=board.port), file=sys.stderr, flush=True)
            print(board.port, flush=True)
            board.process.wait()
    except KeyboardInterrupt:
        return 130
    except DeviceError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 1


if __name__ == "__main__":
    sys.exit(main())
