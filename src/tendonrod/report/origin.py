"""What a page must say of the trials behind it: which are no measurements, and what was assumed of the field."""

from __future__ import annotations

from collections.abc import Sequence

from ..measurement.registration import AXES_OF_FIELD, UNKNOWN
from ..measurement.trial import Trial


def virtual(trials: Sequence[Trial]) -> list[str]:
    """Who made trials that are no measurements; with their names where others are."""
    by: dict[str, list[str]] = {}
    for each in trials:
        by.setdefault(each.origin.get("made by", ""), []).append(each.name)
    return [f"{maker}: {', '.join(names)}" if len(by) > 1 else maker for maker, names in by.items() if maker]


def assumed(trials: Sequence[Trial]) -> list[str]:
    """What had to be assumed to put the trackers' frame into the world: what it is off by is in all errors."""
    said = [each.origin.get("registration", "") for each in trials]
    found = [note for note in (UNKNOWN, AXES_OF_FIELD) if any(each.endswith(note) for each in said)]
    return [f"{note[0].upper()}{note[1:]}" for note in found]
