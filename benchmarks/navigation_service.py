"""The service of `tendonrod navigate` under load: states per second at each of several pages, latency, sizes.

A session with real mechanics is steered through a phantom by one page while the others watch, all through sockets of
this machine. The pages run in a process of their own, and as they share the machine with the server, what they cost is
part of the result. Latency is from sending a command to the arrival of the first state that moves.

    python benchmarks/navigation_service.py --pages 8 --seconds 20 --course pressed

Courses: "free" starts from the outer tube's usual place; "pressed" from the midline, tilted so that the robot winds on
to the cord, where it is pressed on, in the printed phantom until it is refused, and drawn back while the rest goes on.
"new" are states that tell a later step than the one before. Measured from the first state of a server that has loaded
its compiled code.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from websockets.asyncio.client import ClientConnection, connect

PRESSES = 20
STATE = '{"type":"state"'
MIDLINE = "[tube]\noffset_mm = 0\ndepth_mm = {depth}\ntilt_deg = 21\nlean_deg = 0\n"
DEPTH = {"printed": 5.7375, "anatomical": 8.625}  # mm, the middle of the dorsal gap
Arrival = tuple[float, int, int, bool]  # s, characters, index, whether the last command was refused


def main() -> None:
    options = argparse.ArgumentParser(description="The service of tendonrod navigate under load.")
    options.add_argument("--pages", type=int, default=8)
    options.add_argument("--seconds", type=float, default=20.0)
    options.add_argument("--phantom", choices=DEPTH, default="printed")
    options.add_argument("--course", choices=["free", "pressed"], default="pressed")
    given = options.parse_args()
    names = ("tendonrod", "numpy", "numba", "fastapi", "uvicorn", "websockets")
    print(f"{platform.machine()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}, Python", end=" ")
    print(platform.python_version(), *(f"{name} {version(name)}" for name in names), sep=", ")
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "tendonrod", "navigate", "--no-browser", "--port", "0", "--output", folder]
        pressed = MIDLINE.format(depth=DEPTH[given.phantom]) if given.course == "pressed" else ""
        scene = Path(folder) / "scene.toml"
        scene.write_text(f'phantom = "{given.phantom}"\n' + pressed)
        with subprocess.Popen([*command, "--scene", str(scene)], stdout=subprocess.PIPE, text=True) as server:
            assert server.stdout is not None
            url = server.stdout.readline().removeprefix("open ").strip().replace("http", "ws") + "ws"
            try:
                asyncio.run(measure(url, given.pages, given.seconds))
                print(f"server: {cpu(server.pid):.1f} s of processor time, {memory(server.pid):.0f} MB")
            finally:
                server.terminate()


async def measure(url: str, pages: int, seconds: float) -> None:
    """Connect, steer, print."""
    sockets = [await connect(url, max_queue=None) for _ in range(pages)]
    found: list[list[Arrival]] = [[] for _ in sockets]
    await take(sockets[0])
    await until(sockets[0], lambda state: state["index"] > 0)  # compiled code is loaded
    watching = [asyncio.ensure_future(watch(*each)) for each in zip(sockets, found, strict=True)]
    await steer(sockets[0], seconds)
    for each in watching:
        each.cancel()
    await asyncio.gather(*watching, return_exceptions=True)
    for k, arrivals in enumerate(found):
        report(f"page {k + 1}", arrivals, seconds)
    await asyncio.gather(*(each.close() for each in sockets))
    latencies = await presses(url)
    middle, high = 1e3 * np.quantile(latencies, [0.5, 0.95])
    print(f"command to moving state: median {middle:.0f} ms, 95 % {high:.0f} ms, most {1e3 * max(latencies):.0f} ms")


async def steer(socket: ClientConnection, seconds: float) -> None:
    """In, round and back, so that there is contact, 30 commands a second."""
    began, seq = time.monotonic(), 0
    while (at := time.monotonic() - began) < seconds:
        seq += 1
        await socket.send(jog(seq, 1.0 if at < 0.8 * seconds else -1.0, 0.1, 0.5))
        await asyncio.sleep(1 / 30)


def jog(seq: int, insertion: float, rotation: float, tension: float, hold: bool = True) -> str:
    what: dict[str, Any] = {"insertion": insertion, "rotation": rotation, "tension": tension}
    return json.dumps({"type": "jog", "seq": seq, "hold": hold, **what})


async def take(socket: ClientConnection) -> None:
    """Control, as soon as nobody else has it."""
    for _ in range(100):
        await socket.send('{"type":"take"}')
        said = {"type": ""}
        while said["type"] != "error":
            said = json.loads(await socket.recv())
            if said["type"] == "control" and said["you"]:
                return
        await asyncio.sleep(0.1)
    raise TimeoutError("somebody else keeps control")


async def watch(socket: ClientConnection, found: list[Arrival]) -> None:
    """Each state, until cancelled."""
    async for text in socket:
        if str(text).startswith(STATE):
            index, _, _ = str(text)[len(STATE) + 9 : len(STATE) + 30].partition(",")
            found += [(time.monotonic(), len(text), int(index), '"blocked":""' not in str(text))]


def report(name: str, arrivals: list[Arrival], seconds: float) -> None:
    times, sizes, indices, refused = np.array(arrivals).T
    gaps = 1e3 * np.diff(times)
    new = np.count_nonzero(np.diff(indices) > 0) + 1
    print(
        f"{name}: {len(times) / seconds:.1f} states/s, {new / seconds:.1f} new, {100 * refused.mean():.0f} % refused, "
        f"gaps median {np.median(gaps):.1f} ms, 99 % {np.quantile(gaps, 0.99):.0f} ms, most {gaps.max():.0f} ms, "
        f"{sizes.mean():.0f} bytes, at most {sizes.max():.0f}"
    )


async def presses(url: str) -> list[float]:
    """Seconds from a key's press to the first moving state, with the page that presses alone."""
    found = []
    async with connect(url, max_queue=None) as socket:
        await take(socket)
        for seq in range(PRESSES):
            await until(socket, lambda state: not state["moving"])
            began = time.monotonic()
            await socket.send(jog(2 * seq, 0.0, 0.2, 0.0))
            await until(socket, lambda state: state["moving"])
            found.append(time.monotonic() - began)
            await socket.send(jog(2 * seq + 1, 0.0, 0.0, 0.0, hold=False))
            await asyncio.sleep(0.2)
    return found


async def until(socket: ClientConnection, fits: Any) -> None:
    async for text in socket:
        if str(text).startswith(STATE) and fits(json.loads(text)):
            return


def cpu(process: int) -> float:
    """Processor time (s) that a process has used, Linux."""
    with open(f"/proc/{process}/stat", encoding="ascii") as file:
        fields = file.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def memory(process: int) -> float:
    """Memory (MB) that a process holds, Linux."""
    with open(f"/proc/{process}/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


if __name__ == "__main__":
    main()
