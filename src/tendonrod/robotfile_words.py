"""Files that people write as text: reading TOML, numbers to SI, errors in the words of the file. Knows no table."""

from __future__ import annotations

import re
import tomllib
from decimal import Decimal
from difflib import get_close_matches
from math import radians
from pathlib import Path
from typing import Any

from .errors import MISSING, Fact, InvalidInput
from .robot import preset_names


def _shifted(digits: int):
    """Multiply by 10**digits as one does on paper, so that 0.572 mm is the float 0.000572."""
    return lambda value: float(Decimal(repr(value)).scaleb(digits))


_TO_SI = {
    "mm": _shifted(-3),
    "mm2": _shifted(-6),
    "mm4": _shifted(-12),
    "g": _shifted(-3),
    "gpa": _shifted(9),
    "deg": radians,
    "n": float,
}
SHAPE = (
    "a robot: name, then [tube], [notches] and [material], or [rod] or [tapered_rod] and [material], or [[segments]]; "
    "[[tendons]] as needed"
)


def text(name: str) -> str:
    """The text of the file ``name``. Raises `InvalidInput` where it cannot be read."""
    presets = ", ".join(preset_names())
    if not name.strip():
        raise InvalidInput("robot", name, f"a preset ({presets}) or the path of a robot file")
    try:
        return Path(name).read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput("robot file", name, f"UTF-8 text; byte {error.start} is not") from None
    except IsADirectoryError:
        raise InvalidInput("robot", name, f"a file, not a directory, or one of the presets {presets}") from None
    except (FileNotFoundError, ValueError):
        kind = "an existing TOML file" if Path(name).suffix or Path(name).name != name else "a preset or a TOML file"
        near = get_close_matches(name.lower(), preset_names(), n=1, cutoff=0.8)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise InvalidInput("robot", name, f"{kind}; the presets are {presets}{hint}") from None
    except OSError as error:
        raise InvalidInput("robot file", name, f"readable: {error.strerror}") from None


def parsed(name: str, text: str, shape: str = SHAPE) -> dict[str, Any]:
    """The TOML document. Raises `InvalidInput` that names the line, or for an empty one says the ``shape`` it needs."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(name, text, str(error)) from None
    if not document:
        raise InvalidInput(name, Fact("empty"), shape)
    return document


def _syntax_error(name: str, text: str, message: str) -> InvalidInput:
    """``message`` ends in "(at line 3, column 5)" or "(at end of document)"."""
    lines = text.splitlines() or [""]
    found = re.search(r"\(at line (\d+), column (\d+)\)", message)
    line = min(int(found[1]) if found else len(lines), len(lines))
    what = re.sub(r" *\(at .*\)$", "", message) + (f", column {found[2]}" if found else ", at the end of the file")
    return InvalidInput(f"{name}, line {line}", Fact(lines[line - 1].strip() or "blank"), f"valid TOML ({what})")


def flat_name(key: str) -> str:
    """The name without its unit: radius_mm -> radius."""
    stem, _, unit = key.rpartition("_")
    return stem if unit in _TO_SI else key


def si(table: Any, key: str) -> Any:
    """The value at a dotted key, in SI units; of a list, each."""
    value, convert = at(table, key), _TO_SI.get(key.rpartition("_")[2])
    if value is None or convert is None:
        return value
    return [convert(each) for each in value] if isinstance(value, list) else convert(value)


def at(table: Any, key: str) -> Any:
    """The value at a dotted key such as "tendons[0].radius_mm"; None below a table that is not there."""
    for part in re.findall(r"[^.\[\]]+", key):
        table = table[int(part)] if part.isdigit() else getattr(table, part, None)
    return table


def in_file_words(name: str, error: InvalidInput, table: Any, keys: dict[str, str], joint: str = ": ") -> InvalidInput:
    """The error of a domain class with the file's keys and numbers in place of flat SI names and SI numbers."""

    def as_in_file(found: re.Match[str]) -> str:
        key = keys.get(found[1])
        return found[0] if key is None else f"{key.rpartition('.')[2]} = {at(table, key)!r}"

    key = keys.get(error.field)
    allowed = re.sub(r"\b([a-z_\d]+) = ([-+.\de]+)", as_in_file, error.allowed)
    in_mm = r"\b(L_na =|end,) ([-+.\de]+) m\b"
    allowed = re.sub(in_mm, lambda found: f"{found[1]} {1e3 * float(found[2]):.6g} mm", allowed)
    if key is None:
        return InvalidInput(f"{name}{joint}{error.field}", error.value, allowed)
    value = at(table, key)
    return InvalidInput(f"{name}{joint}{key}", MISSING if value is None else value, allowed)
