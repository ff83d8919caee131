"""Writing robot files: the text that `robotfile` reads back as the same robot, and the TOML behind it.

A number in the unit of its key is the one that converts back to the very float of the robot. Where the unit has none
(some identified moduli in GPa; no number of up to 15 digits), the nearest is written, off by a last binary digit or
two, 2e-16; `rounded_in_file` has those numbers, for writers that must be exact.
"""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Mapping, Sequence
from math import inf, nextafter
from os import PathLike
from types import SimpleNamespace
from typing import Any

from .errors import InvalidInput, finite
from .files import complete, file_name
from .parameters import TENDON_KEYS, body_keys, changed_body, file_values
from .robot import Robot, as_robot
from .robotfile import _robot
from .robotfile_words import parsed, si

ROUNDED = 1e-15  # by how much, relative, a number may be off in a file
_LEFT_OUT = ("inner_radius_mm", "base_inner_radius_mm", "tip_inner_radius_mm", "precurvature_per_m")  # where zero
_PART = re.compile(r"[^.\[\]]+")


def robot_text(robot: Robot, comments: Sequence[str] = ()) -> str:
    """The robot file of ``robot``, with its sources; ``comments`` are lines on top.

    Raises `InvalidInput` where no robot file can say it: a source of a key that the file does not have, or a number
    that `load_robot` refuses, such as a length of 1 km.
    """
    text = _written(as_robot(robot), comments)
    robot_from_text(text)
    return text


def write_robot(robot: Robot, path: str | PathLike[str], comments: Sequence[str] = ()) -> None:
    """Write `robot_text` to ``path`` (.toml), complete or not at all. Raises `InvalidInput`."""
    write_text("robot file", path, robot_text(robot, comments))


def robot_from_text(text: str, name: str = "robot") -> Robot:
    """The robot that the text of a robot file describes; ``name`` is what errors call that file."""
    return _robot(name, parsed(name, text))


def rounded_in_file(robot: Robot) -> dict[str, Any]:
    """Robot-file key -> SI value (a number, or a list of them) of what `robot_text` can only say rounded."""
    exact, rounded = (file_values(each.body, each.tendons) for each in (robot, robot_from_text(_written(robot, ()))))
    lost = {key: value for key, value in exact.items() if value != rounded.get(key, value)}
    return {key: list(value) if isinstance(value, tuple) else value for key, value in lost.items()}


def with_exact(robot: Robot, exact: Mapping[str, Any]) -> Robot:
    """``robot``, as read, with the numbers that `rounded_in_file` gave. Raises `InvalidInput` for any that differ."""
    known = file_values(robot.body, robot.tendons)
    for key, value in exact.items():
        _check_rounding(key, value, known.get(key))
    flat = {key: name for name, key in body_keys(robot.body).items()}
    own = [
        {name: exact.get(f"tendons[{i}].{key}") for name, key in TENDON_KEYS.items()} for i in range(robot.n_tendons)
    ]
    given = [{name: value for name, value in each.items() if value is not None} for each in own]
    return Robot(
        name=robot.name,
        body=changed_body(robot.body, {flat[key]: value for key, value in exact.items() if key in flat}),
        tendons=tuple(dataclasses.replace(each, **new) for each, new in zip(robot.tendons, given, strict=True)),
        sources=robot.sources,
    )


def _check_rounding(key: str, value: Any, rounded: Any) -> None:
    pairs = [(value, rounded)]
    if isinstance(rounded, tuple) and isinstance(value, list) and len(value) == len(rounded):
        pairs = list(zip(value, rounded, strict=True))
    for new, old in pairs:
        known = rounded is not None
        allowed = f"{old!r} but for rounding, as in the robot file" if known else "under a key of the robot file"
        if not isinstance(old, float) or abs(finite(key, new, allowed) - old) > ROUNDED * abs(old):
            raise InvalidInput(key, value, allowed)


def _written(robot: Robot, comments: Sequence[str]) -> str:
    document: dict[Any, Any] = {"name": robot.name}
    for key, value in _shared(_said(robot), robot.sources).items():
        *above, last = _PART.findall(key)
        table = document
        for part in above:
            table = table.setdefault(int(part) if part.isdigit() else part, {})
        table[last] = file_number(last, value)
    if robot.sources:
        document["sources"] = dict(robot.sources)
    return toml(document, comments)


