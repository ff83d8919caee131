"""`tendonrod rig`: the bench. `rig ftl` runs, records and reports follow-the-leader trials."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, one_of, positive, within
from . import output as out
from .arguments import Json, RobotName, in_words, number, whole
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
from .shape_page import listed

if TYPE_CHECKING:
    from ..rig.limits import Limits
    from ..rig.profiles import Profile as TensionProfile
    from ..rig.trials import Followed
    from ..robot import Robot

MOST_TRIALS = 1000
APART = 0.01  # N, from a plan's end to the target: more than any tension controller's error


def ftl(
    robot: RobotName,
    target: Target,
    output: Output,
    gravity: BenchGravity = None,
    trials: Annotated[str, option("COUNT", "How many, one after another.", "--trials")] = "1",
    seed: Seed = "0",
    profile: Profile = "plan",
    plan: Annotated[str | None, option("FILE.csv", "A plan on file, as tendonrod ftl writes it.", "--plan")] = None,
    feed_forward: Annotated[
        bool,
        typer.Option("--feed-forward", help="The model's pay-out drives the translation too; not so in the paper."),
    ] = False,
    kp: Annotated[str, option("GAIN", "Of the tension controller, (mm/s)/N.", "--kp")] = "50",
    ki: Annotated[str, option("GAIN", "Of the tension controller, (mm/s2)/N.", "--ki")] = "50",
    screw_rate_mm_s: ScrewRate = "0.45",
    insertion: Annotated[str, option("SHARE", "At which the trials end, 0.06 to 1.", "--end")] = "1",
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
    json: Json = False,
) -> None:
    """Follow-the-leader trials on the bench, recorded and reported.

    ROBOT: a preset, or the path of a robot's TOML file. The screw pays the tendon out, the controller drives the
    translation on the tension. DIR gets trial-1.rec, every sample of it; trial-1.nc, as tendonrod validate reads it;
    ...; and index.html. Trial k has the seed --seed + k - 1. Space or Esc stop; Ctrl-C releases the tension and ends.
    """
    count = whole("--trials", trials, 1, MOST_TRIALS)
    tau = number("--target", target, positive)
    one_of("--profile", profile, ("plan", "polynomial", "paper"))
    if plan is not None and profile == "paper":
        raise InvalidInput("--plan", Fact(plan), "left out with --profile paper")
    options = {
        "feed_forward": feed_forward,
        "kp": 1e-3 * number("--kp", kp, positive),
        "ki": 1e-3 * number("--ki", ki, within, 0.0, 1e6),
        "screw_rate": 1e-3 * number("--screw-rate-mm-s", screw_rate_mm_s, positive),
        "end": number("--end", insertion, within, EARLIEST, 1.0),
    }
    asked = Asked(
        bench=bench, torsion=torsion, gravity=gravity, real_time=real_time, homed=homed, seed=seed, rate=rate,
        tendon_friction=tendon_friction, outer_friction=outer_friction, tracker_mass=tracker_mass,
        slicer=slicer, rehearse=rehearse,
    )  # fmt: skip
    place = chosen(robot, asked)
    limits = limits_for(place)
    admit(limits, place, "--target", tau)
    names = [f"trial-{k}{suffix}" for k in range(1, count + 1) for suffix in (".rec", ".nc")]
    with fresh(output, [*names, "index.html"]) as directory:
        wanted = profile_for(place, profile, tau, plan)
        _admit_profile(limits, place, wanted, plan)
        out.warn(mixtures(place, wanted, tau, plan))
        found = _trials(place, wanted, tau, directory, count, options)
    _report(found, place, directory, json)
    end(place, [(f"trial {k}", each.outcome) for k, each in enumerate(found, 1)], lambda k: found[k].record)


def profile_for(place: Chosen, name: str, target: float, plan: str | None = None) -> TensionProfile:
    """The tension's profile for the robot on its bench."""
    from ..rig.payout import tendon_compliance
    from ..rig.profiles import profile

    setup: Any = getattr(place.source, "setup", None)
    robot, pull = place.source.robot, place.source.gravity
    soft = tendon_compliance(robot) if setup is None else setup.tendon_length / setup.tendon_stiffness
    with in_words({"insertion": f"{plan}: column insertion", "plan": "--plan"} if plan else {}):
        return profile(name, robot, target, pull, plan=plan, compliance=soft)


