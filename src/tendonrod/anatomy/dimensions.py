"""The numbers of a spine, each with its levels and its source; interpolated between levels, scaled to a patient.

Values are in millimetres, as in the sources; `Dimensions.at` gives metres. A source that begins with "(m)" is from
memory of the literature, plausible and no more; one that begins with "choice" is this package's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from ..errors import Fact, InvalidInput, within
from .levels import PLACES

FROSTELL = "Frostell 2016, doi 10.3389/fneur.2016.00238"
CT = "CT, n = 83, 20-29 years, mean"
CANAL_CORD = "cord to canal, transverse: 0.64 at C4-5, 0.55 at T1, with the cord's width"
DRG = "PMC4337191: ganglia 3.2-6.5 mm wide, growing L1 to L5; centre in the medial foramen L1-4, lateral at L5"
MEMORY = "(m) textbook anatomy, from memory"
CHOICE = "choice of this package"
LEAST, MOST = 0.4, 2.5  # allowed scale of a patient; and of a number, relative to this table


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One length of the spine, mm: values at some levels; between them it is interpolated, beyond them it stays."""

    meaning: str
    values: Mapping[str, float]
    source: str

    def at(self, place: np.ndarray | float) -> np.ndarray:
        """mm at a place counted in levels from C3 = 0."""
        anchors = sorted((PLACES[name], value) for name, value in self.values.items())
        return np.interp(place, *np.array(anchors).T)


def _of(meaning: str, source: str, **values: float) -> Quantity:
    return Quantity(meaning=meaning, source=source, values=values)


QUANTITIES = MappingProxyType(
    {
        "cord_width": _of(
            "spinal cord, transverse", f"{FROSTELL}; the L3 segment is taken to lie at T12", C5=13.3, T8=8.3, T12=9.4
        ),
        "cord_depth": _of(
            "spinal cord, anteroposterior", f"{FROSTELL}; T12: (m) the lumbar enlargement", C5=7.4, T8=6.3, T12=7.0
        ),
        "canal_depth": _of(
            "bony canal, anteroposterior",
            CT,
            C3=14.6,
            C5=14.5,
            T1=16.1,
            T8=14.6,
            T12=16.7,
            L1=16.7,
            L3=15.7,
            S1=17.4,
        ),
        "canal_width": _of(
            "bony canal, transverse",
            f"C5, T1: {CANAL_CORD}; others {MEMORY}",
            C5=20.8,
            T1=21.4,
            T8=17.2,
            T12=22.0,
            L3=24.0,
        ),
        "csf_dorsal": _of(
            "dura to cord, dorsal",
            "Holsheimer 1994; Park 2016: T5/6 4.2 +- 1.4, T11/12 2.5 +- 0.9",
            C5=2.7,
            T5=4.2,
            T6=4.2,
            T11=2.5,
            T12=2.5,
        ),
        "epidural_dorsal": _of(
            "dura to the canal's wall, dorsal",
            "(m) cervical 1-2, L2-3 5-6; T8: what the canal leaves",
            C5=1.5,
            T8=2.5,
            T12=4.0,
            L2=5.0,
            L3=5.5,
        ),
        "epidural_ventral": _of("dura to the canal's wall, ventral", "(m) 1-2", T8=1.5),
        "epidural_lateral": _of(
            "dura to the canal's wall, on either side", "(m) 1-2, more in a wide canal", T8=1.5, L2=2.0
        ),
        "cord_offset": _of("cord off the midline, towards +y", "Holsheimer 1994: up to 2 in 40 %; default 0", T8=0.0),
        "body_height": _of(
            "vertebral body", "(m) 20-27 thoracic to lumbar, cervical 14", C3=14, C7=14, T1=18, T8=21, L5=27
        ),
        "disc_height": _of("disc", "(m) 4-10", C3=5, T1=4, T8=5, T12=7, L4=10, L5=10),
        "body_width": _of("vertebral body, transverse", MEMORY, C5=17, T1=27, T8=29, T12=39, L2=44, L5=50),
        "body_depth": _of("vertebral body, anteroposterior", MEMORY, C5=15, T1=17, T8=27, T12=31, L2=34, L5=35),
        "lamina": _of("lamina, thickness", MEMORY, C5=3.0, T8=6.0, L2=6.5),
        "spinous_length": _of("spinous process, dorsal of the lamina", MEMORY, C5=10, T1=25, T8=22, L2=26),
        "spinous_drop": _of("tip of the spinous process below its root", MEMORY, C5=4, T6=22, T8=20, T12=10, L2=5),
        "transverse_length": _of(
            "transverse process, lateral of the pedicle", MEMORY, C5=8, T1=22, T8=18, T12=8, L2=22
        ),
        "window_height": _of("interlaminar window, along the spine", MEMORY, C5=6, T8=8, T12=10, L2=12),
        "window_width": _of("interlaminar window, transverse", MEMORY, C5=14, T8=10, T12=13, L2=16),
        "foramen_height": _of("foramen, along the spine", MEMORY, C5=8, T8=11, L2=16),
        "foramen_depth": _of("foramen, anteroposterior", MEMORY, C5=6, T8=8, L2=9),
        "ligament": _of("ligamentum flavum, thickness", MEMORY, C5=2, T8=3, L2=4),
        "ganglion_width": _of("dorsal root ganglion", f"{DRG}; above L1: (m) as L1", L1=3.2, L5=6.5),
        "ganglion_length": _of("dorsal root ganglion, along the root", "(m) 1.6 of its width", L1=5.1, L5=10.4),
        "ganglion_inside": _of(
            "centre of the ganglion, lateral of the canal's wall", f"{DRG}; the depth: {CHOICE}", C5=2.0, L4=2.0, L5=5.0
        ),
        "root_width": _of("nerve root", MEMORY, C5=2.0, T8=1.6, L2=2.5),
        "conus_taper": _of(
            "length over which the cord ends", "(m) conus medullaris, its tip at the disc L1-2", T8=25.0
        ),
        "filum_width": _of("filum terminale", "(m)", T8=1.5),
        "printed_wall": _of("wall of the printed canal, at its thinnest", f"{CHOICE}: stiff and printable", T8=4.0),
        "lead_gap": _of(
            "axis of the robot at a target to the cord (printed)", f"{CHOICE}: a lead of 1.3 mm, 0.35 mm off", T8=1.0
        ),
        "tolerance": _of("of a target", f"{CHOICE}: half of a 3 mm contact of a percutaneous lead (m)", T8=1.5),
    }
)
SCALES = MappingProxyType(
    {  # what a patient's few numbers multiply
        "cord_width": ("cord_width",),
        "cord_depth": ("cord_depth",),
        "canal_width": ("canal_width",),
        "canal_depth": ("canal_depth",),
        "epidural": ("epidural_dorsal", "epidural_ventral", "epidural_lateral"),
        "height": ("body_height", "disc_height", "window_height", "foramen_height", "conus_taper"),
    }
)
SIGNED = {"cord_offset": 2.0}  # mm to either side; all others are positive


