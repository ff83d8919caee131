"""The numbers of a body and its tendons by flat names, as `Robot.parameters` and `Robot.replace` know them.

A body of segments prefixes the names of each: segment1_length, segment2_angle. A lone tendon has tendon_radius, one of
several tendon2_radius. Numbering starts at 1.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from .body import Body, Segment, Segments, TaperedRod
from .errors import MISSING, InvalidInput, vector
from .section import NotchedTube, StiffnessFactors
from .tendon import Tendon

_FACTORS = ("axial", "bending_x", "bending_y", "torsion")
_PRECURVATURE = ("precurvature_x", "precurvature_y", "precurvature_z")
MATERIAL_KEYS = {
    "youngs_modulus": "material.youngs_modulus_gpa",
    "shear_modulus": "material.shear_modulus_gpa",
    "density": "material.density_kg_m3",
}
TUBE_KEYS = {
    "inner_radius": "tube.inner_radius_mm",
    "outer_radius": "tube.outer_radius_mm",
    "length": "tube.length_mm",
    "notch_width": "notches.width_mm",
    "notch_spacing": "notches.spacing_mm",
    "uncut_angle": "notches.uncut_angle_deg",
    "turns": "notches.turns",
    **MATERIAL_KEYS,
    "torsion": "material.torsion",
    **{f"{name}_factor": f"material.stiffness_factors.{name}" for name in _FACTORS},
}
ROD_KEYS = {
    "length": "rod.length_mm",
    "radius": "rod.radius_mm",
    "inner_radius": "rod.inner_radius_mm",
    "area": "rod.area_mm2",
    "ix": "rod.ix_mm4",
    "iy": "rod.iy_mm4",
    "j": "rod.j_mm4",
    "precurvature": "rod.precurvature_per_m",
    **MATERIAL_KEYS,
}
TAPERED_KEYS = {
    "length": "tapered_rod.length_mm",
    "base_radius": "tapered_rod.base_radius_mm",
    "tip_radius": "tapered_rod.tip_radius_mm",
    "base_inner_radius": "tapered_rod.base_inner_radius_mm",
    "tip_inner_radius": "tapered_rod.tip_inner_radius_mm",
    "precurvature": "tapered_rod.precurvature_per_m",
    **MATERIAL_KEYS,
}
TENDON_KEYS = {
    "routing": "routing",
    "radius": "radius_mm",
    "x": "x_mm",
    "y": "y_mm",
    "offset": "offset_mm",
    "angle": "angle_deg",
    "turns": "turns",
    "s": "s_mm",
    "end": "end_mm",
    "friction": "friction",
    "axial_stiffness": "axial_stiffness_n",
    "free_length": "free_length_mm",
    "wall": "wall",
}
_OPTIONAL_OF_TENDON = ("end", "axial_stiffness", "wall")


def body_keys(body: Body) -> dict[str, str]:
    """Flat name of each value of ``body`` -> its key in a robot file, "segments[0].rod.length_mm" for segments."""
    if isinstance(body, NotchedTube):
        return dict(TUBE_KEYS)
    if isinstance(body, TaperedRod):
        return dict(TAPERED_KEYS)
    if not isinstance(body, Segments):
        return dict(ROD_KEYS)
    keys = {}
    for k, segment in enumerate(body.segments):
        keys |= {_of_segment(k, name): f"segments[{k}].{key}" for name, key in body_keys(segment).items()}
        keys[_of_segment(k, "angle")] = f"segments[{k}].angle_deg"
    return keys


def body_numbers(body: Body) -> dict[str, float]:
    """Every number of ``body`` by flat SI name."""
    if isinstance(body, Segments):
        numbers = {}
        for k, segment in enumerate(body.segments):
            numbers |= {_of_segment(k, name): value for name, value in body_numbers(segment).items()}
            if k > 0 and body.angles is not None:
                numbers[_of_segment(k, "angle")] = body.angles[k - 1]
        return numbers
    numbers = {each.name: getattr(body, each.name) for each in dataclasses.fields(body)}
    numbers = {name: value for name, value in numbers.items() if isinstance(value, float)}
    if isinstance(body, NotchedTube):
        return numbers | _factor_numbers(body.stiffness_factors)
    return numbers | dict(zip(_PRECURVATURE, body.precurvature, strict=True))


def file_values(body: Body, tendons: tuple[Tendon, ...]) -> dict[str, object]:
    """Key in a robot file -> value in SI units, of all that such a file would have to say; no defaults of tendons."""
    chain = body.segments if isinstance(body, Segments) else (body,)
    values = body_numbers(body)
    for k, each in enumerate(chain):
        prefix = _of_segment(k, "") if isinstance(body, Segments) else ""
        values |= {prefix + name: getattr(each, name) for name in ("torsion", "precurvature") if hasattr(each, name)}
    found: dict[str, object] = {key: values[name] for name, key in body_keys(body).items() if name in values}
    for i, tendon in enumerate(tendons):
        for each in dataclasses.fields(tendon):
            value = getattr(tendon, each.name)
            if each.name == "radius" or value != each.default:
                found[f"tendons[{i}].{TENDON_KEYS[each.name]}"] = value
    return found


def replaceable(body: Body) -> list[str]:
    """Names that `changed_body` takes: the numbers, and what is no number or may be missing."""
    if isinstance(body, Segments):
        names = [_of_segment(k, name) for k, segment in enumerate(body.segments) for name in replaceable(segment)]
        return names + [_of_segment(k, "angle") for k in range(1, len(body.segments))]
    more = ["precurvature"]
    if isinstance(body, NotchedTube):
        more = ["torsion", "stiffness_factors", *(f"{name}_factor" for name in _FACTORS)]
    return list(dict.fromkeys([*body_numbers(body), *more]))


def changed_body(body: Body, changes: Mapping[str, object]) -> Body:
    """``body`` with the changes that bear one of its `replaceable` names."""
    if not isinstance(body, Segments):
        return _changed_segment(body, changes)
    segments = []
    for k, segment in enumerate(body.segments):
        prefix = _of_segment(k, "")
        own = {name.removeprefix(prefix): value for name, value in changes.items() if name.startswith(prefix)}
        with _prefixed(prefix):
            segments.append(_changed_segment(segment, own))
    angles = [changes.get(_of_segment(k + 1, "angle"), angle) for k, angle in enumerate(body.angles or ())]
    return Segments(segments=tuple(segments), angles=tuple(angles))  # pyright: ignore[reportArgumentType]


def _changed_segment(body: Segment, changes: Mapping[str, object]) -> Segment:
    own = {each.name for each in dataclasses.fields(body)}
    direct = {name: value for name, value in changes.items() if name in own}
    if not isinstance(body, NotchedTube):
        if any(name in changes for name in _PRECURVATURE):
            current = vector("precurvature", direct.get("precurvature", body.precurvature), 3)
            entries = zip(_PRECURVATURE, current.tolist(), strict=True)
            direct["precurvature"] = tuple(changes.get(name, value) for name, value in entries)
    elif any(f"{name}_factor" in changes for name in _FACTORS):
        given = _factor_numbers(direct.get("stiffness_factors", body.stiffness_factors)) | changes  # pyright: ignore
        direct["stiffness_factors"] = StiffnessFactors(
            **{name: given.get(f"{name}_factor", MISSING) for name in _FACTORS}  # pyright: ignore[reportArgumentType]
        )
    return dataclasses.replace(body, **direct)


def tendon_numbers(tendons: tuple[Tendon, ...]) -> dict[str, float]:
    """Every number of the tendons by flat SI name, without the points of sampled ones."""
    values = {name: getattr(tendons[i], own) for name, (i, own) in tendon_names(tendons).items()}
    return {name: value for name, value in values.items() if isinstance(value, float)}


def tendon_names(tendons: tuple[Tendon, ...]) -> dict[str, tuple[int, str]]:
    """Flat name of what may be replaced -> (tendon, its field): what is given, and what may be missing."""
    names = {}
    for i, tendon in enumerate(tendons):
        prefix = "tendon_" if len(tendons) == 1 else f"tendon{i + 1}_"
        for name in TENDON_KEYS:
            if isinstance(getattr(tendon, name), float) or name in _OPTIONAL_OF_TENDON:
                names[prefix + name] = i, name
    return names


def changed_tendons(tendons: tuple[Tendon, ...], changes: Mapping[str, object]) -> tuple[Tendon, ...]:
    """``tendons`` with the changes that bear one of their names."""
    own: dict[int, dict[str, object]] = {}
    for flat, (i, name) in tendon_names(tendons).items():
        if flat in changes:
            own.setdefault(i, {})[name] = changes[flat]
    changed = list(tendons)
    for i, values in own.items():
        with _prefixed("tendon_" if len(tendons) == 1 else f"tendon{i + 1}_"):
            changed[i] = dataclasses.replace(tendons[i], **values)
    return tuple(changed)


def stale_sources(body: Body, tendons: tuple[Tendon, ...], changes: Mapping[str, object]) -> tuple[str, ...]:
    """Beginnings of the robot file's keys whose numbers ``changes`` replace."""
    keys = {"name": "name", "tendons": "tendons["} | body_keys(body)
    keys |= {flat: f"tendons[{i}].{TENDON_KEYS[name]}" for flat, (i, name) in tendon_names(tendons).items()}
    stale = []
    for name in changes:
        key = keys.get(name) or keys.get(name.rpartition("_")[0])  # precurvature_x stands in a vector
        if key is None:  # stiffness_factors: all four
            key = keys[name.replace("stiffness_factors", "axial_factor")].rpartition(".")[0]
        stale += [key, key.partition("].")[2]] if ".material." in key else [key]  # segments may share a material
    return tuple(stale)


def _of_segment(k: int, name: str) -> str:
    return f"segment{k + 1}_{name}"


def _factor_numbers(factors: StiffnessFactors | None) -> dict[str, float]:
    return {} if factors is None else {f"{name}_factor": getattr(factors, name) for name in _FACTORS}


@contextmanager
def _prefixed(prefix: str) -> Iterator[None]:
    try:
        yield
    except InvalidInput as error:
        raise InvalidInput(prefix + error.field, error.value, error.allowed) from None
