"""Reading robot files: TOML with units in its keys, checked key by key, converted to SI once.

Only this module and its tables know pydantic. Ranges are checked by the domain classes; their messages are put into
the words of the file here, so that each rule has one home.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib.resources import files
from math import inf
from os import PathLike, fspath
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from .body import Segment, Segments, TaperedRod
from .errors import MISSING, Fact, InvalidInput
from .parameters import ROD_KEYS, TAPERED_KEYS, TENDON_KEYS, TUBE_KEYS, body_keys
from .robot import Robot, preset_names
from .robotfile_tables import ROBOTS, SEGMENTS, RodMaterialTable, SegmentsRobotTable, TendonTable, TubeMaterialTable
from .robotfile_words import SHAPE, at, in_file_words, parsed, si, text
from .section import NotchedTube, PlainRod, StiffnessFactors
from .tendon import Tendon

# What no robot has: beyond it a number was most likely written in another unit, which the message therefore names.
_PLAUSIBLE = {
    "mm": (1e5, "<= 100000 mm"),
    "gpa": (2000.0, "<= 2000 GPa; 1 GPa is 1e9 Pa"),
    "density_kg_m3": (30_000.0, "<= 30000 kg/m3"),
    "turns": (1000.0, "from -1000 to 1000 turns over the whole length"),
    "friction": (10.0, "<= 10, a coefficient of friction"),
}


_KEYS = {"tube": TUBE_KEYS, "rod": ROD_KEYS, "tapered_rod": TAPERED_KEYS}
_SEGMENT_SHAPE = "a segment: tube and notches, or rod, or tapered_rod; angle_deg and material as needed"


def read_robot(source: str | PathLike[str]) -> Robot:
    """See `tendonrod.load_robot`."""
    if not isinstance(source, (str, PathLike)):
        raise InvalidInput("robot", source, f"a preset ({', '.join(preset_names())}) or the path of a robot file")
    if source in preset_names():
        preset = files("tendonrod") / "robots" / f"{source}.toml"
        return _robot(f"{source}.toml", parsed(f"{source}.toml", preset.read_text("utf-8")))
    name = fspath(source)
    return _robot(name, parsed(name, text(name)))


def _robot(name: str, document: dict[str, Any]) -> Robot:
    kind = _kind(f"{name}: body", document, ROBOTS, SHAPE)
    checked = validated(name, ROBOTS[kind], document)
    if isinstance(checked, SegmentsRobotTable):
        checked = _with_segments(name, checked, document)
    _check_sources(name, document)
    _check_plausible(name, document, checked)
    body, keys = _whole(name, checked) if isinstance(checked, SegmentsRobotTable) else _single(name, checked, kind)
    tendons = tuple(_tendon(f"{name}: tendons[{i}]", each) for i, each in enumerate(checked.tendons))
    try:
        return Robot(name=checked.name, body=body, tendons=tendons, sources=checked.sources)
    except InvalidInput as error:
        raise in_file_words(name, error, checked, keys | _tendon_keys(checked)) from None


def _kind(where: str, table: dict[str, Any], kinds: dict[str, Any], allowed: str) -> str:
    """Which one of the tables ``kinds`` there is; [notches] means [tube]."""
    given = [kind for kind in kinds if kind in table or (kind == "tube" and "notches" in table)]
    if len(given) != 1:
        what = " and ".join(f"[{kind}]" for kind in given) if given else "neither [tube] nor [rod]"
        raise InvalidInput(where, Fact(what), allowed)
    return given[0]


def validated(
    name: str,
    model: type[BaseModel],
    table: Any,
    above: tuple[int | str, ...] = (),
    expected: Callable[[Any], str] | None = None,
) -> Any:
    """``table``, found in file ``name`` at ``above``, as ``model``. Raises `InvalidInput` by key.

    expected(error of pydantic, a dict) says what is allowed there; None for the words of robot files.
    """
    try:
        return model.model_validate(table)
    except ValidationError as error:
        raise _key_error(name, model, error, above, expected or _expected) from None


def _with_segments(name: str, checked: SegmentsRobotTable, document: dict[str, Any]) -> SegmentsRobotTable:
    """Segments and shared material checked too; each is read as what it is, so that errors speak of that only."""
    kinds = [_kind(f"{name}: segments[{k}]", each, SEGMENTS, _SEGMENT_SHAPE) for k, each in enumerate(checked.segments)]
    segments = [
        validated(name, SEGMENTS[kind], each, ("segments", k))
        for k, (kind, each) in enumerate(zip(kinds, checked.segments, strict=True))
    ]
    material = checked.material
    if material is not None:
        material = validated(name, TubeMaterialTable if "tube" in kinds else RodMaterialTable, material, ("material",))
    return checked.model_copy(update={"segments": segments, "material": material})


def _whole(name: str, checked: SegmentsRobotTable) -> tuple[Segments, dict[str, str]]:
    segments, angles = [], []
    for k, each in enumerate(checked.segments):
        where = f"segments[{k}]"
        if at(each, "material") is None and checked.material is None:
            raise InvalidInput(f"{name}: {where}.material", MISSING, "given, there or as [material] for all segments")
        kind = next(kind for kind in SEGMENTS if at(each, kind) is not None)
        segments.append(_single(name, checked, kind, f"{where}.")[0])
        angle = si(each, "angle_deg")
        if k == 0 and angle is not None:
            raise InvalidInput(f"{name}: {where}.angle_deg", at(each, "angle_deg"), "left out: nothing comes before it")
        angles.append(0.0 if angle is None else angle)
    try:
        body = Segments(segments=tuple(segments), angles=tuple(angles[1:]))
    except InvalidInput as error:
        raise in_file_words(name, error, checked, {}) from None
    return body, body_keys(body)


def _single(name: str, checked: BaseModel, kind: str, prefix: str = "") -> tuple[Segment, dict[str, str]]:
    """A body of one segment from the tables below ``prefix``, and the key of each of its names."""
    keys = {flat: prefix + key for flat, key in _KEYS[kind].items()}
    if at(checked, f"{prefix}material") is None:
        keys |= {flat: key for flat, key in _KEYS[kind].items() if key.startswith("material.")}
    values = {flat: si(checked, key) for flat, key in keys.items()}
    if kind == "tube":
        keys["stiffness_factors"] = keys["axial_factor"].rpartition(".")[0]
    try:
        if kind == "tube":
            return _tube(values), keys
        given = {flat: value for flat, value in values.items() if value is not None}
        return (PlainRod if kind == "rod" else TaperedRod)(**given), keys
    except InvalidInput as error:
        raise in_file_words(name, error, checked, keys) from None


def _tube(values: dict[str, Any]) -> NotchedTube:
    own = {flat: value for flat, value in values.items() if not flat.endswith("_factor")}
    factors = {flat.removesuffix("_factor"): value for flat, value in values.items() if flat.endswith("_factor")}
    given = None if factors["axial"] is None else StiffnessFactors(**factors)
    return NotchedTube(**own, stiffness_factors=given)


def _tendon(where: str, checked: TendonTable) -> Tendon:
    try:
        given = {name: si(checked, key) for name, key in TENDON_KEYS.items()}
        return Tendon(**{name: value for name, value in given.items() if value is not None})
    except InvalidInput as error:
        raise in_file_words(where, error, checked, TENDON_KEYS, joint=".") from None


def _tendon_keys(checked: Any) -> dict[str, str]:
    indices = range(len(checked.tendons))
    return {f"tendons[{i}].{name}": f"tendons[{i}].{key}" for i in indices for name, key in TENDON_KEYS.items()}


def _key_error(
    name: str,
    model: type[BaseModel],
    error: ValidationError,
    before: tuple[int | str, ...],
    expected: Callable[[Any], str],
) -> InvalidInput:
    first = min(error.errors(include_url=False), key=lambda each: each["type"] != "extra_forbidden")
    *above, _ = first["loc"] or ("",)
    key = _dotted((*before, *first["loc"]))
    if first["type"] == "missing":
        return InvalidInput(f"{name}: {key}", MISSING, "given")
    if first["type"] == "extra_forbidden":
        place = _dotted((*before, *above))
        table = f"of [{place}]" if place else "at the top"
        return InvalidInput(f"{name}: {key}", first["input"], f"one of the keys {table}: {_known_keys(model, above)}")
    return InvalidInput(f"{name}: {key}", first["input"], expected(first))


def _expected(error: Any) -> str:
    vector = error["loc"] and error["loc"][-1] == "precurvature_per_m"
    return _EXPECTED.get(error["type"], "a list of 3 finite numbers" if vector else "a finite number")


_EXPECTED = {
    "string_type": "a text in quotes",
    "model_type": "a table, such as [tube]",
    "dict_type": "a table of texts",
    "list_type": "a list; tables [[tendons]] where it is tendons",
    "value_error": 'a finite number, or a list of finite numbers where routing = "sampled"',
}


def _dotted(location: tuple[int | str, ...]) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")


def _known_keys(model: type[BaseModel], above: list[int | str]) -> str:
    for part in above:
        if isinstance(part, str):
            model = next(_models(model.model_fields[part].annotation))
    return ", ".join(model.model_fields)


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """The tables named in a type, however deep: in ``list[FaultTable] | None`` the `FaultTable`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for each in get_args(annotation):
        yield from _models(each)


def _check_sources(name: str, document: dict[str, Any]) -> None:
    known = set(_leaves(document))
    for key, said in document.get("sources", {}).items():
        if key not in known:
            raise InvalidInput(f"{name}: sources.{key}", said, "under a key that this file gives a value")


def _check_plausible(name: str, document: dict[str, Any], checked: BaseModel) -> None:
    keys = list(_leaves({table: values for table, values in document.items() if table != "sources"}))
    has_tube = any("tube." in key for key in keys)
    for key in keys:
        word = key.rpartition(".")[2]
        most, allowed = _PLAUSIBLE.get(word) or _PLAUSIBLE.get(word.rpartition("_")[2]) or (inf, "")
        if word.endswith("_gpa") and not has_tube:
            continue  # rods of textbooks come in units of their own
        value = at(checked, key)
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, float) and abs(each) > most:
                raise InvalidInput(f"{name}: {key}", value, allowed)


def _leaves(node: Any, path: str = ""):
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _leaves(value, f"{path}.{key}" if path else key)
    elif isinstance(node, list) and node and isinstance(node[0], dict):
        for i, value in enumerate(node):
            yield from _leaves(value, f"{path}[{i}]")
    else:
        yield path
