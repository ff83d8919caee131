"""Which trackers a file has and where they sit: as the caller says, else the column map, else the titles of columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ..errors import Fact, InvalidInput
from ..robot import Robot
from .columnmap import ColumnMap
from .columns import Columns
from .trial import BASE, ROBOT, Tracker

Places = Mapping[str, "Place"]


@dataclass(frozen=True, kw_only=True)
class Place:
    """on: "robot" or "base". at: s_m (m) along the neutral axis from the robot's base; or share: of L_na, 0 to 1.

    The tip where neither is given.
    """

    on: str = ROBOT
    at: float | None = None
    share: float | None = None

    def of(self, tracker: Tracker, robot: Robot) -> Tracker:
        """``tracker`` here; its holder, its mass and all else stay. Raises `InvalidInput` beyond the tip."""
        length = robot.length_na
        at = self.at if self.share is None else self.share * length
        if at is not None and not 0.0 <= at <= length * (1.0 + 1e-9):
            allowed = f"on the robot: from 0 to L_na = {1e3 * length:.6g} mm"
            raise InvalidInput("places", Fact(f"{tracker.name} at {1e3 * at:.6g} mm"), allowed)
        return replace(tracker, on=self.on, at=at)


def moved(trackers: Sequence[Tracker], places: Places, robot: Robot, where: str) -> tuple[Tracker, ...]:
    """``trackers``, those in ``places`` at these. Raises `InvalidInput` for a name that ``where`` does not have."""
    names = [each.name for each in trackers]
    unknown = next((name for name in places if name not in names), None)
    if unknown is not None:
        raise InvalidInput("places", Fact(unknown), f"a tracker of {where}: {', '.join(names)}")
    return tuple(places[each.name].of(each, robot) if each.name in places else each for each in trackers)


def placed(given: ColumnMap, robot: Robot) -> tuple[Tracker, ...]:
    """The trackers of the map, shares of L_na made lengths."""
    at = {name: share * robot.length_na for name, share in given.shares.items()}
    return tuple(replace(each, at=at[each.name]) if each.name in at else each for each in given.trackers)


def of_columns(columns: Columns, robot: Robot, places: Places) -> tuple[Tracker, ...]:
    """The map's trackers and those of ``places``, for which there must be columns; without any, those of the titles."""
    own = placed(columns.given, robot)
    if not own and not places:
        return _told(columns)
    if not own and BASE not in places and BASE in _measured(columns):
        own = (Tracker(name=BASE, on=BASE),)
    new = [Tracker(name=name) for name in places if name not in {each.name for each in own}]
    return moved([*own, *new], places, robot, columns.sheet.name)


def _measured(columns: Columns) -> list[str]:
    """Names whose columns NAME_x, NAME_y, NAME_z are there."""
    names = [name for name, _ in columns.parsed]
    found = [name.removesuffix("_x") for name in names if name.endswith("_x")]
    return [name for name in dict.fromkeys(found) if {f"{name}_y", f"{name}_z"} <= set(names)]


def _told(columns: Columns) -> tuple[Tracker, ...]:
    """Trackers by the titles of their columns."""
    found = _measured(columns)
    riding = [name for name in found if name != BASE]
    if not found:
        raise columns.needed("tip_x")
    if len(riding) > 1:
        allowed = "told where they sit, by [[trackers]] of a column map or by --tracker"
        raise InvalidInput(f"{columns.sheet.name}: trackers", Fact(", ".join(found)), allowed)
    return tuple(Tracker(name=name, on=BASE) if name == BASE else Tracker(name=name) for name in found)
