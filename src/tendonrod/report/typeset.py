"""Plain sentences for a page: true minus signs, numbers written out, a number not parted from its unit."""

from __future__ import annotations

import re
from html import escape

_EXPONENT = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?e\+0[0-5]\b")  # larger ones would be long to read
_MINUS = re.compile(r"(?<![\w.])-(?=\d)|(?<=\de)-(?=\d\d\b)")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:mm|deg|g|N|GPa|kg/m3|1/m|%)(?!\w))")
_NAMED = re.compile(r"\b(\w*_\w+) (?=−?\d)")


def minus(text: str) -> str:
    """With true minus signs; a hyphen inside a word or a date stays."""
    return _MINUS.sub("−", text)


def typeset(text: str) -> str:
    """``text`` as HTML: minus signs, 140 for 1.4e+02, and no line break before a unit."""
    spelled = _EXPONENT.sub(lambda found: f"{float(found[0]):.0f}", text)
    return _BEFORE_UNIT.sub("\u00a0", minus(escape(spelled)))


def values(text: str) -> str:
    """As `typeset`, of values such as "base_tilt_y -10.9 deg, tip_mass 1 g": names stay with their numbers, too."""
    return _NAMED.sub("\\1\u00a0", typeset(text))


def whole(text: str) -> str:
    """The same as HTML, not to be broken."""
    return f'<span style="white-space:nowrap">{minus(escape(text))}</span>'
