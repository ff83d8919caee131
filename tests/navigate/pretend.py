"""A session without mechanics, quick and predictable, for the tests of the service: a straight rod goes along z."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from tendonrod.errors import InvalidInput
from tendonrod.navigate.commands import FASTEST, Jog, Posture
from tendonrod.navigate.outer_tube import OuterTube
from tendonrod.navigate.recovery import Trouble
from tendonrod.navigate.snapshot import Gauge, Snapshot

LENGTH = 0.05
POINTS = 40
TARGETS = {"lateral-left@T12": (0.0, 0.0, 0.02)}


def scenario() -> Any:
    """As much of a `Scenario` as the service looks at."""
    vertices = np.array([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    cord = SimpleNamespace(role="cord", is_wall=True, mesh=(vertices, faces))
    targets = {
        name: SimpleNamespace(level="T12", position=at, tolerance=1e-3, side="left", description="beside the cord")
        for name, at in TARGETS.items()
    }
    level = SimpleNamespace(name="T12", z_low=0.0, z_high=0.03)
    entry = SimpleNamespace(level="T12", height=0.0, offset=0.0, depth=4.9e-3)
    free = SimpleNamespace(distance=lambda points: (np.ones(len(points)), None))
    phantom = SimpleNamespace(
        name="pretended", kind="printed", structures={"cord": cord}, targets=targets, levels=(level,),
        entries={"T12": entry}, entry={"T12": entry}.__getitem__, gaps={}, free=lambda: free,
    )  # fmt: skip
    robot = SimpleNamespace(
        name="rod", torsion="published", section=SimpleNamespace(L=LENGTH), n_tendons=1, length_na=LENGTH,
        outer_radius=lambda s: np.full(len(s), 7e-4),
    )  # fmt: skip
    return SimpleNamespace(
        robot=robot, phantom=phantom, tube=OuterTube(), gravity=(-9.81, 0.0, 0.0), outer_radius=7e-4, coupled=True
    )


class PretendSession:
    """What the service asks of a `Session`. fail: the next step raises, as a defect would."""

    can_reset, fastest = True, Jog(**FASTEST)

    def __init__(self) -> None:
        self.scenario, self.coupled, self.fail, self.closed = scenario(), True, False, False
        self.steps: list[tuple[Jog, float]] = []
        self.record: Any = None
        self.trouble: Trouble | None = None
        self.acknowledged: list[bool] = []
        self.halted = 0
        self.snapshot = _snapshot(0, 0.0, Posture(tension=(0.0,)), self.scenario.tube, ())

    def acknowledge(self, home: bool = False) -> None:
        self.acknowledged.append(home)
        self.trouble = None

    def halt(self) -> None:
        self.halted += 1

    def step(self, jog: Jog, dt: float) -> Snapshot:
        if self.fail:
            raise ZeroDivisionError("a defect")
        at, last = self.snapshot.posture, self.snapshot
        posture = Posture(
            insertion=min(max(at.insertion + jog.insertion * dt / LENGTH, 0.0), 1.0),
            rotation=at.rotation + jog.rotation * dt,
            tension=(max(at.tension[0] + jog.tension * dt, 0.0),),
        )
        self.steps.append((jog, dt))
        self.snapshot = _snapshot(last.index + 1, last.time + dt, posture, last.tube, last.reached)
        return self.snapshot

    def rehearse(self) -> None:
        """Nothing is to be loaded."""

    @property
    def moved(self) -> list[tuple[Jog, float]]:
        """The steps that were not still."""
        return [each for each in self.steps if not each[0].is_still]

    def place(self, tube: OuterTube) -> Snapshot:
        if self.snapshot.insertion > 0.0:
            raise InvalidInput("insertion", self.snapshot.insertion, "0 while the outer tube is placed")
        self.snapshot = replace(self.snapshot, tube=tube)
        return self.snapshot

    def reset(self) -> Snapshot:
        last = self.snapshot
        self.snapshot = _snapshot(last.index, last.time, Posture(tension=(0.0,)), last.tube, ())
        return self.snapshot

    def couple(self, on: bool) -> Snapshot:
        self.coupled = on
        return self.snapshot

    def start_recording(self, record: Any) -> None:
        self.record = record
        record.path.write_text('{"format": "pretended"}\n')

    def stop_recording(self) -> None:
        self.record = None

    def close(self) -> None:
        self.closed = True


def _snapshot(index: int, time: float, posture: Posture, tube: OuterTube, reached: tuple[str, ...]) -> Snapshot:
    s = np.linspace(0.0, posture.insertion * LENGTH, POINTS)
    line = np.column_stack([0.0 * s, 0.0 * s, s])
    distance = {name: float(np.linalg.norm(line[-1] - at)) for name, at in TARGETS.items()}
    near = tuple(name for name, each in distance.items() if each < 1e-3)
    gauges = {
        "insertion": Gauge(value=posture.insertion, low=0.0, high=1.0, unit="1", is_exceeded=False),
        "contact_force": Gauge(value=0.0, low=0.0, high=np.inf, unit="N", is_exceeded=False),
    }
    return Snapshot(
        index=index, time=time, posture=posture, tube=tube, s=s, centerline=line,
        frames=np.tile(np.eye(3), (POINTS, 1, 1)), radius=np.full(POINTS, 7e-4),
        clearance={"cord": np.full(POINTS, 1e-3), "canal": np.full(POINTS, np.inf)},
        contact_point=line[:50:2], contact_force=np.ones((len(line[:50:2]), 3)),
        contact_pressure=np.full(len(line[:50:2]), 1e3), contact_structure=("cord",) * len(line[:50:2]),
        pressure=np.zeros(POINTS), target_distance=distance,
        reached=tuple(dict.fromkeys([*reached, *near])), limits=gauges, warnings=(), in_range=True, blocked="",
    )  # fmt: skip
