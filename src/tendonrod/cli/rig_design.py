"""What `tendonrod rig design` prints, and the runs that it compares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from . import output as out
from .rig_page import plain

if TYPE_CHECKING:
    from ..plot.loop_design import Trace
    from ..rig.design import Designed, Loop
    from ..robot import Robot


def compared(robot: Robot, tension: float, gravity: Any, pace: float) -> dict[str, Trace]:
    """A virtual trial with PI and one with PI + feed-forward; their records are not kept."""
    from pathlib import Path
    from tempfile import TemporaryDirectory

    from ..plot.loop_design import Trace
    from ..rig.inserted import way_out
    from ..rig.profiles import profile
    from ..rig.trials import follow_leader
    from ..rig.virtual.setup import VirtualSetup

    setup, found = VirtualSetup(robot=robot, gravity=gravity), {}
    soft = setup.tendon_length / setup.tendon_stiffness
    wanted = profile("plan", robot, tension, gravity, compliance=soft)
    with TemporaryDirectory() as folder, out.progress_bar("comparing") as watch:
        for k, name in enumerate(("PI", "PI + feed-forward")):
            watch(k, 2)
            path = Path(folder) / f"{k}.rec"
            done = follow_leader(setup, wanted, tension, path, screw_rate=pace, feed_forward=bool(k))
            way = done.record.samples[way_out(done.record)]
            z = way["translation"]["position"]
            found[name] = Trace(
                time=way["time"] - way["time"][0], insertion=z / robot.section.L, tension=way["force"]["tension"],
                target=way["command"]["target"], velocity=way["command"]["translation"],
            )  # fmt: skip
    return found


def design_text(found: Designed, rate: float, command: str) -> str:
    """Both pairs of gains with what they leave, as text; rate: of the screw, m/s."""
    title = f"{found.robot.name}, torsion {found.robot.torsion}, at {found.tension:g} N, gravity "
    title += f"({', '.join(f'{x:g}' for x in found.gravity)}) m/s2, tendon {1e3 * found.compliance:g} mm/N"
    ends = found.insertions[0], found.insertions[-1]
    columns = (
        "gains", "kP\n(mm/s)/N", "kI\n(mm/s2)/N", *(f"phase margin\nat {end:g}, deg" for end in ends),
        "error as the screw\nstarts, mN",
    )  # fmt: skip
    rows = [_row(name, loops, rate) for name, loops in (("paper", found.paper), ("suggested", found.suggested))]
    legend = f"Error: the largest after the screw has started at {1e3 * rate:g} mm/s in no time, wherever it is worst."
    return "\n\n".join([out.heading(title), out.table(columns, rows, words=(0,)), legend, f"On the bench: {command}"])


def design_dict(found: Designed, rate: float, command: str) -> dict[str, Any]:
    """The same for JSON, SI, angles in degrees, with the margins at every insertion."""
    return {
        "robot": found.robot.name,
        "torsion": found.robot.torsion,
        "tension": found.tension,
        "gravity": list(found.gravity),
        "tendon_compliance": found.compliance,
        "screw_rate": rate,
        "paper": _gains(found.paper, found.insertions, rate),
        "suggested": _gains(found.suggested, found.insertions, rate),
        "command": command,
    }


def _row(name: str, loops: Sequence[Loop], rate: float) -> list[str]:
    from ..rig.design import largest_error, phase_margin

    phases = [f"{phase_margin(loop):.0f}" for loop in (loops[0], loops[-1])]
    error = max(largest_error(loop, rate) for loop in loops)
    return [name, f"{1e3 * loops[0].kp:.3g}", f"{1e3 * loops[0].ki:.3g}", *phases, f"{1e3 * error:.1f}"]


def _gains(loops: Sequence[Loop], insertions: Sequence[float], rate: float) -> dict[str, Any]:
    from ..rig.design import largest_error, margins

    rows = [
        {"insertion": eta, "compliance": loop.compliance, "largest_error": largest_error(loop, rate)}
        | {key: plain(value) for key, value in asdict(margins(loop)).items()}
        for eta, loop in zip(insertions, loops, strict=True)
    ]
    return {"kp": loops[0].kp, "ki": loops[0].ki, "loops": rows}
