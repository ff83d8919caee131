"""What drivers answer, held to its types: a reading that is none is the driver's error, and must not pass for one."""

from __future__ import annotations

from dataclasses import replace

from .interfaces import AxisState, DeviceError, Force, PoseFrame


def as_state(answer: object) -> AxisState:
    """``answer`` with plain floats. Raises `DeviceError` where it is no state of an axis."""
    if not isinstance(answer, AxisState):
        raise DeviceError(f"answered {_shown(answer)}, must be the state of an axis")
    if type(answer.time) is type(answer.position) is type(answer.velocity) is float:
        return answer
    time, position, velocity = map(_number, (answer.time, answer.position, answer.velocity))
    return replace(answer, time=time, position=position, velocity=velocity)


def as_force(answer: object) -> Force:
    """``answer`` with plain floats. Raises `DeviceError` where it is no reading of a load cell."""
    if not isinstance(answer, Force):
        raise DeviceError(f"answered {_shown(answer)}, must be a reading of a load cell")
    if type(answer.time) is type(answer.tension) is float:
        return answer
    return replace(answer, time=_number(answer.time), tension=_number(answer.tension))


def as_frames(answer: object) -> tuple[PoseFrame, ...]:
    """``answer`` as it is. Raises `DeviceError` where it is no frames of a tracker."""
    if isinstance(answer, tuple) and all(isinstance(each, PoseFrame) for each in answer):
        return answer
    raise DeviceError(f"answered {_shown(answer)}, must be the frames of a tracker")


def _number(value: object) -> float:
    try:
        return float(value)  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError):
        raise DeviceError(f"answered {_shown(value)}, must be a number") from None


def _shown(answer: object) -> str:
    return repr(answer)[:60]
