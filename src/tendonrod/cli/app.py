"""The commands, put together: `app`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated

import typer
from typer.core import TyperCommand

from .batch import batch
from .experiment import experiment
from .ftl import ftl
from .identify import identify
from .motion import motion
from .navigate import navigate
from .output import say
from .phantom import phantom
from .reach import reach
from .reproduce import reproduce
from .rig import ftl as rig_ftl
from .rig_records import design, export, replay
from .rig_tasks import hold, release, retract, run
from .robots import robots
from .session import session
from .shape import shape
from .trial import trial
from .validate import validate


class _Command(TyperCommand):
    def collect_usage_pieces(self, ctx):
        return [piece.replace("{", "").replace("}", "") for piece in super().collect_usage_pieces(ctx)]


app = typer.Typer(
    name="tendonrod",
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
COMMANDS = {
    robots: (
        "tendonrod robots exonav-1 --torsion open_section",
        "tendonrod robots my-robot.toml --figure device.png --notch-pattern cut.dxf",
    ),
    shape: (
        "tendonrod shape exonav-1 --tension 0.7 --gravity -9.81,0,0",
        "tendonrod shape four-tendons.toml --tension 15 --tension 0 --tension 0 --tension 0 --json",
        "tendonrod shape exonav-1 --displacement 2.5 --jacobian displacements,insertion,tip_force",
        "tendonrod shape exonav-1 --tension 0.7 --gravity -9.81,0,0 --scene cord.toml --figure cord.png",
    ),
    batch: (
        "tendonrod batch exonav-1 table.csv --output results.csv",
        "tendonrod batch exonav-1 table.csv --output results.csv --scene cord.toml --threads 4 --json",
    ),
    motion: (
        "tendonrod ftl exonav-1 --target 0.7 --gravity -9.81,0,0 --output plan.csv",
        "tendonrod motion plan.csv --robot exonav-1 --gravity -9.81,0,0 --figure motion.png",
    ),
    ftl: (
        "tendonrod ftl exonav-1 --target 0.7 --gravity -9.81,0,0 --output plan.csv",
        "tendonrod ftl exonav-1 --target 0.7 --gravity -9.81,0,0 --freedom full --json",
    ),
    experiment: (
        "tendonrod experiment exonav-3 --tilt-deg 10 --tip-mass-g 0.5 --seed 1 --output trials",
        "tendonrod experiment exonav-1 --friction 0.1 --dropout 0.05 --figure trials.png",
    ),
    trial: (
        "tendonrod trial bench.csv --robot exonav-1 --output bench.nc --figure bench.png",
        "tendonrod trial track.csv --columns bench.toml --drive load-cell.csv --drive-offset 2.35",
    ),
    validate: (
        "tendonrod validate exonav-3-*.nc --output accuracy",
        "tendonrod validate bench.csv --robot exonav-1 --torsion homogenized --json",
    ),
    identify: (
        "tendonrod identify exonav-3-*.nc --free youngs_modulus,base_tilt,tip_mass --output fitted",
        "tendonrod identify bench.csv --robot exonav-1 --free base_pose --hold tip_mass=0.2 --json",
        "tendonrod identify --names exonav-3-s100.nc",
    ),
    phantom: (
        "tendonrod phantom anatomical --levels T8-L2 --view phantom.png",
        "tendonrod phantom printed --robot exonav-1 --export stl",
    ),
    navigate: (
        "tendonrod navigate",
        "tendonrod navigate --phantom anatomical --no-browser --port 0",
        "tendonrod navigate --bench virtual",
        "tendonrod navigate --host 0.0.0.0 --no-browser",
        "tendonrod navigate --script moves.csv --headless --output run",
    ),
    reach: (
        "tendonrod reach printed --output reach",
        "tendonrod reach anatomical --target ventral --target drg-left@T10 --json",
    ),
    session: (
        "tendonrod session run/record.jsonl --output page",
        "tendonrod session run/record.jsonl --output page --frames 0 --json",
    ),
    reproduce: ("tendonrod reproduce --output paper-report",),
}
RIG_COMMANDS = {
    rig_ftl: (
        "tendonrod rig ftl exonav-1 --target 0.7 --gravity -9.81,0,0 --trials 3 --seed 1 --output bench",
        "tendonrod rig ftl exonav-1 --target 0.7 --gravity -9.81,0,0 --profile paper --tracker-mass-g 0.5 --output out",
        "tendonrod rig ftl exonav-1 --target 0.7 --bench my-bench.toml --output bench",
    ),
    run: ("tendonrod rig run motion.csv --gravity -9.81,0,0 --output bench",),
    hold: (
        "tendonrod rig hold --tension 0.5 --duration 10 --insertion 0.5 --output bench",
        "tendonrod rig hold --tension 0.3 --duration 5 --bench my-bench.toml --output bench",
        "tendonrod rig hold --tension 0.3 --duration 5 --bench my-bench.toml --rehearse /dev/pts/3 --output rehearsal",
    ),
    retract: ("tendonrod rig retract --target 0.7 --bench my-bench.toml --output bench",),
    release: ("tendonrod rig release --bench my-bench.toml --output bench",),
    replay: ("tendonrod rig replay bench/trial-1.rec",),
    export: (
        "tendonrod rig export bench/trial-1.rec -o trial.nc",
        "tendonrod rig export bench/trial-1.rec -o trial.csv",
    ),
    design: ("tendonrod rig design exonav-1 --gravity -9.81,0,0 --compare --output loop",),
}
rig = typer.Typer(
    help="The bench, virtual or of devices: run, record, report.",
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _add(to: typer.Typer, commands: Mapping[Callable[..., None], Sequence[str]]) -> None:
    for command, examples in commands.items():
        to.command(cls=_Command, epilog="\b\nExamples:\n" + "\n".join(f"  {line}" for line in examples))(command)


_add(app, COMMANDS)
_add(rig, RIG_COMMANDS)
app.add_typer(rig, name="rig")


@rig.callback(
    invoke_without_command=True,
    epilog="\b\nExamples:\n  tendonrod rig ftl exonav-1 --target 0.7 --gravity -9.81,0,0 --trials 3 --output bench\n"
    "  tendonrod rig COMMAND --help",
)
def _rig(context: typer.Context) -> None:
    """The bench, virtual or of devices: run, record, report.

    The lead screw holds the tendon, the roller gear moves and turns the robot, a tracker sits at its tip; an interlock
    stands between every controller and the axes. Every sample is recorded as it comes. Without --bench the bench is
    virtual, faster than real time, and the same seed gives the same samples. Space or Esc: emergency stop. Ctrl-C:
    release the tension and end. Exit status 0: done; 1: a fault ended it; 2: bad input; 130: ended by Ctrl-C.
    """
    if context.invoked_subcommand is None:
        say(context.get_help())


def _version(wanted: bool) -> None:
    if wanted:
        from .. import __version__

        say(f"tendonrod {__version__}")
        raise typer.Exit()


@app.callback(
    invoke_without_command=True,
    epilog="\b\nExamples:\n  tendonrod robots\n  tendonrod shape exonav-1 --tension 0.7 --gravity -9.81,0,0\n"
    "  tendonrod COMMAND --help",
)
def _front(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    """Tendon-driven continuum robots: shapes, progressive motion and follow-the-leader plans.

    ROBOT is a preset (see: tendonrod robots) or the path of a TOML file of the same form. Vectors are in the world
    frame, written with commas and no spaces: -9.81,0,0. Exit status 0: done; 1: no equilibrium found; 2: bad input.
    """
    if context.invoked_subcommand is None:
        say(context.get_help())
