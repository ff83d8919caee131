"""The titles of columns: "tension_N", "tip_x (mm)" and "time [ms]" as what they hold and in which unit."""

from __future__ import annotations

import re
from collections.abc import Iterable
from decimal import Decimal

from ..errors import Fact, InvalidInput

STANDARD_GRAVITY = Decimal("9.80665")
_MICRO = {spelling: Decimal("1e-6") for spelling in ("u", "\u00b5", "\u03bc")}  # the micro sign is also a Greek letter
_LENGTHS = {"m": Decimal(1), "mm": Decimal("1e-3"), "cm": Decimal("1e-2"), "in": Decimal("0.0254")}
_TIMES = {"s": Decimal(1), "sec": Decimal(1), "ms": Decimal("1e-3"), "min": Decimal(60)}
# Kind -> unit, in lower case -> factor to SI; None: degrees. There is no meganewton on these benches: mn is mN.
FACTORS: dict[str, dict[str, Decimal | None]] = {
    "time": {**_TIMES, **{f"{u}s": factor for u, factor in _MICRO.items()}},
    "force": {
        "n": Decimal(1), "mn": Decimal("1e-3"), "kgf": STANDARD_GRAVITY, "gf": STANDARD_GRAVITY * Decimal("1e-3"),
    },
    "length": {**_LENGTHS, **{f"{u}m": factor for u, factor in _MICRO.items()}},
    "angle": {"rad": Decimal(1), "deg": None, "\u00b0": None},
    "share": {"1": Decimal(1), "%": Decimal("1e-2")},
    "number": {"1": Decimal(1)},
}  # fmt: skip
SHOWN = {
    "time": "s, ms, us, min",
    "force": "N, mN, kgf, gf",
    "length": "m, cm, mm, um, in",
    "angle": "rad, deg",
    "share": "nothing, %, or a length: m, cm, mm, um, in",
    "number": "nothing",
}
_AMBIGUOUS = {"g", "kg"}  # grams are no force, and gram-force has a name
_SUFFIXES = ({unit for kind in FACTORS.values() for unit in kind} | _AMBIGUOUS) - {"1"}
_BRACKETS = re.compile(r"(.*?)\s*(?:\(([^()]*)\)|\[([^\[\]]*)\])")
_SUFFIX = re.compile(r"(.+)[_ /]([^_ /]+)")


def parsed_title(title: str) -> tuple[str, str | None]:
    """(name, unit): the name in lower case with one _ between words, the unit in lower case or None.

    A unit stands in brackets or at the end: "Load cell [N]", "tip_x_mm"; at the end only a known one counts.
    """
    if found := _BRACKETS.fullmatch(title.strip()):
        return plain(found[1]), (found[2] if found[2] is not None else found[3]).strip().lower()
    found = _SUFFIX.fullmatch(title.strip())
    if found and found[2].lower() in _SUFFIXES:
        return plain(found[1]), found[2].lower()
    return plain(title), None


def plain(name: str) -> str:
    """``name`` in lower case, words joined by _."""
    return re.sub(r"\W+", "_", name.strip().lower()).strip("_")


def check_apart(names: Iterable[str]) -> None:
    """Raises `InvalidInput` for trackers whose columns would have the same titles, or titles without a name."""
    found: dict[str, str] = {}
    for name in names:
        start = plain(name)
        if not start:
            raise InvalidInput("trackers", [name], "of names with a letter or a digit, for the titles of their columns")
        if start in found:
            allowed = f"of names whose columns differ; {start}_x, {start}_y and so on would be of both"
            raise InvalidInput("trackers", [found[start], name], allowed)
        found[start] = name


def factor(field: str, kind: str, unit: str | None) -> Decimal | None:
    """From ``unit`` to SI for a quantity of ``kind``; None: from degrees. Raises `InvalidInput` for ``field``."""
    if unit in (None, "", "-") and kind in ("share", "number"):
        return Decimal(1)
    if unit is None:
        allowed = f"one of {SHOWN[kind]}, in the title, as name_unit or name (unit), or in [units] of the column map"
        raise InvalidInput(field, Fact("without a unit"), allowed)
    if unit not in FACTORS[kind]:
        hint = "; write gf for gram-force" if kind == "force" and unit in _AMBIGUOUS else ""
        raise InvalidInput(field, Fact(f"in {unit or 'nothing'}"), f"in one of {SHOWN[kind]}{hint}")
    return FACTORS[kind][unit]