@dataclass(frozen=True, kw_only=True)
class Dimensions:
    """The table, scaled to a patient: ``scale`` by the names of `SCALES`, ``numbers`` (mm) by those of `QUANTITIES`.

    A number is one value for all levels or a value by level, and is not scaled. Raises `InvalidInput`.
    """

    scale: Mapping[str, float] = field(default_factory=dict)
    numbers: Mapping[str, float | Mapping[str, float]] = field(default_factory=dict)
    sources_of_numbers: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, value in self.scale.items():
            if name not in SCALES:
                raise InvalidInput(f"scale.{name}", value, f"left out, or under one of the names {', '.join(SCALES)}")
            within(f"scale.{name}", value, LEAST, MOST)
        for name, value in self.numbers.items():
            if name not in QUANTITIES:
                raise InvalidInput(f"numbers.{name}_mm", value, f"one of the numbers {_keys()}")
            _check_number(name, value)

    def at(self, name: str, place: np.ndarray | float) -> np.ndarray:
        """Quantity ``name`` at a place counted in levels from C3 = 0, m."""
        return 1e-3 * self.quantity(name).at(place)

    def of(self, name: str, level: str) -> float:
        """Quantity ``name`` at a level, m."""
        return float(self.at(name, PLACES[level]))

    def quantity(self, name: str) -> Quantity:
        """The quantity as this patient has it, mm."""
        base = QUANTITIES[name]
        if name in self.numbers:
            given = self.numbers[name]
            values = dict(given) if isinstance(given, Mapping) else dict.fromkeys(base.values, given)
            source = self.sources_of_numbers.get(name, "given")
            return Quantity(meaning=base.meaning, values=values, source=source)
        factors = [self.scale[each] for each, names in SCALES.items() if name in names and each in self.scale]
        if not factors:
            return base
        scaled = {level: factors[0] * value for level, value in base.values.items()}
        return Quantity(meaning=base.meaning, values=scaled, source=f"{factors[0]:g} of: {base.source}")


def _check_number(name: str, value: object) -> None:
    base = QUANTITIES[name]
    by_level = value if isinstance(value, Mapping) else {"": value}
    if not by_level:
        raise InvalidInput(f"numbers.{name}_mm", Fact("empty"), "a number, or numbers by level as {T8 = 6.3}")
    low, high = LEAST * min(base.values.values()), MOST * max(base.values.values())
    if name in SIGNED:
        low, high = -SIGNED[name], SIGNED[name]
    for level, each in by_level.items():
        if level and level not in PLACES:
            raise InvalidInput(f"numbers.{name}_mm.{level}", each, "under a level, C3 to S1")
        within(f"numbers.{name}_mm" + (f".{level}" if level else ""), each, low, high)


def _keys() -> str:
    return ", ".join(f"{name}_mm" for name in QUANTITIES)
