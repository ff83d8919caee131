"""Reading robot files: TOML with units in its keys, checked key by key, converted to SI once.

The only module that knows pydantic. Ranges are checked by the domain classes; their messages are put into the words of
the file here, so that each rule has one home.
"""

from __future__ import annotations

import re
import tomllib
from decimal import Decimal
from difflib import get_close_matches
from importlib.resources import files
from math import inf, radians
from os import PathLike, fspath
from pathlib import Path
from typing import Annotated, Any, get_args

from pydantic import BaseModel, ConfigDict, Field, StrictStr, ValidationError

from .errors import MISSING, Fact, InvalidInput
from .robot import ROD_KEYS, TUBE_KEYS, Robot, preset_names
from .section import NotchedTube, PlainRod, StiffnessFactors
from .tendon import Tendon

Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]


def _shifted(digits: int):
    """Multiply by 10**digits as one does on paper, so that 0.572 mm is the float 0.000572."""
    return lambda value: float(Decimal(repr(value)).scaleb(digits))


_TO_SI = {"mm": _shifted(-3), "mm2": _shifted(-6), "mm4": _shifted(-12), "gpa": _shifted(9), "deg": radians}
_SHAPE = "a robot: name, then [tube], [notches] and [material], or [rod] and [material]; [[tendons]] as needed"


# What no robot has: beyond it a number was most likely written in another unit, which the message therefore names.
_PLAUSIBLE = {
    "mm": (1e5, "<= 100000 mm"),
    "gpa": (2000.0, "<= 2000 GPa; 1 GPa is 1e9 Pa"),
    "density_kg_m3": (30_000.0, "<= 30000 kg/m3"),
    "turns": (1000.0, "from -1000 to 1000 turns over the whole length"),
}


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _Tube(_Table):
    inner_radius_mm: Number
    outer_radius_mm: Number
    length_mm: Number


class _Notches(_Table):
    width_mm: Number
    spacing_mm: Number
    uncut_angle_deg: Number
    turns: Number


class _Factors(_Table):
    axial: Number
    bending_x: Number
    bending_y: Number
    torsion: Number


class _RodMaterial(_Table):
    youngs_modulus_gpa: Number
    shear_modulus_gpa: Number
    density_kg_m3: Number


class _TubeMaterial(_RodMaterial):
    torsion: StrictStr = "published"
    stiffness_factors: _Factors | None = None


class _Rod(_Table):
    length_mm: Number
    radius_mm: Number | None = None
    area_mm2: Number | None = None
    ix_mm4: Number | None = None
    iy_mm4: Number | None = None
    j_mm4: Number | None = None
    precurvature_per_m: list[Number] = Field(default=[0.0, 0.0, 0.0], min_length=3, max_length=3)


class _Tendon(_Table):
    routing: StrictStr
    radius_mm: Number | None = None
    x_mm: Number | None = None
    y_mm: Number | None = None
    offset_mm: Number | None = None
    angle_deg: Number | None = None
    turns: Number | None = None
    end_mm: Number | None = None


class _TubeRobot(_Table):
    name: StrictStr
    tube: _Tube
    notches: _Notches
    material: _TubeMaterial
    tendons: list[_Tendon] = []
    sources: dict[str, StrictStr] = {}


class _RodRobot(_Table):
    name: StrictStr
    rod: _Rod
    material: _RodMaterial
    tendons: list[_Tendon] = []
    sources: dict[str, StrictStr] = {}


def read_robot(source: str | PathLike[str]) -> Robot:
    """See `tendonrod.load_robot`."""
    if not isinstance(source, (str, PathLike)):
        raise InvalidInput("robot", source, f"a preset ({', '.join(preset_names())}) or the path of a robot file")
    if source in preset_names():
        preset = files("tendonrod") / "robots" / f"{source}.toml"
        return _robot(f"{source}.toml", _parsed(f"{source}.toml", preset.read_text("utf-8")))
    name = fspath(source)
    return _robot(name, _parsed(name, _text(name)))


def _text(name: str) -> str:
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


def _parsed(name: str, text: str) -> dict[str, Any]:
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise _syntax_error(name, text, str(error)) from None
    if not document:
        raise InvalidInput(name, Fact("empty"), _SHAPE)
    return document


def _syntax_error(name: str, text: str, message: str) -> InvalidInput:
    """``message`` ends in "(at line 3, column 5)" or "(at end of document)"."""
    lines = text.splitlines() or [""]
    found = re.search(r"\(at line (\d+), column (\d+)\)", message)
    line = min(int(found[1]) if found else len(lines), len(lines))
    what = re.sub(r" *\(at .*\)$", "", message) + (f", column {found[2]}" if found else ", at the end of the file")
    return InvalidInput(f"{name}, line {line}", Fact(lines[line - 1].strip() or "blank"), f"valid TOML ({what})")


def _robot(name: str, document: dict[str, Any]) -> Robot:
    has_tube, has_rod = "tube" in document or "notches" in document, "rod" in document
    if has_tube == has_rod:
        what = Fact("[tube] and [rod]" if has_tube else "neither [tube] nor [rod]")
        raise InvalidInput(f"{name}: body", what, _SHAPE)
    model = _TubeRobot if has_tube else _RodRobot
    try:
        checked = model.model_validate(document)
    except ValidationError as error:
        raise _key_error(name, model, error) from None
    _check_sources(name, document)
    _check_plausible(name, document, checked)
    return _built(name, checked)


