"""Vertebral levels by name, C3 to L5 from the head down, and ranges of them such as "T8-L2"."""

from __future__ import annotations

from dataclasses import dataclass

from ..errors import InvalidInput, one_of

NAMES = (*(f"C{i}" for i in range(3, 8)), *(f"T{i}" for i in range(1, 13)), *(f"L{i}" for i in range(1, 6)))
PLACES = {name: i for i, name in enumerate((*NAMES, "S1"))}  # S1 is known for its canal, not as a level to build
DEFAULT = "T8-L2"


@dataclass(frozen=True, kw_only=True)
class Level:
    """One vertebra: its body stands between ``z_low`` and ``z_high`` (m); the disc below it is ``disc`` m high."""

    name: str
    z_low: float
    z_high: float
    disc: float

    @property
    def middle(self) -> float:
        """z of the middle of the body, m."""
        return 0.5 * (self.z_low + self.z_high)


def level_range(text: object) -> tuple[str, ...]:
    """Names of a range such as "T8-L2" or "T10", from the head down. Raises `InvalidInput`."""
    allowed = f"a level or a range of levels from the head down, as {DEFAULT}; levels are C3 to C7, T1 to T12, L1 to L5"
    ends = text.upper().replace("–", "-").replace(" ", "").split("-") if isinstance(text, str) else []
    if len(ends) not in (1, 2) or not set(ends) <= set(NAMES):
        raise InvalidInput("levels", text, allowed)
    first, last = PLACES[ends[0]], PLACES[ends[-1]]
    if first > last:
        raise InvalidInput("levels", text, f"{allowed}; here {ends[0]} lies below {ends[-1]}")
    return NAMES[first : last + 1]


def level_name(field: str, value: object, names: tuple[str, ...]) -> str:
    """``value`` if it is one of ``names``, else `InvalidInput`."""
    return one_of(field, value, names)
