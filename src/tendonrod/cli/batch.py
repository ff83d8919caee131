"""`tendonrod batch`: one equilibrium per row of a table."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections import Counter
from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, TendonrodError
from . import output
from .arguments import (
    CentroidWeight,
    Gravity,
    Json,
    RobotName,
    SceneFile,
    Torsion,
    chosen_robot,
    chosen_scene,
    vector,
    whole,
)
from .batch_file import Asked, Found, read_batch, written_rows

if TYPE_CHECKING:
    from ..robot import Robot

MOST_THREADS = 1024
_NO_GRAVITY = "0,0,0"


def batch(
    robot: RobotName,
    file: Annotated[str, typer.Argument(metavar="TABLE.csv", hidden=True)],
    output_file: Annotated[
        str, typer.Option("--output", metavar="FILE.csv", help="Write the table with its results, row by row.")
    ],
    gravity: Gravity = _NO_GRAVITY,
    scene: SceneFile = None,
    centroid_weight: CentroidWeight = False,
    torsion: Torsion = None,
    threads: Annotated[
        str | None, typer.Option(metavar="COUNT", help="Threads that solve. Left out: one per core.")
    ] = None,
    json: Json = False,
) -> None:
    """Solve one shape per row of a table.

    ROBOT: a preset, or the path of a robot's TOML file. TABLE.csv has any of the columns tension_N (of several tendons
    tension_1_N, tension_2_N, ...), displacement_mm (displacement_1_mm, ...; nothing or - where the tension is given),
    insertion, rotation_deg or rotation_rad, and, with y and z alike, gravity_x_m_s2, tip_force_x_N, tip_moment_x_Nm,
    distributed_force_x_N_per_m, distributed_moment_x_Nm_per_m; other columns are passed on. What is left out is 0, the
    insertion 1. Interrupted, it writes the rows that are done.
    """
    count = None if threads is None else whole("--threads", threads, 1, MOST_THREADS)
    pull, table = vector("--gravity", gravity), output.target("--output", output_file, (".csv",))
    if os.path.realpath(output_file) == os.path.realpath(file):
        raise InvalidInput("--output", Fact(output_file), "another file than TABLE.csv")
    chosen, around = chosen_robot(robot, torsion), chosen_scene(scene)
    asked = read_batch(file, chosen)
    if "gravity" in asked.arguments and gravity != _NO_GRAVITY:
        raise InvalidInput("--gravity", Fact(gravity), f"left out where {file} has columns of gravity")
    more: dict[str, Any] = around.arguments | ({"centroid_weight": True} if centroid_weight else {})
    began = time.monotonic()
    with _interruptible() as stop, output.progress_bar("solving") as watch, around.in_words():
        found = _solved(chosen, asked, {"gravity": pull} | asked.arguments, more, count, watch, stop)
        seconds = time.monotonic() - began
        header, rows = written_rows(asked, found)
        assert table is not None
        output.write_table("--output", table, header, rows)
    if json:
        output.say_json(_summary(chosen, asked, found, seconds, str(table)))
    else:
        output.say(_page(chosen, found, seconds))
    _end(found, stop, str(table))


def _solved(robot: Robot, asked: Asked, arguments: dict[str, Any], more, threads, watch, stop) -> Found:
    import numpy as np

    from ..statics.batch import solve_batch

    if asked.displacements is not None:
        return _one_by_one(robot, asked, arguments, more, watch, stop)
    size = len(asked.table.rows)
    arguments = {"tensions": 0.0, "insertion": np.ones(size)} | arguments
    solved = solve_batch(robot, **arguments, threads=threads, progress=watch, stop=stop, **more)
    return Found(
        status=[getattr(each, "name", "not_reached").lower() for each in solved.status],
        load_factor=solved.load_factor,
        error=solved.error_estimate,
        tip=solved.tip,
        axis=solved.tip_rotation[:, :, 2],
        tensions=np.full((size, robot.n_tendons), np.nan),
    )


def _one_by_one(robot: Robot, asked: Asked, arguments: dict[str, Any], more, watch, stop) -> Found:
    """Rows whose tendons are driven by their lengths, which `solve_batch` has in common for all items only."""
    import numpy as np

    from ..statics.equilibrium import solve

    size, per_row = len(asked.table.rows), asked.arguments.keys()
    found = Found(
        status=["not_reached"] * size,
        **{name: np.full(size, np.nan) for name in ("load_factor", "error")},
        **{name: np.full((size, 3), np.nan) for name in ("tip", "axis")},
        tensions=np.full((size, robot.n_tendons), np.nan),
    )
    for k, pulled in enumerate(asked.displacements):  # pyright: ignore[reportArgumentType] - checked by the caller
        if stop.is_set():
            break
        own = {name: each[k].tolist() if name in per_row else each for name, each in arguments.items()}
        lengths = [None if np.isnan(each) else each for each in pulled.tolist()]
        shape = solve(robot, **own, displacements=lengths, throw=False, **more)
        found.status[k], found.load_factor[k] = shape.status.name.lower(), shape.load_factor
        if shape.converged:
            found.error[k], found.tip[k] = shape.error_estimate, shape.tip
            found.axis[k], found.tensions[k] = shape.at([shape.length]).rotation[0, :, 2], shape.tensions
        watch(k + 1, size)
    return found


@contextlib.contextmanager
def _interruptible() -> Iterator[threading.Event]:
    """An event that the first interrupt sets, so that what is done can be written; a second one ends everything."""
    asked = threading.Event()

    def interrupted(*_) -> None:
        if asked.is_set():
            raise KeyboardInterrupt
        asked.set()

    if threading.current_thread() is not threading.main_thread():
        yield asked
        return
    before = signal.signal(signal.SIGINT, interrupted)
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, before)


def _counts(found: Found) -> dict[str, int]:
    """How many rows ended so, the converged ones first."""
    counts = Counter(found.status)
    return {status: counts[status] for status in sorted(counts, key="converged".__ne__)}


def _summary(robot: Robot, asked: Asked, found: Found, seconds: float, path: str) -> dict[str, Any]:
    failed = [
        {"row": k + 1, "status": status, "load_factor": factor}
        for k, (status, factor) in enumerate(zip(found.status, found.load_factor.tolist(), strict=True))
        if status not in ("converged", "not_reached")
    ]
    return {
        "robot": robot.name,
        "torsion": robot.torsion,
        "table": asked.table.name,
        "output": path,
        "rows": len(found.status),
        "counts": _counts(found),
        "failed": failed,
        "seconds": seconds,
    }


def _page(robot: Robot, found: Found, seconds: float) -> str:
    from ..statics.shape import Status

    rows = [(word, str(count), str(Status[word.upper()])) for word, count in _counts(found).items()]
    size = len(found.status)
    title = f"{robot.name}, torsion {robot.torsion}, {size} row{'s' * (size != 1)}, {seconds:.2f} s"
    return f"{output.heading(title)}\n\n{output.table(('status', 'rows', ''), rows, words=(0, 2))}"


def _end(found: Found, stop: threading.Event, path: str) -> None:
    """Exit status 130 after an interrupt, 1 where a row has no equilibrium."""
    counts, size = _counts(found), len(found.status)
    if stop.is_set():
        output.note(f"stopped with {size - counts.get('not_reached', 0)} of {size} rows done; they are in {path}")
        raise typer.Exit(130)
    failed = [k + 1 for k, status in enumerate(found.status) if status != "converged"]
    if failed:
        which = f"row {failed[0]}" if len(failed) == 1 else f"{len(failed)} of {size} rows, the first {failed[0]}"
        raise TendonrodError(f"{which}: no equilibrium found; the column status of {path} says why")
