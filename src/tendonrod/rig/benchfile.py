"""Reading bench files: which bench, virtual or of devices, and its numbers; TOML with units in its keys, SI inside.

Like `robotfile`, whose checks it shares: types by key here, ranges by the domain classes, in the words of the file.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf
from os import PathLike, fspath
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ..errors import MISSING, InvalidInput, one_of, positive, vector, whole
from ..files import text_of
from ..measurement.trial import Tracker
from ..robot import Robot
from ..robotfile import validated
from ..robotfile_words import at, in_file_words, parsed
from ..rotation import exp_so3
from .aurora import check_options as check_aurora
from .aurora_tools import checked_tools
from .benches import BenchSource, DeviceSource, VirtualSource
from .benchfile_tables import KINDS, DeviceFile, VirtualFile
from .benchfile_units import flat, from_si, in_unit, to_si
from .board_devices import Calibration
from .launchpad import check_options as check_launchpad
from .limits import AXES, Limits
from .tension_watch import SATURATED
from .virtual.injection import Injection, InjectionKind
from .virtual.setup import (
    LoadCellModel,
    TrackerModel,
    VirtualSetup,
    lead_screw,
    roller_rotation,
    roller_translation,
)

SHAPE = '[bench] with kind = "virtual" or "devices", and the tables of that kind'
LISTED = ("fault", "tool")  # tables of which there may be several
Gravity = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class BenchFile:
    """A bench file whose types and keys are right. gravity: m/s2, None where it does not say."""

    name: str
    table: Any

    @property
    def is_virtual(self) -> bool:
        """Whether its bench is."""
        return isinstance(self.table, VirtualFile)

    @property
    def gravity(self) -> Gravity | None:
        """m/s2, world frame; None where the file does not say."""
        given = self.table.bench.gravity_m_s2
        return None if given is None else _three(vector(f"{self.name}: bench.gravity_m_s2", given, 3))

    def source(self, robot: Robot, gravity: Gravity, real_time: bool = False) -> BenchSource:
        """The bench with ``robot``. Raises `InvalidInput` by key."""
        limits = self._limits()
        if self.is_virtual:
            setup = self._setup(robot, gravity)
            self._check_travel(setup)
            found = VirtualSource(setup=setup, real_time=real_time, limits=limits)
        else:
            found = self._devices(robot, gravity, limits)
        self._check_tension()
        return found

    def check_homing(self) -> None:
        """An axis that finds its reference stands at 0 then. Raises `InvalidInput` where that is beyond its travel."""
        for _, key, over in self._travels():
            low, high = self._si(key)
            if not low - over <= 0.0 <= high + over:
                allowed = "a travel with 0 in it, where the axis stands when it is homed"
                raise InvalidInput(f"{self.name}: {key}", at(self.table, key), allowed)

    def _setup(self, robot: Robot, gravity: Gravity) -> VirtualSetup:
        axes = {"screw": lead_screw, "translation": roller_translation, "rotation": roller_rotation}
        parts: dict[str, Any] = {name: self._made(make, name) for name, make in axes.items()}
        parts["load_cell"] = self._made(LoadCellModel, "load_cell")
        sensor = self._made(TrackerModel, "tracker")
        if self.table.field is not None:
            sensor = replace(sensor, T_world_field=self._field())
        parts["tracker"] = sensor if self.table.bench.tracker else None
        parts["injections"] = tuple(self._injection(k) for k in range(len(self.table.fault or ())))
        keys = {f"tendon_{flat}": key for flat, key in self._keys("tendon").items()}
        keys |= {"slack": keys.pop("tendon_slack")}
        keys |= {"outer_friction": "outer_tube.friction_n", "exit_tilt": "outer_tube.tilt_deg"}
        bench = self._keys("bench")
        keys |= {flat: bench[flat] for flat in ("mechanics", "command_timeout", "highest_tension")}
        return self._called(VirtualSetup, keys, robot=robot, gravity=gravity, **parts)

    def _injection(self, k: int) -> Injection:
        """A [[fault]]; which value it takes goes with its kind and place."""
        table, keys = self.table.fault[k], self._keys(f"fault[{k}]")
        keys.pop("value")
        wanted = _value_key(one_of(f"{self.name}: fault[{k}].kind", table.kind, list(InjectionKind)), table.where)
        for key in (each for each in type(table).model_fields if each.startswith("value_") and each != wanted):
            if (given := getattr(table, key)) is not None:
                takes = f"takes {wanted}" if wanted else "takes no value"
                raise InvalidInput(f"{self.name}: fault[{k}].{key}", given, f"left out: {table.kind!r} {takes}")
        return self._called(Injection, keys | ({"value": f"fault[{k}].{wanted}"} if wanted else {}))

    def _devices(self, robot: Robot, gravity: Gravity, limits: Mapping[str, Any]) -> DeviceSource:
        table: DeviceFile = self.table
        cell = self._keys("load_cell")
        readings = whole(f"{self.name}: load_cell.tare_readings", table.load_cell.tare_readings, 0, 100_000)
        trackers = tuple(self._made(Tracker, f"tool[{k}]", leave=("rom",)) for k in range(len(table.tool or ())))
        if table.aurora is not None and not trackers:
            raise InvalidInput(f"{self.name}: tool", MISSING, "given, [[tool]] for each tool of the [aurora]")
        if table.aurora is None and trackers:
            raise InvalidInput(f"{self.name}: aurora", MISSING, "given where there is a [[tool]]")
        self._called(check_launchpad, self._keys("launchpad"))
        return DeviceSource(
            robot=robot, gravity=gravity, limits=limits, trackers=trackers, tare_readings=readings,
            launchpad=self._values("launchpad"), aurora=self._aurora(),
            calibration=self._called(Calibration, {key: cell[key] for key in cell if key != "tare_readings"}),
            T_world_field=None if table.field is None else self._field(),
        )  # fmt: skip

    def _aurora(self) -> dict[str, Any] | None:
        if self.table.aurora is None:
            return None
        self._called(check_aurora, self._keys("aurora"))
        names = [each.name for each in self.table.tool or ()]
        if len(set(names)) < len(names):
            raise InvalidInput(f"{self.name}: tool", names, "of different names")
        folder = Path(self.name).parent
        roms = {each.name: None if each.rom is None else str(folder / each.rom) for each in self.table.tool or ()}
        try:
            return self._values("aurora") | {"tools": checked_tools(roms)}
        except InvalidInput as error:
            raise InvalidInput(f"{self.name}: tool: rom", error.value, error.allowed) from None

    def _field(self) -> tuple[tuple[float, ...], ...]:
        """T_world_field as rows."""
        T = np.eye(4)
        T[:3, :3] = exp_so3(np.array(self._three("field.rotation_deg")))
        T[:3, 3] = self._three("field.position_mm")
        return tuple(tuple(row) for row in T.tolist())

    def _three(self, key: str) -> Gravity:
        if at(self.table, key) is None:
            return 0.0, 0.0, 0.0
        vector(f"{self.name}: {key}", at(self.table, key), 3)
        return _three(self._si(key))

    def _limits(self) -> Mapping[str, Any]:
        """Fields of `Limits`, looked at beside the defaults of the others; the model's come later.

        Where only the screw's speed is given, and is below the default of the release, it releases at that speed.
        """
        keys = self._keys("limits")
        axes = {name: self._axis_limits(name, keys) for name in AXES}
        speed, default = axes["screw"].get("speed", inf), Limits().release_rate
        slower = {"release_rate": speed} if speed < default and self._si(keys["release_rate"]) is None else {}
        made = {name: replace(getattr(Limits(), name), **given) for name, given in axes.items()}
        self._called(Limits, keys, **made, **slower)
        return MappingProxyType(slower | self._given(keys) | {name: given for name, given in axes.items() if given})

    def _travels(self) -> Iterator[tuple[str, str, float]]:
        """(axis, key) of each travel that is given, and by how much (m or rad) it may be passed."""
        keys = self._keys("limits")
        for name, over in zip(AXES, Limits().overrun, strict=True):
            if at(self.table, key := keys[f"{name}_travel"]) is not None:
                yield name, key, over

    def _check_travel(self, setup: VirtualSetup) -> None:
        """A virtual axis must be able to move within the travel that it is limited to."""
        for name, key, _ in self._travels():
            (low, high), axis = self._si(key), getattr(setup, name)
            if not max(low, axis.low) < min(high, axis.high):
                low, high = (from_si(key, end) for end in (axis.low, axis.high))
                allowed = f"a travel that overlaps the axis' own, {low:.6g} to {high:.6g}"
                raise InvalidInput(f"{self.name}: {key}", at(self.table, key), allowed)

    def _check_tension(self) -> None:
        """A limit that the load cell cannot show would never be found to be passed."""
        given, scale = self.table.limits.tension_n, self.table.load_cell.full_scale_n
        most = SATURATED * (LoadCellModel().full_scale if scale is None else scale)
        if given is not None and not given < most:
            allowed = f"below {most:.4g} N, {100.0 * SATURATED:.0f} % of the load cell's full scale"
            raise InvalidInput(f"{self.name}: limits.tension_n", given, allowed)

    def _axis_limits(self, name: str, keys: dict[str, str]) -> dict[str, float]:
        """Fields of `AxisLimits` that the file gives; their keys are taken out of ``keys``."""
        travel, speed = keys.pop(f"{name}_travel"), keys.pop(f"{name}_speed")
        found: dict[str, float] = {}
        if at(self.table, travel) is not None:
            low, high = vector(f"{self.name}: {travel}", at(self.table, travel), 2).tolist()
            if not low < high:
                raise InvalidInput(f"{self.name}: {travel}", [low, high], "its low end below its high end")
            found["low"], found["high"] = self._si(travel)
        if at(self.table, speed) is not None:
            positive(f"{self.name}: {speed}", at(self.table, speed))
            found["speed"] = self._si(speed)
        return found

    def _made(self, make: Callable[..., Any], place: str, leave: tuple[str, ...] = ()) -> Any:
        return self._called(make, {flat: key for flat, key in self._keys(place).items() if flat not in leave})

    def _called(self, make: Callable[..., Any], keys: dict[str, str], **more: Any) -> Any:
        """``make`` with the values of ``keys``, those that the file gives; its complaint in the words of the file."""
        try:
            return make(**more, **self._given(keys))
        except InvalidInput as error:
            if error.field not in keys:
                raise
            multiplied = re.findall(r"\* (\w+) =", error.allowed)  # what follows is the product, not the key's value
            named = {flat: key for flat, key in keys.items() if flat not in multiplied}
            said = in_file_words(self.name, error, self.table, named)
            allowed = in_unit(keys[error.field], said.allowed).replace(" = None", "")  # a key that is left out
            raise InvalidInput(said.field, said.value, allowed) from None

    def _values(self, place: str) -> dict[str, Any]:
        return self._given(self._keys(place))

    def _given(self, keys: dict[str, str]) -> dict[str, Any]:
        values = {flat: self._si(key) for flat, key in keys.items()}
        return {flat: value for flat, value in values.items() if value is not None}

    def _keys(self, place: str) -> dict[str, str]:
        """Name in the domain -> key in the file, of one table."""
        return {flat(key): f"{place}.{key}" for key in type(at(self.table, place)).model_fields}

    def _si(self, key: str) -> Any:
        return to_si(key, at(self.table, key))


def read_bench(source: str | PathLike[str], field: str = "bench file") -> BenchFile:
    """The bench file. Raises `InvalidInput` that names the file, the key, the value and what is allowed.

    field: what the file is called in the error of one that cannot be read.
    """
    name = fspath(source)
    document = parsed(name, text_of(field, name, "TOML"), SHAPE)
    bench = document.get("bench")
    if not isinstance(bench, dict):
        raise InvalidInput(f"{name}: bench", MISSING if bench is None else bench, "a table, [bench]")
    if "kind" not in bench:
        raise InvalidInput(f"{name}: bench.kind", MISSING, "one of " + ", ".join(KINDS))
    kind = one_of(f"{name}: bench.kind", bench["kind"], KINDS)
    checked = validated(name, KINDS[kind], document, expected=_expected)
    return BenchFile(name=name, table=checked)


def default_bench() -> BenchFile:
    """The virtual bench with all its defaults."""
    return BenchFile(name="virtual bench", table=validated("", VirtualFile, {"bench": {"kind": "virtual"}}))


def _value_key(kind: str, where: str | None) -> str:
    """The key of the value that a fault of this kind takes, "" for none."""
    length = "deg" if where == "rotation" else "mm"
    units = {InjectionKind.CELL_JUMP: "n", InjectionKind.CLOCK_LATE: "ms"}
    units |= {InjectionKind.ENCODER_JUMP: length, InjectionKind.RUNAWAY: f"{length}_s"}
    unit = units.get(InjectionKind(kind))
    return f"value_{unit}" if unit else ""


def _three(values: Any) -> Gravity:
    x, y, z = (float(each) for each in values)
    return x, y, z


_EXPECTED = {
    "string_type": "a text in quotes",
    "bool_type": "true or false",
    "int_type": "a whole number",
    "list_type": "a list of finite numbers",
    "model_type": "a table",
}


def _expected(error: Any) -> str:
    name = error["loc"][-1]
    if error["type"] == "list_type" and name in LISTED:
        return f"headed by two brackets, [[{name}]], once for each"
    return _EXPECTED.get(error["type"], "a finite number")
