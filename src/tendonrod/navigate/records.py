"""The folder of a server's records: fresh names, what is there, one by its name."""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

from ..errors import Fact, InvalidInput

SUFFIX = ".jsonl"
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,99}")


class Records:
    """Records in ``folder``, which is made where it is missing."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def fresh(self, now: datetime | None = None) -> Path:
        """A path that no record has yet, named after the time of day."""
        stem = f"{now or datetime.now():%Y-%m-%d-%H%M%S}"
        k = 1
        while (path := self.folder / f"{stem}{f'-{k}' if k > 1 else ''}{SUFFIX}").exists():
            k += 1
        return path

    def found(self) -> list[Path]:
        """Newest first."""
        files = [path for path in self.folder.glob(f"*{SUFFIX}") if NAME.fullmatch(path.name) and path.is_file()]
        return sorted(files, key=lambda path: (path.stat().st_mtime, path.name), reverse=True)

    def path(self, name: str) -> Path:
        """Of the record of this name. Raises `InvalidInput` where there is none; never leaves the folder."""
        path = self.folder / name
        if not NAME.fullmatch(name) or path.suffix != SUFFIX or not path.is_file():
            names = ", ".join(path.name for path in self.found()[:5]) or "none so far"
            raise InvalidInput("name", Fact(name[:100] or "''"), f"a record of this server: {names}")
        return path
