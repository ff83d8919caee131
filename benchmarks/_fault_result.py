"""What a trial of bench_faults.py says of itself."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from tendonrod.rig.virtual.bench import VirtualBench


@dataclass(frozen=True, kw_only=True)
class Result:
    """What became of a trial.

    found: s after the injection, NaN if never; bound: s that it may take; fault: the first one; kinds: of all. peak: N,
    highest true tension; limit, allowed: N, without and with what one period may add. ended: "slack", "held" or
    "moving"; duration: s of the bench; wrong: what is not as it should be.
    """

    item: int
    case: str
    found: float
    bound: float
    fault: str
    kinds: tuple[str, ...]
    peak: float
    limit: float
    allowed: float
    ended: str
    duration: float
    wrong: tuple[str, ...]


@contextmanager
def followed(bench: VirtualBench) -> Iterator[list[float]]:
    """True tensions (N) after every step of the bench's clock."""
    world, tensions = bench.world, [bench.world.tension]
    advance = world.advance

    def watched(to: float) -> None:
        advance(to)
        tensions.append(world.tension)

    world.advance = watched
    try:
        yield tensions
    finally:
        world.advance = advance
