"""Chapter: which tilts, masses and moduli would bring the paper's two model runs as far apart as Table I demands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from ..robot import Robot
from .admitted import region
from .causes import LARGEST_TILT, MODULI, Case, Gaps, bracket, largest_mass, modulus_gap
from .chapter import Cell, Chapter, Number, Picture, Table, interval, listed, mm, short, title_of
from .forensic_figure import forensic_figure
from .gravity import TENSIONS
from .results import Forensics, Gap, Region, Scan, positive

PRINTED, LADEN_TIP = "as printed", "mass at the tip"
CASES: Mapping[str, Case] = {
    PRINTED: Case(),
    "moduli × 0.6": Case(modulus=0.6),
    "moduli × 1.4": Case(modulus=1.4),
    LADEN_TIP: Case(at_tip=True),
    "homogenized torsion": Case(torsion="homogenized"),
}
TOWARDS, AWAY = "tilt towards gravity (deg)", "tilt away from gravity (deg)"
CARRIED, AT_TIP = "mass carried along (g)", "mass at the tip (g)"
BOTH_RUNS, ONE_RUN = "moduli in both runs (×)", "moduli in one run (×)"
_FINE = np.linspace(0.0, 1.0, 401)
PLACES = ("¼", "½", "¾", "1")
_DIGITS = {"deg)": 1, "g)": 2, "×)": 2}  # by the unit of a cause
_WORDS = {"deg)": "°", "g)": " g", "×)": " of the printed"}


def forensics(robot: Robot) -> Forensics:
    """Everything about one prototype."""
    limits, sides = bracket(robot.name), Gaps(robot, Case(), "sideways")
    laden = {name: Gaps(robot, case, "mass") for name, case in CASES.items()}
    return Forensics(
        name=robot.name,
        bracket=limits,
        scans=_scans(robot, limits, sides, laden),
        regions={name: region(gaps, limits) for name, gaps in laden.items()},
        sideways=region(sides, limits),
    )


def _scans(robot: Robot, limits: np.ndarray, sides: Gaps, laden: Mapping[str, Gaps]) -> dict[str, Scan]:
    none, angles, masses = np.zeros(1), LARGEST_TILT * _FINE, largest_mass(robot) * _FINE
    moduli = np.linspace(*MODULI, _FINE.size)
    causes = {
        TOWARDS: (np.degrees(angles), sides(angles, none)),
        AWAY: (np.degrees(angles), sides(-angles, none)),
        "tilt sideways to y (deg)": (np.degrees(angles), sides(none, angles)),
        "tilt sideways to −y (deg)": (np.degrees(angles), sides(none, -angles)),
        CARRIED: (1e3 * masses, laden[PRINTED](none, masses)),
        AT_TIP: (1e3 * masses, laden[LADEN_TIP](none, masses)),
        BOTH_RUNS: (moduli, modulus_gap(robot, moduli, in_both=True)),
        ONE_RUN: (moduli, modulus_gap(robot, moduli, in_both=False)),
    }
    return {name: _scan(values, gap, limits) for name, (values, gap) in causes.items()}


def _scan(values: np.ndarray, gap: Gap, limits: np.ndarray) -> Scan:
    margins, loose = gap.margins(limits).reshape(-1, 8), gap.margins_at_any_tensions(limits).reshape(-1, 8)
    return Scan(values=values, margins=margins, margins_at_any_tensions=loose)


def chapter(found: Sequence[Forensics]) -> Chapter:
    """Each cause alone, causes together, and the regions in tilt and mass."""
    third, fourth = (next(each for each in found if each.name == name) for name in ("exonav-3", "exonav-4"))
    tilts = {short(each.name): each.scans[TOWARDS].windows() for each in found}
    return Chapter(
        name="forensics",
        title="What would be enough for Table I",
        tables=(_alone_table(found), _together_table(found)),
        pictures=(Picture(name="enough", draw=partial(forensic_figure, found)),),
        facts={
            "enough": {title_of(each.name): _enough(each) for each in found},
            "tilts": listed(f"{windows(kept, 1)}° ({name})" for name, kept in tilts.items() if kept),
            "never": [short(each.name) for each in found if nearest(each) < 0.0],
            "missed": {title_of(each.name): mm(-nearest(each)) for each in found if nearest(each) < 0.0},
            "for_none": listed(_for_none(found)),
            "all_alike": common(list(tilts.values())),
            "places_3": listed(f"{windows(third.scans[TOWARDS].windows(k), 1)}°" for k in range(4)),
            "places_4": listed(f"{windows(fourth.scans[TOWARDS].windows(k), 1)}°" for k in range(4)),
            "range_matters": Number(max(range_matters(each) for each in found), 1),
            "tensions": TENSIONS.size,
            "largest": {
                "tilt": Number(np.degrees(LARGEST_TILT), 0),
                "mass": listed(_mass_ends(found)),
                "of_all": max(_mass_ends(found)),
            },
        },
    )


def _all(each: Forensics) -> list[Region]:
    return [*each.regions.values(), each.sideways]


def nearest(each: Forensics) -> float:
    """Margin (m) that all bounds can be kept by in any region of the chapter; negative where one is always missed."""
    return max(region.closest for region in _all(each))


def range_matters(each: Forensics) -> float:
    """Most (degrees) that the ends of tilt towards gravity move if the tensions are left open."""
    scan = each.scans[TOWARDS]
    pairs = zip(scan.windows(), scan.windows(any_tensions=True), strict=False)
    return max((float(np.abs(np.subtract(*pair)).max()) for pair in pairs), default=0.0)


def common(lists: Sequence[list[tuple[float, float]]]) -> bool:
    """Whether one value lies in an interval of every list."""
    ends = [low for intervals in lists for low, _ in intervals]
    return any(all(any(low <= end <= high for low, high in intervals) for intervals in lists) for end in ends)


def windows(intervals: Sequence[tuple[float, float]], digits: int, between: str = ",<br>") -> str:
    """Intervals as text, a dash for none."""
    return between.join(interval(ends, digits) for ends in intervals) or "—"


def _enough(each: Forensics) -> list[str]:
    """The causes that would do alone, in words."""
    kept = ((*_named(cause), scan.windows()) for cause, scan in each.scans.items())
    return [f"{name}, {windows(found, _DIGITS[unit], ' or ')}{_WORDS[unit]}" for name, unit, found in kept if found]


def _for_none(found: Sequence[Forensics]) -> list[str]:
    """The causes that would do for no prototype alone."""
    causes = [cause for cause in found[0].scans if not any(each.scans[cause].windows() for each in found)]
    return [_named(cause)[0] for cause in causes]


def _named(cause: str) -> tuple[str, str]:
    """Name, and what tells its unit."""
    name, _, unit = cause.partition(" (")
    return name, unit


def _mass_ends(found: Sequence[Forensics]) -> list[str]:
    return [f"{Number(each.scans[CARRIED].values[-1], 1)} g" for each in found]


def _alone_table(found: Sequence[Forensics]) -> Table:
    rows: list[list[Cell]] = []
    for each in found:
        for cause, scan in each.scans.items():
            digits = _DIGITS[_named(cause)[1]]
            places = [scan.windows(k) for k in (0, 1, 2, 3, None)]
            cells = [windows(kept, digits) for kept in (*places, scan.windows(any_tensions=True))]
            rows.append([title_of(each.name), cause.replace(" ", "\u00a0"), *cells])
    places = (f"{place} <i>L</i><sub>na</sub>" for place in PLACES)
    return Table(name="alone", header=("", "cause", *places, "all four", "all four, any tensions"), rows=rows)


def _together_table(found: Sequence[Forensics]) -> Table:
    rows = [
        [title_of(each.name), case.replace(" ", "\u00a0"), *_alone(region), *_pair(region), mm(region.closest)]
        for each in found
        for case, region in each.regions.items()
    ]
    return Table(
        name="together",
        header=(
            "",
            "runs solved with",
            "tilt alone, towards gravity (deg)",
            "away from it (deg)",
            "mass alone (g)",
            "least of both: tilt (deg)",
            "with mass (g)",
            "there held by",
            "all bounds kept by at most (mm)",
        ),
        rows=rows,
    )


def _alone(region: Region) -> list[Cell]:
    """Tilts without mass, and masses without tilt, that keep all bounds."""
    middle, degrees = region.tilts.size // 2, np.degrees(region.tilts[region.tilts.size // 2 :])
    scans = (
        (degrees, region.margins[middle:, 0], 1),
        (degrees, region.margins[middle::-1, 0], 1),
        (1e3 * region.values, region.margins[middle], 2),
    )
    return [windows(positive(x, margins), digits) for x, margins, digits in scans]


def _pair(region: Region) -> list[Cell]:
    """The least pair and the bound that it stands at."""
    if region.least is None or region.edge is None:
        return ["—", "—", "—"]
    tilt, mass = region.least
    return [Number(np.degrees(tilt), 1), Number(1e3 * mass, 2), bound_name(region.edge)]


def bound_name(edge: int) -> str:
    """Such as ¼, least: place and side of one of the eight bounds."""
    return f"{PLACES[edge % 4]}, {'least' if edge < 4 else 'most'}"
