"""`tendonrod rig`: the bench. `rig ftl` runs, records and reports follow-the-leader trials."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import Fact, InvalidInput, one_of, positive, within
from . import output as out
from .arguments import Json, RobotName, number, whole
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
    from ..rig.profiles import Profile
    from ..rig.trials import Followed

MOST_TRIALS = 1000


def ftl(
    robot: RobotName,
    target: Annotated[str, option("N", "Tension at full insertion, N, > 0.", "--target")],
    output: Output,
    gravity: BenchGravity = None,
    trials: Annotated[str, option("COUNT", "How many, one after another.", "--trials")] = "1",
    seed: Seed = "0",
    profile: Annotated[
        str,
        option(
            "NAME",
            "Of the tension: plan, of tendonrod ftl; polynomial, the quadratic that fits it; paper, the paper's own.",
            "--profile",
        ),
    ] = "plan",
    plan: Annotated[str | None, option("FILE.csv", "A plan on file, as tendonrod ftl writes it.", "--plan")] = None,
    feed_forward: Annotated[
        bool,
        typer.Option("--feed-forward", help="The model's pay-out drives the translation too; not so in the paper."),
    ] = False,
    kp: Annotated[str, option("GAIN", "Of the tension controller, (mm/s)/N.", "--kp")] = "50",
    ki: Annotated[str, option("GAIN", "Of the tension controller, (mm/s2)/N.", "--ki")] = "50",
    screw_rate_mm_s: Annotated[str, option("MM/S", "At which the screw pays the tendon out.")] = "0.45",
    insertion: Annotated[str, option("SHARE", "At which the trials end, up to 1.", "--end")] = "1",
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
        "end": number("--end", insertion, within, 0.0, 1.0),
    }
    asked = Asked(
        bench=bench, torsion=torsion, gravity=gravity, real_time=real_time, homed=homed, seed=seed, rate=rate,
        tendon_friction=tendon_friction, outer_friction=outer_friction, tracker_mass=tracker_mass,
    )  # fmt: skip
    place = chosen(robot, asked)
    names = [f"trial-{k}{suffix}" for k in range(1, count + 1) for suffix in (".rec", ".nc")]
    directory = fresh(output, [*names, "index.html"])
    wanted = profile_for(place, profile, tau, plan)
    found = _trials(place, wanted, tau, directory, count, options)
    _report(found, place, directory, json)
    outcomes = [(f"trial {k}", each.outcome) for k, each in enumerate(found, 1)]
    end(outcomes, lambda k: f"{found[k].path.name} is {found[k].record.condition}")


def profile_for(place: Chosen, name: str, target: float, plan: str | None = None) -> Profile:
    """The tension's profile for the robot on its bench."""
    from ..rig.payout import tendon_compliance
    from ..rig.profiles import profile

    setup: Any = getattr(place.source, "setup", None)
    robot, pull = place.source.robot, place.source.gravity
    soft = tendon_compliance(robot) if setup is None else setup.tendon_length / setup.tendon_stiffness
    return profile(name, robot, target, pull, plan=plan, compliance=soft)


def _trials(
    place: Chosen, wanted: Profile, target: float, directory: Path, count: int, options: dict[str, Any]
) -> list[Followed]:
    """Up to the first that does not end well."""
    from ..rig.trials import follow_leader
    from .live import LiveView

    found: list[Followed] = []
    robot = place.source.robot
    for k in range(count):
        with LiveView(robot.length_na) as view:
            seed = f", seed {place.seed + k}" if place.is_virtual else ""
            view.begin(f"trial {k + 1} of {count}{seed}: {robot.name}, torsion {robot.torsion}")
            path = directory / f"trial-{k + 1}.rec"
            given: dict[str, Any] = {"seed": place.seed + k, "watch": view.watch, **options, **place.options}
            found.append(follow_leader(place.source, wanted, target, path, **given))
        out.note(f"wrote {path}")
        export_beside(found[-1])
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
