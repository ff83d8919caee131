"""Arguments and options that several commands of `tendonrod rig` share."""

from __future__ import annotations

from typing import Annotated, Any

import typer

EARLIEST = 0.06  # insertion at which a motion may end or begin: the tendon is taken up at 0.05


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
Slicer = Annotated[
    str | None,
    option("PORT", "Show shape and tracker in 3D Slicer, by OpenIGTLink; 18944 is usual. Needs pyigtl.", "--slicer"),
]
Rehearse = Annotated[
    str | None,
    option("PORT", "Devices: on the emulated board there, without tracker; python -m tendonrod.rig.firmware runs one."),
]
Target = Annotated[str, option("N", "Tension at full insertion, N, > 0.", "--target")]
Profile = Annotated[
    str,
    option(
        "NAME",
        "Of the tension: plan, of tendonrod ftl; polynomial, the quadratic that fits it; paper, the paper's own.",
        "--profile",
    ),
]
ScrewRate = Annotated[str, option("MM/S", "At which the screw pays the tendon out, or winds it in.")]
RecordName = Annotated[str, typer.Argument(metavar="RECORD", hidden=True)]
