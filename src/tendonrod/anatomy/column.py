"""A stretch of the spine as heights and cross-sections: where levels stand, how wide cord, dura and canal are there.

World: +x dorsal, +y the patient's right, +z cranial; x = y = 0 on the axis of the cord, z = 0 at the lower end plate of
the lowest vertebra. The stretch is straight: the curves of the spine are left out.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..errors import Fact, InvalidInput
from .dimensions import Dimensions
from .levels import PLACES, Level

BELOW = 13e-3  # m that a phantom goes on below its lowest end plate: foramen and window there are whole
RIM = 2e-3  # m that must be left below a window
STEP = 2e-3  # m between rings
LEAST_CSF = 0.2e-3  # m that must be left between cord and dura
CONUS = "L1"  # the cord's tip lies at the disc below it


@dataclass(frozen=True, kw_only=True)
class Ellipses:
    """Cross-sections at m heights: middle (m, 2) m, half axes ``depth`` (along x) and ``width`` (along y), (m,) m."""

    middle: np.ndarray
    depth: np.ndarray
    width: np.ndarray

    @property
    def dorsal(self) -> np.ndarray:
        """x of the dorsal vertex, (m,) m."""
        return self.middle[:, 0] + self.depth

    @property
    def ventral(self) -> np.ndarray:
        """x of the ventral vertex, (m,) m."""
        return self.middle[:, 0] - self.depth

    def width_at(self, x) -> np.ndarray:
        """Half width (m,) at x (m,) m, 0 beyond the vertices."""
        return self.width * np.sqrt(np.maximum(1.0 - ((x - self.middle[:, 0]) / self.depth) ** 2, 0.0))

    def grown(self, by: float) -> Ellipses:
        """With half axes longer ``by`` m."""
        return Ellipses(middle=self.middle, depth=self.depth + by, width=self.width + by)


@dataclass(frozen=True, kw_only=True)
class Column:
    """Levels ``names`` from the head down with their numbers.

    has_dura: the cord lies in a sac, which the dorsal layers of anatomy place in the canal, and ends at the conus;
    without it, as in a printed mock-up, it lies in the middle of the canal and runs through.
    """

    names: tuple[str, ...]
    numbers: Dimensions
    has_dura: bool
    levels: tuple[Level, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "levels", _stacked(self.names, self.numbers))
        if self.has_dura:
            _check_sac(self)
        else:
            _check_canal(self)

    @property
    def top(self) -> float:
        """z of the upper end plate of the highest vertebra, m."""
        return self.levels[0].z_high

    def level(self, name: str) -> Level:
        """The level of that name."""
        return self.levels[self.names.index(name)]

    def place(self, z) -> np.ndarray:
        """Heights z (m) counted in levels from C3 = 0, whole numbers at the middles of bodies.

        Beyond the phantom's ends it stays, so that what is built there goes on straight.
        """
        z = np.clip(z, -BELOW, self.top)
        middle = np.array([level.middle for level in self.levels[::-1]])
        places = np.array([float(PLACES[level.name]) for level in self.levels[::-1]])
        pitch = np.array([level.z_high - level.z_low + level.disc for level in self.levels[::-1]])
        middle = np.concatenate([[middle[0] - pitch[0]], middle, [middle[-1] + pitch[-1]]])
        return np.interp(z, middle, np.concatenate([[places[0] + 1], places, [places[-1] - 1]]))

    def at(self, name: str, z) -> np.ndarray:
        """A number of the table at heights z, m."""
        return self.numbers.at(name, self.place(z))

    def heights(self, low: float, high: float, step: float = STEP) -> np.ndarray:
        """Heights of rings from low to high."""
        return np.linspace(low, high, max(2, round((high - low) / step) + 1))

    def cord(self, z) -> Ellipses:
        """The cord; where there is a dura it ends at the conus, and the filum goes on."""
        z = np.asarray(z, dtype=float)
        depth, width = 0.5 * self.at("cord_depth", z), 0.5 * self.at("cord_width", z)
        if self.has_dura:
            share = np.clip(
                (np.clip(z, -BELOW, self.top) - self.conus_tip) / self.numbers.of("conus_taper", CONUS), 0.0, 1.0
            )
            round_off = np.sqrt(share * (2.0 - share))  # a quarter of an ellipse
            least = 0.5 * self.numbers.of("filum_width", CONUS)
            depth, width = np.maximum(depth * round_off, least), np.maximum(width * round_off, least)
        return Ellipses(middle=np.zeros((z.size, 2)), depth=depth, width=width)

    @property
    def conus_tip(self) -> float:
        """z of the cord's tip, m, far outside where the level of the conus lies beyond the stretch."""
        if CONUS in self.names:
            level = self.level(CONUS)
            return level.z_low - 0.5 * level.disc
        return -np.inf if PLACES[self.names[-1]] < PLACES[CONUS] else np.inf

    def canal(self, z) -> Ellipses:
        """The bony canal, between discs and laminae."""
        z = np.asarray(z, dtype=float)
        depth, width = self.at("canal_depth", z), self.at("canal_width", z)
        dorsal = 0.5 * depth
        if self.has_dura:
            dorsal = 0.5 * self.at("cord_depth", z) + self.at("csf_dorsal", z) + self.at("epidural_dorsal", z)
        middle = np.stack([dorsal - 0.5 * depth, -self.at("cord_offset", z)], axis=1)
        return Ellipses(middle=middle, depth=0.5 * depth, width=0.5 * width)

    def dura(self, z) -> Ellipses:
        """The sac, which keeps its gaps to the canal."""
        canal = self.canal(z)
        dorsal = canal.dorsal - self.at("epidural_dorsal", z)
        ventral = canal.ventral + self.at("epidural_ventral", z)
        middle = np.stack([0.5 * (dorsal + ventral), canal.middle[:, 1]], axis=1)
        width = canal.width_at(middle[:, 0]) - self.at("epidural_lateral", z)
        return Ellipses(middle=middle, depth=0.5 * (dorsal - ventral), width=width)

    def inner(self, z) -> Ellipses:
        """What the robot goes round: the dura, or the cord where there is none."""
        return self.dura(z) if self.has_dura else self.cord(z)

    def foramen(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Middle (3,) m of the foramen below the pedicle of a level, on the midline, and half its size in x and z."""
        level = self.level(name)
        half = 0.5 * np.array([self.numbers.of("foramen_depth", name), self.numbers.of("foramen_height", name)])
        z = level.z_low + 0.08 * (level.z_high - level.z_low)
        canal = self.canal([z])
        return np.array([canal.middle[0, 0] - 0.15 * canal.depth[0], canal.middle[0, 1], z]), half

    def has_window(self, name: str) -> bool:
        """Whether the phantom reaches down far enough for the interlaminar window below a level."""
        z, height, _ = self.window(name)
        return z - height > RIM - BELOW

    def window(self, name: str) -> tuple[float, float, float]:
        """Height z of the interlaminar window below the lamina of a level, and half its height and width, m."""
        level = self.level(name)
        height, width = self.numbers.of("window_height", name), self.numbers.of("window_width", name)
        return level.z_low - 0.5 * level.disc, 0.5 * height, 0.5 * width


def _stacked(names: tuple[str, ...], numbers: Dimensions) -> tuple[Level, ...]:
    """From the lowest up; the disc below a level is its own, and that below the lowest lies under z = 0."""
    levels, z = [], 0.0
    for name in reversed(names):
        disc, height = numbers.of("disc_height", name), numbers.of("body_height", name)
        z += disc if levels else 0.0
        levels.append(Level(name=name, z_low=z, z_high=z + height, disc=disc))
        z += height
    return tuple(reversed(levels))


def _check_canal(column: Column) -> None:
    z = np.array([level.middle for level in column.levels])
    canal, cord = column.canal(z), column.cord(z)
    offset = np.abs(column.at("cord_offset", z))
    for i, level in enumerate(column.levels):
        halves = (("depth", canal.depth[i] - cord.depth[i]), ("width", canal.width[i] - cord.width[i] - offset[i]))
        for which, gap in ((name, 2.0 * half) for name, half in halves):
            if gap <= 0.0:
                says = f"{1e3 * gap:.2f} mm at {level.name}"
                aside = " and twice cord_offset_mm" if which == "width" and offset[i] else ""
                field = f"canal_{which}_mm less cord_{which}_mm{aside}"
                raise InvalidInput(field, Fact(says), "> 0: a canal wider than the cord")


def _check_sac(column: Column) -> None:
    z = np.array([level.middle for level in column.levels])
    dura = column.dura(z)
    cord, offset = column.cord(z), column.at("cord_offset", z)
    around = 2.0 * np.pi * np.arange(72) / 72
    for i, level in enumerate(column.levels):
        x = (cord.depth[i] + LEAST_CSF) * np.cos(around) - dura.middle[i, 0]
        y = (cord.width[i] + LEAST_CSF) * np.sin(around) + offset[i]
        if (
            min(dura.depth[i], dura.width[i]) <= 0.0
            or np.max((x / dura.depth[i]) ** 2 + (y / dura.width[i]) ** 2) > 1.0
        ):
            said = f"{2e3 * dura.depth[i]:.2f} x {2e3 * dura.width[i]:.2f} mm at {level.name}"
            of = f"{2e3 * cord.depth[i]:.2f} x {2e3 * cord.width[i]:.2f} mm"
            allowed = f"room for the cord of {of} with {1e3 * LEAST_CSF:g} mm around: a wider canal or smaller gaps"
            raise InvalidInput("dural sac", Fact(said), allowed)