def _said(robot: Robot) -> dict[str, Any]:
    """Key -> SI value of all that the file says: what is no default, and what has a source."""
    values = file_values(robot.body, robot.tendons)
    unsaid = [key for key in values if key.endswith(_LEFT_OUT) and key not in robot.sources and not _any(values[key])]
    for i, tendon in enumerate(robot.tendons):
        for name, key in TENDON_KEYS.items():
            place, value = f"tendons[{i}].{key}", getattr(tendon, name)
            if place in robot.sources and value is not None:
                values[place] = value
    return {key: value for key, value in values.items() if key not in unsaid}


def _any(value: Any) -> bool:
    return any(value) if isinstance(value, tuple) else bool(value)


def _shared(values: Mapping[str, Any], sources: Mapping[str, str]) -> dict[str, Any]:
    """``values`` with the material that most segments have told once for all, if several have it or a source asks."""
    own: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        segment, _, rest = key.partition(".")
        if rest.startswith("material."):
            own.setdefault(segment, {})[rest] = value
    free = [each for segment, each in own.items() if not _has(sources, f"{segment}.material.")]
    asked = {key for key in sources if key.startswith("material.")}
    best = max(own.values(), key=lambda each: (asked <= each.keys(), free.count(each)), default={})
    if not own or (free.count(best) < 2 and not asked):
        return dict(values)
    told = {f"{segment}.{key}" for segment, each in own.items() if each == best for key in each}
    told = {key for key in told if not _has(sources, f"{key.partition('.')[0]}.material.")}
    return best | {key: value for key, value in values.items() if key not in told}


def _has(sources: Mapping[str, str], start: str) -> bool:
    return any(key.startswith(start) for key in sources)


def file_number(key: str, value: Any) -> Any:
    """``value`` (SI) in the unit of ``key``: the shortest number that reads back as it, else the nearest.

    Of lists, each; texts stay as they are.
    """
    if isinstance(value, (tuple, list)):
        return [file_number(key, each) for each in value]
    if not isinstance(value, float):
        return value
    low = high = value / _read(key, 1.0)
    near = [low]
    for _ in range(3):
        low, high = nextafter(low, -inf), nextafter(high, inf)
        near += [low, high]
    return min(near, key=lambda each: (abs(_read(key, each) - value), len(repr(each).removesuffix(".0"))))


def _read(key: str, value: float) -> float:
    return si(SimpleNamespace(**{key: value}), key)


def toml(document: Mapping[Any, Any], comments: Sequence[str] = ()) -> str:
    """The TOML text of nested tables; a table whose keys are numbers is a list of tables."""
    remarks = [line for each in comments for line in each.splitlines()]
    above = ["# " + "".join(c if c.isprintable() else " " for c in line) for line in remarks]
    return "\n".join([*above, *_lines(document, "")]).lstrip("\n") + "\n"


def _lines(table: Mapping[Any, Any], path: str) -> list[str]:
    lines = [f"{_key(key)} = {_literal(value)}" for key, value in table.items() if not isinstance(value, Mapping)]
    for key, value in table.items():
        if isinstance(value, Mapping):
            name = f"{path}{_key(key)}"
            listed = any(isinstance(each, int) for each in value)
            for each in value.values() if listed else (value,):
                lines += ["", f"[[{name}]]" if listed else f"[{name}]", *_lines(each, f"{name}.")]
    return lines


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _literal(key)


def _literal(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return f"[{', '.join(map(_literal, value))}]" if isinstance(value, list) else repr(value)


def write_text(field: str, path: str | PathLike[str], text: str) -> None:
    """Write a TOML file, complete or not at all. Raises `InvalidInput` for ``field``."""
    target = file_name(field, path, (".toml",))
    try:
        data = text.encode("utf-8")
    except UnicodeEncodeError as error:
        raise InvalidInput(field, text[error.start : error.end], "text that UTF-8 can hold") from None
    with complete(field, target) as draft:
        draft.write_bytes(data)
