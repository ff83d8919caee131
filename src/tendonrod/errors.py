"""Errors built from facts, and the checks of numbers that raise them.

Every message is one line: the field, the value that was given, and what is allowed.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from math import isfinite
from numbers import Real

import numpy as np

FINITE = "a finite number"


class TendonrodError(Exception):
    """Base of all errors raised by this package."""


class Fact(str):
    """A word that stands in an error message where a value would, shown without quotes: missing, empty."""

    def __repr__(self) -> str:
        return str(self)


MISSING = Fact("missing")


class InvalidInput(TendonrodError, ValueError):
    """A value outside what is allowed; the message is ``"{field} = {value}: must be {allowed}"``.

    Attributes: ``field`` (name as the caller knows it), ``value`` (as given), ``allowed`` (text).
    """

    def __init__(self, field: str, value: object, allowed: str) -> None:
        super().__init__(field, value, allowed)
        self.field, self.value, self.allowed = field, value, allowed

    def __str__(self) -> str:
        return " ".join(f"{self.field} = {_shown(self.value)}: must be {self.allowed}".split())


class NotConverged(TendonrodError, RuntimeError):
    """A solve that found no equilibrium within its tolerance.

    Attributes: ``status`` (sentence), ``load_factor`` (share of the load reached, 0 to 1), ``residual`` (scaled,
    dimensionless), ``advice`` (what to try).
    """

    def __init__(self, *, status: str, load_factor: float, residual: float, advice: str) -> None:
        super().__init__(
            f"{status.rstrip('. ')}; reached {load_factor:.4g} of the load, scaled residual {residual:.3g}; {advice}"
        )
        self.status, self.load_factor, self.residual, self.advice = status, load_factor, residual, advice

    def __reduce__(self):
        facts = {name: getattr(self, name) for name in ("status", "load_factor", "residual", "advice")}
        return partial(NotConverged, **facts), ()


def finite(field: str, value: object, allowed: str = FINITE) -> float:
    """``value`` as a float. Raises `InvalidInput` for NaN, infinity, bool, text and whatever is not a real number."""
    number = value if type(value) is float else _real(field, value, allowed)
    if not isfinite(number):
        raise InvalidInput(field, number, allowed)
    return number


def positive(field: str, value: object) -> float:
    """``value`` as a finite float > 0, else `InvalidInput`."""
    number = finite(field, value, "a finite number > 0")
    if number <= 0.0:
        raise InvalidInput(field, number, "> 0")
    return number


def nonnegative(field: str, value: object) -> float:
    """``value`` as a finite float >= 0, else `InvalidInput`."""
    number = finite(field, value, "a finite number >= 0")
    if number < 0.0:
        raise InvalidInput(field, number, ">= 0")
    return number


def within(field: str, value: object, low: float, high: float) -> float:
    """``value`` as a float in the closed interval [low, high], else `InvalidInput`."""
    if type(value) is float and low <= value <= high:
        return value
    allowed = f"from {low:.10g} to {high:.10g}"
    number = finite(field, value, allowed)
    if not low <= number <= high:
        raise InvalidInput(field, number, allowed)
    return number


def vector(field: str, value: object, size: int) -> np.ndarray:
    """``value`` as a fresh float array of shape (size,), every entry finite, else `InvalidInput`."""
    entries = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(entries, (tuple, list)) or len(entries) != size:
        raise InvalidInput(field, value, _vector_of(size))
    for entry in entries:
        if type(entry) is not float or not isfinite(entry):
            return np.array([finite(field, each, _vector_of(size)) for each in entries])
    return np.array(entries)


def one_of(field: str, value: object, choices: Iterable[str]) -> str:
    """``value`` if it is one of ``choices``, else `InvalidInput` that lists them."""
    names = tuple(choices)
    if not isinstance(value, str) or value not in names:
        raise InvalidInput(field, value, "one of " + ", ".join(names))
    return value


def _vector_of(size: int) -> str:
    return f"a vector of {size} finite numbers"


def _real(field: str, value: object, allowed: str) -> float:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InvalidInput(field, value, allowed)
    try:
        return float(value)
    except OverflowError:
        raise InvalidInput(field, value, allowed) from None


def _shown(value: object, width: int = 160) -> str:
    if isinstance(value, (np.ndarray, np.generic)):
        value = value.tolist()
    text = repr(value)
    return text if len(text) <= width else text[: width - 3] + "..."
