"""What the benchmarks of the bench share: robot, processes with progress, and the lines that name the machine."""

from __future__ import annotations

import os
import platform
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import cache
from multiprocessing import get_context
from typing import TypeVar

import numpy as np

import tendonrod
from tendonrod import Robot

GRAVITY = (-9.81, 0.0, 0.0)
PROCESSES = 2
EVERY = 5.0  # s, between two lines of progress

Job = TypeVar("Job")
Answer = TypeVar("Answer")


@cache
def robot() -> Robot:
    """Prototype 1 with the torsion that benches use."""
    return tendonrod.load_robot("exonav-1").replace(torsion="homogenized")


def machine() -> str:
    """Machine and versions, and how busy it was when the benchmark began."""
    load = ", ".join(f"{each:.1f}" for each in os.getloadavg())
    versions = f"tendonrod {tendonrod.__version__}, Python {platform.python_version()}, NumPy {np.__version__}"
    return f"{platform.machine()}, {os.cpu_count()} cores, load {load}; {versions}"


def spread(work: Callable[[Job], Answer], jobs: Sequence[Job], processes: int = PROCESSES) -> Iterator[Answer]:
    """Answers in any order, from forked processes, which have what was cached before; progress goes to stderr."""
    began = shown = time.monotonic()
    with ProcessPoolExecutor(processes, mp_context=get_context("fork"), initializer=_ignore_interrupts) as pool:
        futures = [pool.submit(work, job) for job in jobs]
        try:
            for done, future in enumerate(as_completed(futures), 1):
                yield future.result()
                now = time.monotonic()
                if now - shown > EVERY or done == len(jobs):
                    shown, left = now, (now - began) / done * (len(jobs) - done)
                    print(
                        f"{done} of {len(jobs)} in {now - began:.0f} s, {left:.0f} s left", file=sys.stderr, flush=True
                    )
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent ends the processes
