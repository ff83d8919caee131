"""`tendonrod rig run`, `hold`, `retract`: tasks of the bench beside the follow-the-leader trials."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import nonnegative, one_of, positive, within
from . import output as out
from .arguments import Json, number
from .rig_bench import (
    Asked,
    BenchGravity,
    BenchOption,
    BenchTorsion,
    Chosen,
    Homed,
    OuterFriction,
    Output,
    Rate,
    RealTime,
    RobotOption,
    Seed,
    TendonFriction,
    TrackerMass,
    chosen,
    end,
    export_beside,
    fresh,
    option,
)

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
    json: Json = False,
) -> None:
    """Run a motion from a file: insertion, rotation and tension.

    FILE.csv is as tendonrod motion reads it, and may have a column time_s; without it the axes' speeds say when. The
    axes are driven to their places, and the screw keeps the tension. DIR gets run.rec and run.nc.
    """
    asked = Asked(
        bench=bench, torsion=torsion, gravity=gravity, real_time=real_time, homed=homed, seed=seed, rate=rate,
        tendon_friction=tendon_friction, outer_friction=outer_friction, tracker_mass=tracker_mass,
    )  # fmt: skip
    place = chosen(robot, asked)

    from ..rig.commandfile import read_commands
    from ..rig.progressive import Progressive
    from ..rig.staged import Phase

    highest = max(read_commands(file).tension)
    _perform(place, lambda machine: Progressive.read(file, machine), highest, "run", output, json, Phase.FOLLOW)


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
    )  # fmt: skip
    place = chosen(robot, asked)

    from ..rig.staged import Phase

    def make(machine: Machine) -> Task:
        from ..rig.chain import Chain
        from ..rig.tasks import Progressive, TensionHold

        held = TensionHold(tau, time, machine, axis=axis)
        return Chain([Progressive([eta], [tau], machine), held]) if eta > 0.0 else held

    _perform(place, make, tau, "hold", output, json, Phase.HOLD)


def retract(
    target: Annotated[str, option("N", "Tension at full insertion, N, > 0.", "--target")],
    output: Output,
    insertion: Annotated[str, option("SHARE", "At which a virtual robot begins, up to 1.", "--from")] = "1",
    profile: Annotated[str, option("NAME", "As in rig ftl: plan, polynomial or paper.", "--profile")] = "plan",
    screw_rate_mm_s: Annotated[str, option("MM/S", "At which the screw winds the tendon in.")] = "0.45",
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
    json: Json = False,
) -> None:
    """Draw the robot in along its follow-the-leader profile, backwards.

    With devices from where it stands, as rig ftl has left it: the axes must know their references and are not homed.
    A virtual bench is switched on with its robot drawn in, so that it inserts it first. DIR gets retract.rec and
    retract.nc.
    """
    one_of("--profile", profile, ("plan", "polynomial", "paper"))
    tau, pace = number("--target", target, positive), 1e-3 * number("--screw-rate-mm-s", screw_rate_mm_s, positive)
    start = number("--from", insertion, within, 0.06, 1.0)
    asked = Asked(
        bench=bench, torsion=torsion, gravity=gravity, real_time=real_time, seed=seed, rate=rate,
        tendon_friction=tendon_friction, outer_friction=outer_friction, tracker_mass=tracker_mass,
    )  # fmt: skip
    place = chosen(robot, asked)

    from ..rig.staged import Phase
    from ..rig.trials import highest_of
    from .rig import profile_for

    wanted = profile_for(place, profile, tau)

    def make(machine: Machine) -> Task:
        from ..rig.chain import Chain
        from ..rig.tasks import FollowLeader, Retract

        back = Retract(wanted, machine, screw_rate=pace)
        if not place.is_virtual:
            return back
        return Chain([FollowLeader(wanted, machine, screw_rate=pace, end=start), back])

    _perform(place, make, highest_of(wanted), "retract", output, json, Phase.RETRACT, home=place.is_virtual)


def release(
    output: Output,
    robot: RobotOption = "exonav-1",
    gravity: BenchGravity = None,
    bench: BenchOption = None,
    torsion: BenchTorsion = None,
    json: Json = False,
) -> None:
    """Let the tendon go: the screw pays out until it is slack.

    From wherever the bench stands, without homing; after an emergency stop or a lost program the tendon still has its
    tension, and homing needs it slack. DIR gets release.rec and release.nc.
    """
    place = chosen(robot, Asked(bench=bench, torsion=torsion, gravity=gravity))
    _perform(place, None, None, "release", output, json)


def _perform(
    place: Chosen,
    make: Making | None,
    highest: float | None,
    name: str,
    output: str,
    json: bool,
    *phases: str,
    **more: Any,
) -> None:
    """Run, record, export, print; leave with the exit status."""
    directory = fresh(output, [f"{name}.rec", f"{name}.nc"])

    from ..rig.trials import run as run_on
    from .live import LiveView
    from .rig_page import performed_json, performed_page

    robot = place.source.robot
    with LiveView(robot.length_na) as view:
        view.begin(f"{name}: {robot.name}, torsion {robot.torsion}")
        given: dict[str, Any] = {"seed": place.seed, "watch": view.watch, **place.options, **more}
        done = run_on(place.source, make, directory / f"{name}.rec", highest=highest, **given)
    out.note(f"wrote {done.path}")
    export_beside(done)
    if json:
        out.say_json(performed_json(done, place.source, *phases))
    else:
        out.say(performed_page(done, place.source, *phases))
    end([(name, done.outcome)], lambda _: f"{done.path.name} is {done.record.condition}")
