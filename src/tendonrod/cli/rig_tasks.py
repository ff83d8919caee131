"""`tendonrod rig run`, `hold`, `retract`: tasks of the bench beside the follow-the-leader trials."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import nonnegative, one_of, positive, within
from . import output as out
from .arguments import Figure, Json, number
from .rig_arguments import (
    EARLIEST,
    BenchGravity,
    BenchOption,
    BenchTorsion,
    Homed,
    OuterFriction,
    Output,
    Profile,
    Rate,
    RealTime,
    Rehearse,
    RobotOption,
    ScrewRate,
    Seed,
    Slicer,
    Target,
    TendonFriction,
    TrackerMass,
    option,
)
from .rig_bench import Asked, Chosen, chosen, shown
from .rig_ending import end, export_beside, fresh, kept
from .rig_limits import admit, admit_turns, limits_for, machine_of, rates_in_words

if TYPE_CHECKING:
    from ..rig.drives import Machine
    from ..rig.interfaces import Task
    from ..rig.trials import Making


def run(
    file: Annotated[str, typer.Argument(metavar="FILE.csv", hidden=True)],
    output: Output,
    robot: RobotOption = "exonav-1",
    gravity: BenchGravity = None,
    seed: Seed = "0",
    rate: Rate = "200",
    bench: BenchOption = None,
    real_time: RealTime = False,
    homed: Homed = False,
    torsion: BenchTorsion = None,
    tendon_friction: TendonFriction = None,
    outer_friction: OuterFriction = None,
    tracker_mass: TrackerMass = None,
    slicer: Slicer = None,
    rehearse: Rehearse = None,
    figure: Figure = None,
    json: Json = False,
) -> None:
    """Run a motion from a file: insertion, rotation and tension.

    FILE.csv is as tendonrod motion reads it, and may have a column time_s; without it the axes' speeds say when. The
    axes are driven to their places, and the screw keeps the tension. DIR gets run.rec and run.nc.
    """
    asked = Asked(
        bench=bench, torsion=torsion, gravity=gravity, real_time=real_time, homed=homed, seed=seed, rate=rate,
        tendon_friction=tendon_friction, outer_friction=outer_friction, tracker_mass=tracker_mass,
        slicer=slicer, rehearse=rehearse,
    )  # fmt: skip
    picture = out.target("--figure", figure, out.FIGURES)
    place = chosen(robot, asked)

    from ..rig.commandfile import read_commands
    from ..rig.progressive import Progressive
    from ..rig.staged import Phase

    found, limits = read_commands(file), limits_for(place)
    highest, turned = max(found.tension), f"{file}: column {found.rotation_column}"
    admit(limits, place, f"{file}: column tension_N", highest, "up to ")
    admit_turns(machine_of(place, limits), turned, found.rotation, found.insertion)

    def make(machine: Machine) -> Task:
        admit_turns(machine, turned, found.rotation, found.insertion)  # devices may turn less far
        return Progressive(found.insertion, found.tension, machine, rotation=found.rotation, time=found.time)

    _perform(place, make, highest, "run", output, json, Phase.FOLLOW, picture=picture)


def hold(
    tension: Annotated[str, option("N", "To be held, N, >= 0.", "--tension")],
    duration: Annotated[str, option("S", "For how long, s.", "--duration")],
    output: Output,
    insertion: Annotated[str, option("SHARE", "Where the robot stands, 0 to 1.", "--insertion")] = "0",
    axis: Annotated[str, option("NAME", "That keeps the tension: screw or translation.", "--axis")] = "screw",
    robot: RobotOption = "exonav-1",
    gravity: BenchGravity = None,
    seed: Seed = "0",
    rate: Rate = "200",
    bench: BenchOption = None,
    real_time: RealTime = False,
    homed: Homed = False,
    torsion: BenchTorsion = None,
    tendon_friction: TendonFriction = None,
    outer_friction: OuterFriction = None,
    tracker_mass: TrackerMass = None,
    slicer: Slicer = None,
    rehearse: Rehearse = None,
    figure: Figure = None,
    json: Json = False,
) -> None:
    """Bring the tendon to a tension and hold it.

    The robot goes to --insertion first and stays there; with --axis translation the paper's loop holds the tension at
    a still screw. DIR gets hold.rec and hold.nc.
    """
    tau, time = number("--tension", tension, nonnegative), number("--duration", duration, positive)
    eta = number("--insertion", insertion, within, 0.0, 1.0)
    one_of("--axis", axis, ("screw", "translation"))
    asked = Asked(
        bench=bench, torsion=torsion, gravity=gravity, real_time=real_time, homed=homed, seed=seed, rate=rate,
        tendon_friction=tendon_friction, outer_friction=outer_friction, tracker_mass=tracker_mass,
        slicer=slicer, rehearse=rehearse,
    )  # fmt: skip
    picture = out.target("--figure", figure, out.FIGURES)
    place = chosen(robot, asked)
    admit(limits_for(place), place, "--tension", tau)

    from ..rig.staged import Phase

    def make(machine: Machine) -> Task:
        from ..rig.chain import Chain
        from ..rig.tasks import Progressive, TensionHold

        held = TensionHold(tau, time, machine, axis=axis)
        return Chain([Progressive([eta], [tau], machine), held]) if eta > 0.0 else held

    _perform(place, make, tau, "hold", output, json, Phase.HOLD, picture=picture)


def retract(
    target: Target,
    output: Output,
    insertion: Annotated[str, option("SHARE", "At which a virtual robot begins, 0.06 to 1.", "--from")] = "1",
    profile: Profile = "plan",
    screw_rate_mm_s: ScrewRate = "0.45",
    robot: RobotOption = "exonav-1",
    gravity: BenchGravity = None,
    seed: Seed = "0",
    rate: Rate = "200",
    bench: BenchOption = None,
    real_time: RealTime = False,
    torsion: BenchTorsion = None,
    tendon_friction: TendonFriction = None,
    outer_friction: OuterFriction = None,
    tracker_mass: TrackerMass = None,
    slicer: Slicer = None,
    rehearse: Rehearse = None,
    figure: Figure = None,
    json: Json = False,
) -> None:
    """Draw the robot in along its follow-the-leader profile, backwards.

    With devices from where it stands, as rig ftl has left it: the axes must know their references and are not homed.
    A virtual bench is switched on with its robot drawn in, so that it inserts it first. DIR gets retract.rec and
    retract.nc.
    """
    one_of("--profile", profile, ("plan", "polynomial", "paper"))
    tau, pace = number("--target", target, positive), 1e-3 * number("--screw-rate-mm-s", screw_rate_mm_s, positive)
    start = number("--from", insertion, within, EARLIEST, 1.0)
    asked = Asked(
        bench=bench, torsion=torsion, gravity=gravity, real_time=real_time, seed=seed, rate=rate,
        tendon_friction=tendon_friction, outer_friction=outer_friction, tracker_mass=tracker_mass,
        slicer=slicer, rehearse=rehearse,
    )  # fmt: skip
    picture = out.target("--figure", figure, out.FIGURES)
    place = chosen(robot, asked)

    from ..rig.staged import Phase
    from ..rig.trials import highest_of
    from .rig import mixtures, profile_for

    limits = limits_for(place)
    admit(limits, place, "--target", tau)
    wanted = profile_for(place, profile, tau)
    admit(limits, place, "--target" if profile != "paper" else "--profile", highest_of(wanted), "its profile up to ")
    out.warn(mixtures(place, wanted, tau, None))

    def make(machine: Machine) -> Task:
        from ..rig.chain import Chain
        from ..rig.tasks import FollowLeader, Retract

        back = Retract(wanted, machine, screw_rate=pace)
        if not place.is_virtual:
            return back
        return Chain([FollowLeader(wanted, machine, screw_rate=pace, end=start), back])

    _perform(
        place, make, highest_of(wanted), "retract", output, json, Phase.RETRACT, picture=picture, home=place.is_virtual
    )


def release(
    output: Output,
    robot: RobotOption = "exonav-1",
    gravity: BenchGravity = None,
    bench: BenchOption = None,
    torsion: BenchTorsion = None,
    rehearse: Rehearse = None,
    json: Json = False,
) -> None:
    """Let the tendon go: the screw pays out until it is slack.

    From wherever the bench stands, without homing; after an emergency stop or a lost program the tendon still has its
    tension, and homing needs it slack. DIR gets release.rec and release.nc.
    """
    place = chosen(robot, Asked(bench=bench, torsion=torsion, gravity=gravity, rehearse=rehearse))
    _perform(place, None, None, "release", output, json)


def _perform(
    place: Chosen,
    make: Making | None,
    highest: float | None,
    name: str,
    output: str,
    json: bool,
    *phases: str,
    picture: Path | None = None,
    **more: Any,
) -> None:
    """Run, record, export, draw, print; leave with the exit status."""
    from ..rig.trials import run as run_on
    from .rig_page import performed_json, performed_page

    title = f"{name}: {place.source.robot.name}, torsion {place.source.robot.torsion}"
    with fresh(output, [f"{name}.rec", f"{name}.nc"]) as directory, shown(place, title) as view:
        given: dict[str, Any] = {"seed": place.seed, "watch": view.watch, **place.options, **more}
        path = directory / f"{name}.rec"
        with kept(path, place), rates_in_words():
            done = run_on(place.source, make, path, highest=highest, **given)
    out.note(f"wrote {done.path}")
    export_beside(done.record, done.path)
    if picture is not None:
        from ..plot.bench_task import task_figure

        out.write_figure("--figure", picture, lambda: task_figure(done))
    if json:
        out.say_json(performed_json(done, place.source, *phases))
    else:
        out.say(performed_page(done, place.source, *phases))
    end(place, [(name, done.outcome)], lambda _: done.record)
