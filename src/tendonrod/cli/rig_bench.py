"""The bench that the options of `tendonrod rig` name, and what is shown of it while it runs."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import Fact, InvalidInput, nonnegative, within
from . import output as out
from .arguments import bench_robot, number, vector, whole

if TYPE_CHECKING:
    from ..rig.benches import BenchSource
    from ..rig.benchfile import BenchFile
    from ..rig.live_tip import LiveTip
    from ..rig.loop import Watch
    from ..rig.safety import Interlock
    from .live import LiveView


PSEUDO_TERMINALS = ("/dev/pts/", "/dev/ttys")  # of Linux and macOS


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What was typed about the bench, each as text or None."""

    bench: str | None = None
    torsion: str | None = None
    gravity: str | None = None
    real_time: bool = False
    homed: bool = False
    seed: str = "0"
    rate: str = "200"
    tendon_friction: str | None = None
    outer_friction: str | None = None
    tracker_mass: str | None = None
    slicer: str | None = None
    rehearse: str | None = None


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """The bench and how it is to be run. file: what its numbers come from; robot and asked: as typed."""

    file: str
    robot: str
    asked: Asked
    source: BenchSource
    is_virtual: bool
    home: bool
    seed: int
    rate: float
    slicer: int | None

    @property
    def options(self) -> dict[str, Any]:
        """Arguments of `rig.trials.run`."""
        return {"rate": self.rate, "home": self.home, "around": keyboard}


def chosen(robot: str, asked: Asked) -> Chosen:
    """The bench that was asked for, with a warning where a mass hangs on it for nothing.

    Raises `InvalidInput`; nothing is opened yet.
    """
    seed, rate = whole("--seed", asked.seed, 0, 2**63 - 1), number("--rate-hz", asked.rate, within, 100.0, 1000.0)
    port = None if asked.slicer is None else whole("--slicer", asked.slicer, 1, 65535)
    pull = None if asked.gravity is None else vector("--gravity", asked.gravity)
    changes = _changes(asked)
    body = bench_robot(robot, asked.torsion)

    from ..rig.benchfile import default_bench, read_bench

    file = default_bench() if asked.bench is None else read_bench(asked.bench, "--bench")
    _fits(file, asked)
    from_file = file.gravity  # looked at also where it does not count
    source = _changed(file.source(body, pull or from_file or (0.0, 0.0, 0.0), asked.real_time), changes)
    source = source if asked.rehearse is None else _rehearsed(source, asked.rehearse)
    _warn_of_idle_mass(source)
    return Chosen(
        file=file.name, robot=robot, asked=asked, source=source, is_virtual=file.is_virtual, home=not asked.homed,
        seed=seed, rate=rate, slicer=port,
    )  # fmt: skip


def _rehearsed(source: Any, port: str) -> BenchSource:
    """On the emulated board. Raises `InvalidInput` for a port behind which there may be hardware."""
    from ..rig.benches import rehearsed

    if not str(Path(port).resolve()).startswith(PSEUDO_TERMINALS):
        allowed = "the pseudo-terminal that python -m tendonrod.rig.firmware prints; nothing else is surely no hardware"
        raise InvalidInput("--rehearse", Fact(port), allowed)
    return rehearsed(source, port)


def _warn_of_idle_mass(source: BenchSource) -> None:
    from ..rig.benches import loads_of

    if (mass := sum(each.mass for each in loads_of(source))) and not any(source.gravity):
        out.warn([f"{1e3 * mass:g} g hang on the robot, but without gravity they weigh nothing; give --gravity"])


def _changes(asked: Asked) -> dict[str, float]:
    typed = {
        "tendon_friction": ("--tendon-friction", asked.tendon_friction, 1.0),
        "outer_friction": ("--outer-friction-n", asked.outer_friction, 1.0),
        "mass": ("--tracker-mass-g", asked.tracker_mass, 1e-3),
    }
    given = {name: each for name, each in typed.items() if each[1] is not None}
    return {name: unit * number(option, str(text), nonnegative) for name, (option, text, unit) in given.items()}


def _fits(file: BenchFile, asked: Asked) -> None:
    """What only a virtual bench knows is not asked of devices, nor the other way round."""
    virtual = {"--tendon-friction": asked.tendon_friction, "--outer-friction-n": asked.outer_friction}
    virtual |= {"--tracker-mass-g": asked.tracker_mass, "--real-time": "given" if asked.real_time else None}
    for name, text in virtual.items():
        if text is not None and not file.is_virtual:
            raise InvalidInput(name, Fact(text), f"left out with the devices of {file.name}")
    if asked.rehearse is not None and file.is_virtual:
        raise InvalidInput("--rehearse", Fact(asked.rehearse), "left out with a virtual bench: it needs no hardware")
    if asked.homed and file.is_virtual:
        raise InvalidInput("--homed", Fact("given"), "left out with a virtual bench: it is switched on anew each time")


def _changed(source: Any, changes: dict[str, float]) -> BenchSource:
    if not changes:
        return source
    mass = changes.pop("mass", None)
    setup = replace(source.setup, **changes)
    if mass is not None:
        if setup.tracker is None:
            raise InvalidInput("--tracker-mass-g", 1e3 * mass, "left out: the bench file says tracker = false")
        setup = replace(setup, tracker=replace(setup.tracker, mass=mass))
    return replace(source, setup=setup)


def keyboard(interlock: Interlock) -> AbstractContextManager:
    """Keys of the terminal, where there is one: space and Esc stop."""
    from ..rig.emergency import KeyboardStop

    return KeyboardStop(interlock)


@contextmanager
def shown(place: Chosen, title: str = "", target: float | None = None) -> Iterator[LiveView]:
    """The live view, and 3D Slicer beside it where that was asked for; ``title``: of what comes.

    target: N, of the reference that the tip is to follow, None for no such.

    Raises `DeviceError` in one line where nothing can listen at the port, or pyigtl is missing.
    """
    from .live import LiveView

    tip = None if target is None else _tip(place, target)
    with _in_slicer(place) as also, LiveView(place.source.robot.length_na, also, tip) as view:
        if title:
            view.begin(title)
        yield view


def _tip(place: Chosen, target: float) -> LiveTip | None:
    """How far the tip is from its reference, where there is a tracker on it and its field's place is known."""
    from ..measurement.trial import ROBOT
    from ..rig.live_tip import LiveTip
    from ..rig.trials import reference_of

    source, field = place.source, place.source.known(place.seed).get("T_world_field")
    on_it = [each for each in source.trackers if each.on == ROBOT and each.at is None]
    if field is None or not on_it or place.asked.rehearse is not None:
        return None
    return LiveTip(reference_of(source.robot, target, source.gravity), on_it[0], field)


@contextmanager
def _in_slicer(place: Chosen) -> Iterator[Watch | None]:
    if place.slicer is None:
        yield None
        return
    from ..rig.benches import loads_of
    from ..rig.igtl import SlicerStream
    from ..rig.live_shape import LiveShape

    source = place.source
    given: dict[str, Any] = {"loads": loads_of(source), "tools": [each.name for each in source.trackers]}
    given["T_world_field"] = source.known(place.seed).get("T_world_field")
    with (
        SlicerStream(place.slicer) as stream,
        LiveShape(stream, source.robot, source.gravity, **given) as live,
    ):
        out.note(f"3D Slicer and others may connect by OpenIGTLink at localhost, port {stream.port}")
        yield live.watch
