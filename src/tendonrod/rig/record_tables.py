"""Tables of a record's samples, faults and frames, gathered from the bytes of its pieces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .record_layout import FAULT, FRAME, SAMPLE, Piece
from .states import FaultKind, Reaction, State

AT_ONCE = 1 << 14  # rows gathered together: their bytes' places take 8 times the room of the bytes


class Tables(NamedTuple):
    """Rows as `record_layout` has them, and which sample each frame and each fault came with."""

    samples: np.ndarray
    frames: np.ndarray
    frame_sample: np.ndarray
    fault_rows: np.ndarray
    fault_sample: np.ndarray

    def understood(self, texts: Mapping[int, str]) -> np.ndarray:
        """(n,) whether the words of a sample are known, and those of its fault and frames."""
        found = _known(self.samples["state"], texts, State)
        kinds = _known(self.fault_rows["kind"], texts, FaultKind) & _known(self.fault_rows["where"], texts)
        found[self.fault_sample[~(kinds & _known(self.fault_rows["reaction"], texts, Reaction))]] = False
        found[self.frame_sample[~(_known(self.frames["tool"], texts) & _known(self.frames["state"], texts))]] = False
        return found

    def only(self, which: np.ndarray) -> Tables:
        """The rows of some samples."""
        if which.all():
            return self
        at, of_frame, of_fault = np.cumsum(which) - 1, which[self.frame_sample], which[self.fault_sample]
        frames, faults = self.frame_sample[of_frame], self.fault_sample[of_fault]
        return Tables(self.samples[which], self.frames[of_frame], at[frames], self.fault_rows[of_fault], at[faults])


def tables(data: bytes, pieces: Sequence[Piece]) -> Tables:
    """The samples in these pieces, but for those whose content is not as long as it says that it is."""
    starts = np.array([each.start for each in pieces], dtype=np.int64)
    lengths = np.array([each.stop for each in pieces], dtype=np.int64) - starts
    holds_one = lengths >= SAMPLE.itemsize
    starts, lengths = starts[holds_one], lengths[holds_one]
    rows = _gathered(data, starts, SAMPLE)
    faulty, counts = rows["faulty"] > 0, rows["frames"].astype(np.int64)
    whole = lengths == SAMPLE.itemsize + faulty * FAULT.itemsize + counts * FRAME.itemsize
    rows, starts, faulty, counts = rows[whole], starts[whole] + SAMPLE.itemsize, faulty[whole], counts[whole]
    faults = _gathered(data, starts[faulty], FAULT)
    starts = starts + faulty * FAULT.itemsize
    owner = np.repeat(np.arange(len(rows)), counts)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    frames = _gathered(data, starts[owner] + within * FRAME.itemsize, FRAME)
    return Tables(rows, frames, owner, faults, np.flatnonzero(faulty))


def _known(ids: np.ndarray, texts: Mapping[int, str], words: type | None = None) -> np.ndarray:
    allowed = None if words is None else {each.value for each in words}  # pyright: ignore[reportGeneralTypeIssues]
    names, where = np.unique(ids, return_inverse=True)
    known = [each in texts and (allowed is None or texts[each] in allowed) for each in names.tolist()]
    return np.array(known, dtype=bool)[where]


def _gathered(data: bytes, starts: np.ndarray, kind: np.dtype) -> np.ndarray:
    """(k,) rows of ``kind`` that start at these bytes."""
    found, taken = np.empty((len(starts), kind.itemsize), dtype=np.uint8), np.frombuffer(data, dtype=np.uint8)
    for first in range(0, len(starts), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        found[some] = taken[starts[some, None] + np.arange(kind.itemsize)]
    return found.view(kind)[:, 0]
