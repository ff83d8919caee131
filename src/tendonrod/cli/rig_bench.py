"""Options that the commands of `tendonrod rig` share, and the bench that they name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, nonnegative, within
from . import output as out
from .arguments import bench_robot, number, vector, whole

if TYPE_CHECKING:
    from ..rig.benches import BenchSource
    from ..rig.benchfile import BenchFile
    from ..rig.loop import Outcome
    from ..rig.safety import Interlock
    from ..rig.trials import Performed


def option(metavar: str, text: str, *names: str) -> Any:
    """A typer option."""
    return typer.Option(*names, metavar=metavar, help=text)


Output = Annotated[str, option("DIR", "Write there; made if need be, and nothing in it is overwritten.", "--output")]
RobotOption = Annotated[str, option("ROBOT", "Preset, or path of a robot's TOML file.", "--robot")]
BenchGravity = Annotated[
    str | None, option("X,Y,Z", "Gravity, m/s2, world frame. Left out: the bench file's, else 0,0,0.", "--gravity")
]
BenchOption = Annotated[
    str | None, option("FILE.toml", "The bench, virtual or of devices. Left out: the virtual bench.", "--bench")
]
Seed = Annotated[str, option("WHOLE", "Of the virtual bench: the same seed, the same samples.", "--seed")]
RealTime = Annotated[bool, typer.Option("--real-time", help="The virtual bench in step with time, not faster.")]
Rate = Annotated[str, option("HZ", "Control periods per second, 100 to 1000.", "--rate-hz")]
BenchTorsion = Annotated[
    str | None,
    option("MODEL", "Of the robot. Left out: homogenized, where the robot has the factors.", "--torsion"),
]
TendonFriction = Annotated[
    str | None, option("MU", "Of the virtual bench's tendon in the tube. Left out: 0.1.", "--tendon-friction")
]
OuterFriction = Annotated[
    str | None, option("N", "Of the robot in the outer tube, virtual bench. Left out: 0.05.", "--outer-friction-n")
]
TrackerMass = Annotated[
    str | None, option("G", "Of sensor and holder at the tip, virtual bench. Left out: 0.", "--tracker-mass-g")
]
Homed = Annotated[bool, typer.Option("--homed", help="Devices: the axes know their references; do not home them.")]


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


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """The bench and how it is to be run."""

    source: BenchSource
    is_virtual: bool
    home: bool
    seed: int
    rate: float

    @property
    def options(self) -> dict[str, Any]:
        """Arguments of `rig.trials.run`."""
        return {"rate": self.rate, "home": self.home, "around": keyboard}


def chosen(robot: str, asked: Asked) -> Chosen:
    """The bench that was asked for. Raises `InvalidInput`; nothing is opened yet."""
    seed, rate = whole("--seed", asked.seed, 0, 2**63 - 1), number("--rate-hz", asked.rate, within, 100.0, 1000.0)
    pull = None if asked.gravity is None else vector("--gravity", asked.gravity)
    changes = _changes(asked)
    body = bench_robot(robot, asked.torsion)

    from ..rig.benchfile import default_bench, read_bench

    file = default_bench() if asked.bench is None else read_bench(asked.bench, "--bench")
    _fits(file, asked)
    source = file.source(body, pull or file.gravity or (0.0, 0.0, 0.0), asked.real_time)
    return Chosen(
        source=_changed(source, changes), is_virtual=file.is_virtual, home=not asked.homed, seed=seed, rate=rate
    )


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


def fresh(path: str, names: Sequence[str]) -> Path:
    """The directory ``path``, made if need be, in which none of ``names`` may be there yet."""
    found = out.directory("--output", path)
    there = [name for name in names if (found / name).exists()]
    if there:
        allowed = f"a directory without {there[0]}: nothing is overwritten; name another, or move away what is there"
        raise InvalidInput("--output", Fact(path), allowed)
    return found


def export_beside(done: Performed) -> Path | None:
    """The record's trial as .nc beside it, by frame of the tracker, or by period where it gave none; None if empty."""
    from ..rig.export import FRAMES, SAMPLES, export

    if not len(done.record.samples):
        return None
    path = done.path.with_suffix(".nc")
    with out.written("--output", path):
        export(done.record, path, at=FRAMES if len(done.record.frames) else SAMPLES)
    return path


def end(outcomes: Sequence[tuple[str, Outcome]], record: Callable[[int], str]) -> None:
    """Leave with the exit status that the last of the named outcomes asks for, and a line that says why."""
    from ..rig.states import FaultKind, Reaction

    name, last = outcomes[-1]
    if last.is_done:
        return
    fault = last.fault
    if fault is not None and fault.kind is FaultKind.EMERGENCY and fault.reaction is Reaction.RELEASE:
        raise typer.Exit(130)
    from .rig_page import fault_line

    out.note(f"error: {name}: {fault_line(fault)}; {record(len(outcomes) - 1)}")
    raise typer.Exit(1)
