"""`RecordFile`: a file that only grows, with room reserved ahead, so that a full disk is noticed while there is still
room for the end. It knows no samples.
"""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path

from ..errors import InvalidInput

_UNRESERVABLE = (errno.EOPNOTSUPP, errno.EINVAL, errno.ENOSYS)
_UNLINKABLE = (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK)
_flush_to_disk = getattr(os, "fdatasync", os.fsync)


class RecordFile:
    """A new file at ``path`` that begins with ``start``; it appears with it or not at all, never in place of another.

    reserve: bytes kept free ahead of what is written. Raises `InvalidInput` where there is a file already, where none
    can be made, or no room for ``start`` and the reserve.
    """

    def __init__(self, path: Path, start: bytes, reserve: int) -> None:
        self.path, self.reserve = path, reserve
        self.size = self.reserved = 0  # bytes written, bytes that are the file's
        draft = path.with_name(f".{path.name}.{os.getpid()}")
        try:
            self._descriptor = os.open(draft, os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o644)
            try:
                self._begin(start, draft)
            except BaseException:
                os.close(self._descriptor)
                raise
            finally:
                draft.unlink(missing_ok=True)
        except FileExistsError:
            raise InvalidInput("record file", str(path), "a new file: records are never overwritten") from None
        except OSError as error:
            raise InvalidInput("record file", str(path), f"writable: {error.strerror or error}") from None

    def _begin(self, start: bytes, draft: Path) -> None:
        self.append(start)
        self.reserve_ahead()
        try:
            os.link(draft, self.path)
        except OSError as error:
            if error.errno not in _UNLINKABLE:
                raise
            if self.path.exists():
                raise FileExistsError from None
            os.rename(draft, self.path)

    def append(self, data: bytes) -> None:
        """Write ``data`` behind the rest. Raises OSError; ``size`` then tells how much of it was written."""
        rest = memoryview(data)
        while rest:
            written = os.pwrite(self._descriptor, rest, self.size)
            self.size += written
            rest = rest[written:]

    def reserve_ahead(self) -> None:
        """Keep the reserve free, and a quarter more. Raises OSError where the disk has no room."""
        if self.reserved - self.size < self.reserve:
            start, stop = max(self.reserved, self.size), self.size + self.reserve + self.reserve // 4
            self._take(start, stop - start)
            self.reserved = stop

    def _take(self, start: int, step: int) -> None:
        if hasattr(os, "posix_fallocate"):
            try:
                os.posix_fallocate(self._descriptor, start, step)
                return
            except OSError as error:
                if error.errno not in _UNRESERVABLE:
                    raise
        done = 0
        while done < step:  # zeros take room where none can be asked for
            done += os.pwrite(self._descriptor, bytes(step - done), start + done)

    def to_disk(self) -> None:
        """Wait until what was written is on the disk itself. Raises OSError."""
        _flush_to_disk(self._descriptor)

    def name_to_disk(self) -> None:
        """Wait until the file's name is on the disk too, where the system can do that."""
        with suppress(OSError):
            folder = os.open(self.path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)

    def close(self) -> None:
        """Give the reserve back and close. Raises OSError."""
        try:
            os.ftruncate(self._descriptor, self.size)
        finally:
            os.close(self._descriptor)