def _built(name: str, checked: _TubeRobot | _RodRobot) -> Robot:
    keys = TUBE_KEYS if isinstance(checked, _TubeRobot) else ROD_KEYS
    try:
        body = _tube(checked) if isinstance(checked, _TubeRobot) else _rod(checked)
    except InvalidInput as error:
        raise _in_file_words(name, error, checked, keys) from None
    tendons = tuple(_tendon(f"{name}: tendons[{i}]", each) for i, each in enumerate(checked.tendons))
    try:
        return Robot(name=checked.name, body=body, tendons=tendons, sources=checked.sources)
    except InvalidInput as error:
        raise _in_file_words(name, error, checked, keys | _tendon_keys(checked)) from None


def _tube(checked: _TubeRobot) -> NotchedTube:
    given = checked.material.stiffness_factors
    factors = None if given is None else StiffnessFactors(**given.model_dump())
    values = {name: _si(checked, key) for name, key in TUBE_KEYS.items() if not name.endswith("_factor")}
    return NotchedTube(**values, stiffness_factors=factors)


def _rod(checked: _RodRobot) -> PlainRod:
    return PlainRod(**{name: _si(checked, key) for name, key in ROD_KEYS.items()})


def _tendon(where: str, checked: _Tendon) -> Tendon:
    keys = {_flat(key): key for key in _Tendon.model_fields}
    try:
        given = {name: _si(checked, key) for name, key in keys.items()}
        return Tendon(**{name: value for name, value in given.items() if value is not None})
    except InvalidInput as error:
        raise _in_file_words(where, error, checked, keys, joint=".") from None


def _tendon_keys(checked: _TubeRobot | _RodRobot) -> dict[str, str]:
    indices = range(len(checked.tendons))
    return {f"tendons[{i}].{_flat(key)}": f"tendons[{i}].{key}" for i in indices for key in _Tendon.model_fields}


def _flat(key: str) -> str:
    """The name without its unit: radius_mm -> radius."""
    stem, _, unit = key.rpartition("_")
    return stem if unit in _TO_SI else key


def _si(table: BaseModel, key: str) -> Any:
    value, convert = _at(table, key), _TO_SI.get(key.rpartition("_")[2])
    return value if value is None or convert is None else convert(value)


def _at(table: Any, key: str) -> Any:
    """The value at a dotted key such as "tendons[0].radius_mm"; None below a table that is not there."""
    for part in re.findall(r"[^.\[\]]+", key):
        table = table[int(part)] if part.isdigit() else getattr(table, part, None)
    return table


def _in_file_words(
    name: str, error: InvalidInput, table: BaseModel, keys: dict[str, str], joint: str = ": "
) -> InvalidInput:
    """The error of a domain class with the file's keys and numbers in place of flat SI names and SI numbers."""

    def as_in_file(found: re.Match[str]) -> str:
        key = keys.get(found[1])
        return found[0] if key is None else f"{key.rpartition('.')[2]} = {_at(table, key)!r}"

    key = keys.get(error.field)
    allowed = re.sub(r"\b([a-z_]+) = ([-+.\de]+)", as_in_file, error.allowed)
    allowed = re.sub(r"\bL_na = ([-+.\de]+) m\b", lambda found: f"L_na = {1e3 * float(found[1]):.6g} mm", allowed)
    if key is None:
        where = error.field.replace("stiffness_factors", "material.stiffness_factors")
        return InvalidInput(f"{name}{joint}{where}", error.value, allowed)
    value = _at(table, key)
    return InvalidInput(f"{name}{joint}{key}", MISSING if value is None else value, allowed)


def _key_error(name: str, model: type[BaseModel], error: ValidationError) -> InvalidInput:
    first = min(error.errors(include_url=False), key=lambda each: each["type"] != "extra_forbidden")
    *above, last = first["loc"]
    key = _dotted(first["loc"])
    if first["type"] == "missing":
        return InvalidInput(f"{name}: {key}", MISSING, "given")
    if first["type"] == "extra_forbidden":
        table = f"of [{_dotted(tuple(above))}]" if above else "at the top"
        return InvalidInput(f"{name}: {key}", first["input"], f"one of the keys {table}: {_known_keys(model, above)}")
    return InvalidInput(f"{name}: {key}", first["input"], _EXPECTED.get(first["type"], _expected(str(last))))


def _expected(key: str) -> str:
    if key == "precurvature_per_m":
        return "a list of 3 finite numbers"
    return "a finite number"


_EXPECTED = {
    "string_type": "a text in quotes",
    "model_type": "a table, such as [tube]",
    "dict_type": "a table of texts",
    "list_type": "a list; tables [[tendons]] where it is tendons",
}


def _dotted(location: tuple[int | str, ...]) -> str:
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")


def _known_keys(model: type[BaseModel], above: list[int | str]) -> str:
    for part in above:
        if isinstance(part, str):
            annotation = model.model_fields[part].annotation
            candidates = (annotation, *get_args(annotation))
            model = next(each for each in candidates if isinstance(each, type) and issubclass(each, BaseModel))
    return ", ".join(model.model_fields)


def _check_sources(name: str, document: dict[str, Any]) -> None:
    known = set(_leaves(document))
    for key, text in document.get("sources", {}).items():
        if key not in known:
            raise InvalidInput(f"{name}: sources.{key}", text, "under a key that this file gives a value")


def _check_plausible(name: str, document: dict[str, Any], checked: BaseModel) -> None:
    for key in _leaves({table: values for table, values in document.items() if table != "sources"}):
        word = key.rpartition(".")[2]
        most, allowed = _PLAUSIBLE.get(word) or _PLAUSIBLE.get(word.rpartition("_")[2]) or (inf, "")
        if word.endswith("_gpa") and "tube" not in document:
            continue  # rods of textbooks come in units of their own
        value = _at(checked, key)
        if isinstance(value, float) and abs(value) > most:
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
