"""What `tendonrod validate` and `tendonrod identify` both say of trials."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..measurement.trial import Trial


def assumptions(trials: Sequence[Trial]) -> list[str]:
    """What had to be assumed of the field to register them, a paragraph each; it goes before what hangs on it."""
    from ..measurement.registration import AXES_OF_FIELD, UNKNOWN

    said = [each.origin.get("registration", "") for each in trials]
    remedy = {UNKNOWN: ";\nwhat it is off by is in all errors; give the trial with the tracker on the base too"}
    found = [note for note in (UNKNOWN, AXES_OF_FIELD) if any(each.endswith(note) for each in said)]
    return [f"Note: {note}{remedy.get(note, '')}." for note in found]


def made_by(trials: Sequence[Trial]) -> list[str]:
    """A line for each maker of trials that are no measurements; with their names where others are."""
    by: dict[str, list[str]] = {}
    for each in trials:
        by.setdefault(each.origin.get("made by", ""), []).append(each.name)
    virtual = {maker: names for maker, names in by.items() if maker}
    return [
        f"{', '.join(names)}: made by {maker}" if len(by) > 1 else f"made by {maker}"
        for maker, names in virtual.items()
    ]


def lost(trials: Sequence[Trial]) -> str:
    """Why samples on the robot are not used, with how many."""
    from ..measurement.trial import KEPT

    fates = Counter(fate for each in trials for fate in each.fates[:, each.on_robot].ravel() if fate != KEPT)
    return ", ".join(f"{n} {fate}" for fate, n in fates.most_common()) or "no tracker sits on the robot"
