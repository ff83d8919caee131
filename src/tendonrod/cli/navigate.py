"""`tendonrod navigate`: steer a robot through a phantom, in the browser or by a script."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import Fact, InvalidInput
from . import output as out
from .arguments import Json, in_words, whole

if TYPE_CHECKING:
    from ..navigate.drive import Drive
    from ..navigate.scenario import Scenario
    from ..rig.benchfile import BenchFile
    from ..robot import Robot

PORT = "8420"
LOOPBACK = "127.0.0.1"
ROBOT = "exonav-1"
FOLDER = "navigate-sessions"
VIRTUAL = "virtual"
OPTIONS = {name: f"--{name}" for name in ("scene", "phantom", "levels", "entry", "robot", "torsion")}


def navigate(
    phantom: Annotated[
        str | None, typer.Option(metavar="NAME", help="printed, the default, anatomical, or a phantom's TOML file.")
    ] = None,
    levels: Annotated[str | None, typer.Option(metavar="A-B", help="Vertebrae of the phantom, as T8-L2.")] = None,
    entry: Annotated[
        str | None, typer.Option(metavar="LEVEL", help="Whose window the outer tube comes through; else the lowest.")
    ] = None,
    robot: Annotated[str | None, typer.Option(metavar="ROBOT", help="A preset or a file; exonav-1 by default.")] = None,
    torsion: Annotated[
        str | None, typer.Option(metavar="MODEL", help="published, open_section or homogenized, the default here.")
    ] = None,
    scene: Annotated[
        str | None,
        typer.Option(metavar="FILE.toml", help="Robot, phantom, outer tube, gravity and limits; units in its keys."),
    ] = None,
    bench: Annotated[
        str | None,
        typer.Option(metavar="FILE.toml", help="Steer the robot on this bench, or on the one called virtual."),
    ] = None,
    port: Annotated[str, typer.Option(metavar="NUMBER", help="Of the page; 0 for any free one.")] = PORT,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="To listen on; beyond this machine a token is asked for.")
    ] = LOOPBACK,
    output: Annotated[str, typer.Option(metavar="DIR", help="Where every session is recorded.")] = FOLDER,
    no_browser: Annotated[bool, typer.Option("--no-browser", help="Only print the address.")] = False,
    script: Annotated[
        str | None, typer.Option(metavar="FILE.csv", help="Moves to be made, rates and durations; with --headless.")
    ] = None,
    headless: Annotated[bool, typer.Option("--headless", help="Run --script without page and server.")] = False,
    json: Json = False,
) -> None:
    """Steer a robot through a phantom of the spine, with contact, in the browser.

    Keys in the page: W and S insert and retract, A and D turn, E and Q pull and let go; gamepad and buttons too.
    Everything stops when nothing is held. Every command goes to a record in DIR, which the page replays. Ctrl-C ends.

    A first drive: hold E for 7 s, to 0.7 N, then W for 18 s: the tip goes past lateral-right@L2 to ventral@L1.

    On a bench the page shows the robot at the insertion, rotation and tension that are measured. No bench knows the
    phantom: only the picture has its walls.

    FILE.csv has the columns duration_s, insertion_mm_per_s, rotation_deg_per_s and tension_n_per_s, and where the outer
    tube is placed, in rows that begin with the robot retracted, tube_height_mm, tube_offset_mm, tube_depth_mm,
    tube_tilt_deg and tube_lean_deg as needed.
    """
    _check(script, headless, json)
    number = whole("--port", port, 0, 65535)
    made = _maker(scene, phantom=phantom, levels=levels, entry=entry, robot=robot, torsion=torsion)
    place = "--robot" if robot is not None or scene is None else f"{scene}: robot"
    with in_words(OPTIONS | {"robot": place}):
        file = None if bench is None else _bench_file(bench, _robot(scene, robot))
    driven = partial(_driven, file, headless)
    if script is not None:
        from .navigate_script import run_script

        run_script(made, driven, script, output, json)
    else:
        _serve(made, driven, output, host, number, not no_browser)


def _check(script: str | None, headless: bool, json: bool) -> None:
    if script is not None and not headless:
        raise InvalidInput("--script", Fact(script), "given with --headless; the page replays records instead")
    if headless and script is None:
        raise InvalidInput("--headless", Fact("given"), "given with --script FILE.csv")
    if json and not headless:
        raise InvalidInput("--json", Fact("given"), "left out unless --headless is given")


def _maker(scene: str | None, **options: str | None) -> Callable[[], Scenario]:
    """Makes the scenario, which takes its time; what the options say goes before the scene."""
    from ..navigate.scenariofile import read_scenario

    def made() -> Scenario:
        with in_words(OPTIONS):
            found = read_scenario(scene, **options)
        out.warn([*found.phantom.doubts(), *found.phantom.unreachable(found.outer_radius).values()])
        return found

    return made


def _bench_file(bench: str, robot: Robot) -> BenchFile:
    """Looked through before the phantom is built, which takes its time; only its gravity is not known yet."""
    from ..rig.benches import DeviceSource
    from ..rig.benchfile import default_bench, read_bench

    file = default_bench() if bench == VIRTUAL else read_bench(bench, "--bench")
    source = file.source(robot, file.gravity or (0.0, 0.0, 0.0))
    file.check_homing()
    if isinstance(source, DeviceSource):
        source.check_port()
    return file


def _robot(scene: str | None, robot: str | None) -> Robot:
    """That of the session, with any torsion; what else is wrong in the scene is told with the rest of it."""
    from ..navigate.scenariofile import robot_named
    from ..robot import load_robot

    if robot is None and scene is not None:
        robot = robot_named(scene)
    return load_robot(robot or ROBOT)


def _driven(file: BenchFile | None, headless: bool, scenario: Scenario) -> Drive | None:
    """The bench that was asked for, None for none; it stands as the outer tube does, so gravity pulls as there.

    A virtual one runs in real time under the page, and as fast as it can under a script.
    """
    if file is None:
        return None
    from ..navigate.bench_aside import BenchAside
    from ..navigate.bench_drive import BenchDrive

    gx, gy, gz = (scenario.tube.pose[:3, :3].T @ scenario.gravity).tolist()
    source = file.source(scenario.robot, (gx, gy, gz), file.is_virtual and not headless)
    if file.is_virtual and headless:
        return BenchDrive(scenario, source)
    return BenchAside(scenario, source, paced=headless)


def _serve(
    made: Callable[[], Scenario], driven: Callable[[Scenario], Drive | None], output: str, host: str, port: int,
    browser: bool,
) -> None:  # fmt: skip
    from ..navigate.doors import Door
    from ..navigate.records import Records
    from ..navigate.server import listening, serve
    from ..navigate.service import Service
    from ..navigate.session import Session

    at = listening(host, port)  # before the phantom is built, so that a taken port is told at once
    records = Records(out.directory("--output", output))
    scenario = made()
    service = Service(Session(scenario, driven(scenario)), records)
    door = Door.at(host, at.getsockname()[1])

    def ready() -> None:
        out.say("\n".join([f"open {door.url}", *(f"from another machine {each}" for each in door.urls_elsewhere)]))
        where = "nothing is recorded" if service.record is None else f"the session is recorded in {service.record}"
        out.note(f"{where}; Ctrl-C here ends it")
        if door.token is not None:
            out.note("whoever has this address can steer; the connection is not encrypted")
        if browser:
            _open(door.url)

    record = serve(service, at, door, ready)
    out.note("ended" if record is None else f"ended; the session is in {record}")


def _open(url: str) -> None:
    """In the user's browser, without waiting for it."""
    import threading
    import webbrowser

    threading.Thread(target=webbrowser.open, args=(url,), daemon=True).start()
