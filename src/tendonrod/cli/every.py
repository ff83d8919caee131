"""`--every`: only some samples of a trial count, and how many were left out is said."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, positive
from . import output
from .arguments import number, whole

if TYPE_CHECKING:
    from ..measurement.trial import Trial

Every = Annotated[
    str | None,
    typer.Option(
        "--every",
        metavar="COUNT",
        help="Only every COUNT-th used sample counts, as 10; or one in so many seconds, as 0.5s. Left out: all do.",
    ),
]
_FORM = "a whole number from 1, as 10 for every tenth, or seconds, as 0.5s"


def asked(text: str | None) -> dict[str, Any]:
    """`thinning.thinned`'s every or seconds; nothing where the option is missing."""
    if text is None:
        return {}
    found = re.fullmatch(r"([^a-z]*?)\s*(s?)", text.strip())
    if found is None or not found[1]:
        raise InvalidInput("--every", Fact(text or "''"), _FORM)
    if found[2]:
        return {"seconds": number("--every", found[1], positive)}
    try:
        return {"every": whole("--every", found[1], 1, 10**9)}
    except InvalidInput:
        raise InvalidInput("--every", Fact(text), _FORM) from None


def thin(trials: Sequence[Trial], text: str | None) -> list[Trial]:
    """The trials with the samples that ``text`` lets count; what was left out is noted on standard error."""
    from ..measurement.thinning import thinned
    from ..measurement.trial import LEFT_OUT

    how = asked(text)
    if not how:
        return list(trials)
    found = [thinned(each, **how) for each in trials]
    left = sum(int((each.fates == LEFT_OUT).any(axis=1).sum()) for each in found)
    used = sum(int((each.kept & each.on_robot).any(axis=1).sum()) for each in found)
    output.note(f"--every {text}: {used} samples count, {left} more are left out")
    return found