def _admit_profile(limits: Limits, place: Chosen, wanted: TensionProfile, plan: str | None) -> None:
    """Raise `InvalidInput` for a profile that asks for more than the bench allows."""
    from ..rig.trials import highest_of

    by_target = plan is None and wanted.name != "paper"
    field = f"{plan}: column tension_N" if plan else "--target" if by_target else "--profile"
    what = "its profile up to " if by_target else "up to " if plan else "paper, up to "
    admit(limits, place, field, highest_of(wanted), what)
    if plan is not None:
        from ..rig.commandfile import read_commands

        read = read_commands(plan)
        field = f"{plan}: column {read.rotation_column}"
        admit_turns(machine_of(place, limits), field, read.rotation, read.insertion)


def mixtures(place: Chosen, wanted: TensionProfile, target: float, plan: str | None) -> list[str]:
    """What of the profile does not go with the target, the robot or its model."""
    from ..report.bench import is_papers

    source, said, last = place.source, [], wanted.tension.value(1.0)
    robot = f"{source.robot.name}, torsion {source.robot.torsion}, gravity ({listed(source.gravity)}) m/s2"
    if plan is not None:
        said += _of_another(plan, source.robot, source.gravity)
    if plan is not None and abs(last - target) > APART:
        said.append(f"{plan} ends at {last:.3g} N, the tip is measured against the robot at --target {target:g} N")
    if wanted.name == "paper" and not is_papers(source.robot.name, target, source.gravity):
        case = "exonav-1 at 0.7 N with gravity -9.81,0,0"
        said.append(f"the paper's profile is of {case}; here it is {robot}, --target {target:g} N")
    return said


def _of_another(plan: str, robot: Robot, gravity) -> list[str]:
    """What a plan on file was made for, where that is not what it is used for."""
    from ..rig.commandfile import read_commands

    origin = read_commands(plan).origin
    if origin is None:
        here = f"{robot.name}, torsion {robot.torsion}, gravity ({listed(gravity)}) m/s2"
        return [f"{plan} does not say for which robot, torsion and gravity it was made; here it is {here}"]
    found = origin.differences(robot, gravity)
    return [f"{plan} was made for {'; '.join(found)}"] if found else []


def _trials(
    place: Chosen, wanted: TensionProfile, target: float, directory: Path, count: int, options: dict[str, Any]
) -> list[Followed]:
    """Up to the first that does not end well."""
    from ..rig.trials import follow_leader

    found: list[Followed] = []
    robot = place.source.robot
    with shown(place, target=target) as view:
        for k in range(count):
            seed = f", seed {place.seed + k}" if place.is_virtual else ""
            view.begin(f"trial {k + 1} of {count}{seed}: {robot.name}, torsion {robot.torsion}")
            path = directory / f"trial-{k + 1}.rec"
            given: dict[str, Any] = {"seed": place.seed + k, "watch": view.watch, **options, **place.options}
            with kept(path, place), rates_in_words():
                found.append(follow_leader(place.source, wanted, target, path, **given))
            out.note(f"wrote {path}")
            export_beside(found[-1].record, path)
            if not found[-1].outcome.is_done:
                break
    return found


def _report(found: list[Followed], place: Chosen, directory: Path, json: bool) -> None:
    from ..report.bench import write_bench
    from ..rig.inserted import inserted
    from .rig_page import followed_dict, followed_page

    ways = [inserted(each) for each in found]
    if json:
        out.say_json(followed_dict(found, ways, place.source))
    else:
        out.say(followed_page(found, ways, place.source))
    with out.progress_bar("drawing") as watch:
        page = write_bench(found, directory, watch)
    out.note(f"wrote {page}, and the figures and tables beside it")
