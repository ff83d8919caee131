"""Samples, commands and faults for records: any that hypothesis can think of, and plain ones by number."""

import struct
from dataclasses import fields, is_dataclass

from hypothesis import strategies as st

from tendonrod.rig.interfaces import AxisState, Command, Force, PoseFrame, Sample
from tendonrod.rig.states import Fault, FaultKind, Reaction, State

NAN = float("nan")

numbers = st.one_of(
    st.floats(),
    st.integers(0, 2**64 - 1).map(lambda bits: struct.unpack("<d", struct.pack("<Q", bits))[0]),  # every NaN there is
)
words = st.one_of(st.sampled_from(["", "tip", "MISSING"]), st.text(st.characters(codec=None), max_size=8))
axes = st.builds(
    AxisState,
    time=numbers,
    position=numbers,
    velocity=numbers,
    homed=st.booleans(),
    at_limit=st.sampled_from([-1, 0, 1]),
    stalled=st.booleans(),
)
frames = st.builds(
    PoseFrame,
    time=numbers,
    frame=st.integers(-(2**63), 2**63 - 1),
    tool=words,
    position=st.tuples(*3 * [numbers]),
    quaternion=st.tuples(*4 * [numbers]),
    quality=numbers,
    state=words,
)
samples = st.builds(
    Sample,
    time=numbers,
    screw=axes,
    translation=axes,
    rotation=axes,
    force=st.builds(Force, time=numbers, tension=numbers, saturated=st.booleans()),
    frames=st.lists(frames, max_size=3).map(tuple),
)
commands = st.builds(Command, screw=numbers, translation=numbers, rotation=numbers, target=numbers)
faults = st.builds(
    Fault,
    kind=st.sampled_from(FaultKind),
    time=numbers,
    reaction=st.sampled_from(Reaction),
    value=numbers,
    limit=numbers,
    where=words,
)
periods = st.tuples(samples, commands, st.sampled_from(State), st.none() | faults)


def bits(value):
    """``value`` in a form that is equal only for the same types with the same bits."""
    if is_dataclass(value):
        return type(value), tuple(bits(getattr(value, each.name)) for each in fields(value))
    if isinstance(value, tuple):
        return tuple(map(bits, value))
    return type(value), struct.pack("<d", value) if isinstance(value, float) else value


def plain(i: int, time: float | None = None) -> Sample:
    """Sample number i (its tension) at 1000 Hz, with a frame of one tool in every 25th."""
    t = i / 1000 if time is None else time
    frame = PoseFrame(
        time=t - 0.03, frame=i // 25, tool="tip", position=(0.1, -0.2, t), quaternion=(1.0, 0.0, 0.0, 0.0), quality=NAN
    )
    return Sample(
        time=t,
        screw=AxisState(time=t, position=0.9e-3 * t, velocity=0.9e-3),
        translation=AxisState(time=t, position=1e-3 * t, velocity=1e-3),
        rotation=AxisState(time=t, position=-t, velocity=-1.0),
        force=Force(time=t, tension=float(i)),
        frames=() if i % 25 else (frame,),
    )


COMMAND = Command(screw=1e-3, translation=1.1e-3, rotation=-1.0, target=0.7)
FAULT = Fault(kind=FaultKind.TENSION, time=0.01, reaction=Reaction.RELEASE, value=1.5, limit=1.2, where="load cell")
