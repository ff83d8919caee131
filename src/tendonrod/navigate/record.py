"""`SessionRecord`: every command of a session in a file that only grows, one JSON object per line.

First line: everything that a replay starts from. Then one line per step, or per run of equal steps that changed
nothing, which is written at least every 0.1 s of the session; and one per event. A line is complete or, at the very end
of a file whose program was killed, cut off: `replay` stops there.
"""

from __future__ import annotations

import hashlib
import json
import os
from os import PathLike
from pathlib import Path
from typing import Any

from ..errors import InvalidInput
from .commands import Jog, Posture
from .outer_tube import OuterTube
from .scenario import Scenario
from .scenariofile import scenario_data
from .snapshot import Snapshot

FORMAT, VERSION = "tendonrod session", 1
COUNTS = ("index", "count")  # of a line: which steps it is
LONGEST_RUN = 0.1  # s of equal steps in one line


class SessionRecord:
    """A new file at ``path``, opened when its session begins. ``fault``: why it ended early, "" where it did not.

    Raises `InvalidInput` at `begin` where the file exists or cannot be made. Later a full disk ends the record, not the
    session.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self.path, self.fault = Path(path), ""
        self._descriptor = -1
        self._run: dict[str, Any] = {}

    def begin(self, scenario: Scenario, drive: str, start: Snapshot) -> None:
        """Write the header. Raises `InvalidInput`."""
        if self._descriptor >= 0:
            raise InvalidInput("record", str(self.path), "a record that has not begun yet")
        header = {
            "format": FORMAT, "version": VERSION, "software": software(), "drive": drive,
            "start": {"index": start.index, "time": start.time, "reached": list(start.reached)} | outcome(start),
            "scenario": scenario_data(scenario),
        }  # fmt: skip
        try:
            self._descriptor = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        except FileExistsError:
            raise InvalidInput("record", str(self.path), "a new file: records are never overwritten") from None
        except OSError as error:
            raise InvalidInput("record", str(self.path), f"writable: {error.strerror or error}") from None
        self._write(header)

    def step(self, jog: Jog, dt: float, after: Snapshot, held: Posture | None = None) -> None:
        """Keep one step. held: by the drive, where that is another posture than that of ``after``."""
        what = {"dt": dt, "jog": [jog.insertion, jog.rotation, jog.tension], "blocked": after.blocked} | outcome(after)
        if held is not None:
            what["held"] = numbers(held)
        if {key: value for key, value in self._run.items() if key not in COUNTS} != what:
            self._flush()
            self._run = {"index": after.index, "count": 0} | what
        self._run["count"] += 1
        if self._run["count"] * dt >= LONGEST_RUN:
            self._flush()

    def placed(self, tube: OuterTube) -> None:
        """Keep that the outer tube was placed."""
        self._event(event="place", tube={name: getattr(tube, name) for name in tube.__slots__})

    def reset(self) -> None:
        """Keep that the robot was retracted at once."""
        self._event(event="reset")

    def coupled(self, on: bool) -> None:
        """Keep whether insertion turns the motor."""
        self._event(event="couple", on=on)

    def close(self) -> None:
        """End the record; the last line says that it is complete."""
        if self._descriptor < 0:
            return
        self._event(event="end")
        os.close(self._descriptor)
        self._descriptor = -1

    def _event(self, **what: Any) -> None:
        self._flush()
        self._write(what)

    def _flush(self) -> None:
        if self._run:
            self._write(self._run)
            self._run = {}

    def _write(self, line: dict[str, Any]) -> None:
        if self.fault or self._descriptor < 0:
            return
        data = memoryview((json.dumps(line, separators=(",", ":"), allow_nan=False) + "\n").encode())
        try:
            while data:
                data = data[os.write(self._descriptor, data) :]
        except OSError as error:
            self.fault = f"the record {self.path.name} ends here, the session goes on: {error.strerror or error}"


def software() -> dict[str, str]:
    """Versions that decide on the last bits of a result."""
    import platform
    from importlib.metadata import version

    names = ("tendonrod", "numpy", "numba")
    return {name: version(name) for name in names} | {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}",
    }


def digest(snapshot: Snapshot) -> str:
    """Hash of every number of the robot's state: two snapshots agree bit for bit where their digests do."""
    found = hashlib.blake2b(digest_size=8)
    for array in (snapshot.tension, snapshot.centerline, snapshot.frames, snapshot.contact_force, snapshot.pressure):
        found.update(array.tobytes())
    for name in sorted(snapshot.clearance):
        found.update(snapshot.clearance[name].tobytes())
    return found.hexdigest()


def outcome(snapshot: Snapshot) -> dict[str, Any]:
    """What a record keeps of a snapshot, and a replay compares: what the drives hold, the tip (m), the `digest`."""
    tip = [round(x, 7) for x in snapshot.tip.tolist()]
    return {"at": numbers(snapshot.posture), "tip": tip, "digest": digest(snapshot)}


def numbers(posture: Posture) -> list[float]:
    """Insertion, rotation and tensions, as a record has them."""
    return [posture.insertion, posture.rotation, *posture.tension]
