"""Identified numbers as text: as many decimals as their standard error supports, in the unit of the robot's file."""

from __future__ import annotations

from math import floor, isfinite, log10

from .unknowns import Unknown

DIGITS = 2  # of a standard error
MOST = 9  # decimals


def decimals(error: float) -> int | None:
    """Decimals that leave `DIGITS` of ``error``; None where it is zero, not known, or too small to be told so."""
    if not isfinite(error) or error <= 0.0:
        return None
    found = max(0, DIGITS - 1 - floor(log10(error)))
    return found if found <= MOST else None


def plain(value: float, error: float) -> str:
    """``value`` with the decimals of ``error``, of the same unit; what rounds to zero has no sign."""
    places = decimals(error)
    text = f"{value:.6g}" if places is None else f"{value:.{places}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def number(unknown: Unknown, value: float, error: float) -> str:
    """``value`` (SI) in the unknown's unit, which is not said, with the decimals of ``error`` (SI)."""
    return plain(value * unknown.per_si, error * unknown.per_si)


def with_error(unknown: Unknown, value: float, error: float, sign: str = "±") -> str:
    """Such as 68.42 ± 0.52 GPa."""
    return f"{number(unknown, value, error)} {sign} {number(unknown, error, error)} {unknown.unit}".rstrip()


def span(unknown: Unknown, low: float, high: float, error: float) -> str:
    """Such as 67.40 to 69.45, with the decimals of ``error``; an end that is not known is a question mark."""
    ends = (number(unknown, each, error) if isfinite(each) else "?" for each in (low, high))
    return " to ".join(ends)
