"""Errors built from facts, and the checks of numbers that raise them.

Every message is one line: the field, the value that was given, and what is allowed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from functools import partial
from math import inf, isfinite
from numbers import Real
from typing import Any

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
        reached = f"reached {f'{load_factor:.4g}' if load_factor > 0.0 else 'none'} of the load"
        missed = f", scaled residual {residual:.3g}" if 0.0 < residual < inf else ""
        super().__init__(f"{status.rstrip('. ')}; {reached}{missed}; {advice}")
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
    allowed = f"from {low:.6g} to {high:.6g}"
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
        if isinstance(entry, (list, tuple, np.ndarray)):
            raise InvalidInput(field, value, _vector_of(size))
        if type(entry) is not float or not isfinite(entry):
            return np.array([finite(field, each, _vector_of(size)) for each in entries])
    return np.array(entries)


def whole(field: str, value: object, low: int, high: int | None = None) -> int:
    """``value``, a Python or NumPy integer from ``low`` to ``high`` (no upper bound if None), else `InvalidInput`."""
    number: Any = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    fits = isinstance(number, (int, np.integer)) and not isinstance(number, bool)
    if not fits or number < low or (high is not None and number > high):
        allowed = f"a whole number >= {low}" if high is None else f"a whole number from {low} to {high}"
        raise InvalidInput(field, value, allowed)
    return int(number)


def numbers(field: str, value: object, ndim: int | Collection[int] = 1, only_finite: bool = True) -> np.ndarray:
    """``value``, nested sequences or an array of real numbers, as a fresh float array of ``ndim`` dimensions.

    ``ndim`` may allow several numbers of dimensions. Raises `InvalidInput` for another, and for the first entry, named
    by its place, that is no real number or, with ``only_finite``, NaN or infinite.
    """
    allowed_ndim = (ndim,) if isinstance(ndim, int) else tuple(ndim)
    try:
        raw = np.asarray(value)
    except ValueError:  # rows of different lengths
        raise InvalidInput(field, value, _array_of(allowed_ndim)) from None
    if raw.ndim not in allowed_ndim:
        raise InvalidInput(field, value, _array_of(allowed_ndim))
    array = np.array(raw, dtype=float) if raw.dtype.kind in "iuf" else None
    if array is None or _holds_bool(value) or (only_finite and not np.isfinite(array).all()):
        check = finite if only_finite else partial(_real, allowed=FINITE)
        return np.array([check(at, each) for at, each in _entries(field, value)], dtype=float).reshape(raw.shape)
    return array


def one_of(field: str, value: object, choices: Iterable[str]) -> str:
    """``value`` if it is one of ``choices``, else `InvalidInput` that lists them."""
    names = tuple(choices)
    if not isinstance(value, str) or value not in names:
        raise InvalidInput(field, value, "one of " + ", ".join(names))
    return value


def _entries(field: str, value: object) -> Iterator[tuple[str, object]]:
    """Each number of nested sequences with its place, field[0][1]."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, (str, bytes)) or not isinstance(value, Sequence):
        yield field, value
    else:
        for i, each in enumerate(value):
            yield from _entries(f"{field}[{i}]", each)


def _holds_bool(value: object) -> bool:
    """Whether a sequence hides a bool among its numbers, which NumPy would take for one."""
    if isinstance(value, (list, tuple)):
        return any(map(_holds_bool, value))
    return isinstance(value, (bool, np.bool_))


def _array_of(ndim: tuple[int, ...]) -> str:
    names = {0: "a finite number", 1: "a sequence of finite numbers", 2: "rows of finite numbers, all of one length"}
    return " or ".join(names.get(each, f"an array of {each} dimensions") for each in ndim)


def _vector_of(size: int) -> str:
    return f"a vector of {size} finite number{'' if size == 1 else 's'}"


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
    text = repr(_plain(value))
    return text if len(text) <= width else text[: width - 3] + "..."


def _plain(value: object) -> object:
    """Without NumPy's types, whose repr says more than the number."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return tuple(_plain(each) for each in value) if type(value) is tuple else value
