"""An NDI Aurora in a process of its own, over a pty or TCP: the part of its protocol that ndicapi and the driver use.

python aurora_emulator.py '{"transport": "pty", ...}' with the fields of `Script`; prints {"port", "zero", "rate"} in
one line (zero: monotonic time of frame 0) and runs until its standard input is closed. Written from the protocol as
ndicapi's parser has it, with a CRC of its own; it shares no code with the driver.
"""

from __future__ import annotations

import json
import math
import os
import random
import select
import socket
import subprocess
import sys
import termios
import threading
import time
import tty
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field

BAUDS = {"0": termios.B9600, "3": termios.B38400, "5": termios.B115200, "A": termios.B230400}
VERSION = "Aurora Control Firmware\nNDI S/N: E0-00042\nCharacterization Date: 01/01/26\nFreeze Tag: Aurora Rev 010"
OCCUPIED, INITIALISED, ENABLED, OUT, PARTLY_OUT, BROKEN = 0x01, 0x10, 0x20, 0x40, 0x80, 0x100


@dataclass
class Script:
    """What the tracker is and what happens to it. Ranges are [first, last] frame since power-up, _at since TSTART."""

    transport: str = "pty"
    rate: float = 40.0
    tools: list = field(default_factory=lambda: [[0x0A, 1, 0]])  # handle, port, channel
    version: str = VERSION
    baud: str = "0"  # at which it begins, by the digit of COMM
    missing: list = field(default_factory=list)
    out: list = field(default_factory=list)
    partly_out: list = field(default_factory=list)
    broken: list = field(default_factory=list)
    poor: list = field(default_factory=list)  # error indicator of 8 mm
    skipped: list = field(default_factory=list)  # frames that are never offered
    garble: float = 0.0  # share of replies to TX with a bit flipped
    truncate: float = 0.0  # share of replies to TX that lack their end
    refuse: dict = field(default_factory=dict)  # command: error code of two digits
    mute: str = ""  # command from which on it says nothing
    mute_at: float = math.inf  # from which on it says nothing
    die_at: float = math.inf  # at which it goes away
    flood_at: float = math.inf  # at which it sends noise without end
    unplug_at: float = math.inf  # from which on the first tool is gone
    echo: bool = False  # no tracker at all: sends back what it gets
    late: float = 0.0  # s that an answer to TX takes
    log: str = ""  # file that gets each command
    seed: int = 0


def pose(handle: int, frame: int) -> tuple[tuple[float, ...], tuple[float, ...], float]:
    """Quaternion (w, x, y, z), position (mm) and error (mm) of a tool in a frame: on a helix, turning about z."""
    a = 0.02 * frame + handle
    return (
        (math.cos(a / 2), 0.0, 0.0, math.sin(a / 2)),
        (30 * math.cos(a), -30 * math.sin(a), -100 - 0.01 * frame),
        0.12,
    )


def crc16(data: bytes) -> int:
    """CRC of x^16 + x^15 + x^2 + 1, reflected, bit by bit."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0xA001 if crc & 1 else 0)
    return crc


class Tracker:
    """State of the tracker and its answers."""

    def __init__(self, script: Script) -> None:
        self.script, self.random = script, random.Random(script.seed)
        self.zero, self.baud, self.next_baud, self.is_mute = time.monotonic(), script.baud, "", False
        self.tools = {handle: [port, channel, OCCUPIED] for handle, port, channel in script.tools}
        self.power_up()

    def power_up(self) -> None:
        self.is_ready = self.is_tracking = False
        self.first = math.inf
        for tool in self.tools.values():
            tool[2] = OCCUPIED

    @property
    def frame(self) -> int:
        newest = int((time.monotonic() - self.zero) * self.script.rate)
        while within(newest, self.script.skipped):
            newest -= 1
        return newest

    @property
    def tracked(self) -> float:  # frames since TSTART
        return self.frame - self.first

    def answer(self, line: bytes) -> bytes:
        """The reply to a command, with its CRC and carriage return; nothing where it is mute."""
        script = self.script
        text = line.decode("ascii", "replace")
        name, colon, rest = text.partition(":") if ":" in text else text.partition(" ")
        if script.log:
            with open(script.log, "a") as log:
                log.write(text + "\n")
        self.is_mute = self.is_mute or name == script.mute or self.tracked >= script.mute_at
        if self.is_mute:
            return b""
        if colon == ":" and f"{crc16(line[:-4]):04X}".encode() != line[-4:]:
            return self.sealed("ERROR04")
        rest = rest[:-4] if colon == ":" else rest
        if name in script.refuse:
            return self.sealed("ERROR" + script.refuse[name])
        does = getattr(self, "do_" + name.lower(), None)
        time.sleep(script.late if name == "TX" else 0.0)
        reply = self.sealed(does(rest) if does else "ERROR01")
        return self.damaged(reply) if name == "TX" else reply

    def damaged(self, reply: bytes) -> bytes:
        if self.random.random() < self.script.garble:
            at = self.random.randrange(len(reply) - 1)
            flipped = reply[at] ^ (1 << self.random.randrange(7))
            reply = reply[:at] + bytes([flipped]) + reply[at + 1 :]
        if self.random.random() < self.script.truncate:
            reply = reply[: self.random.randrange(len(reply))]
        return reply

    @staticmethod
    def sealed(text: str) -> bytes:
        return text.encode() + f"{crc16(text.encode()):04X}\r".encode()

    def do_init(self, _: str) -> str:
        self.power_up()
        self.is_ready = True
        return "OKAY"

    def do_ver(self, _: str) -> str:
        return self.script.version

    def do_getinfo(self, name: str) -> str:
        return f"{name}=010.002"

    def do_comm(self, setting: str) -> str:
        if setting[:1] not in BAUDS:
            return "ERROR06"
        self.next_baud = setting[0]
        return "OKAY"

    def do_phsr(self, kind: str) -> str:
        if not self.is_ready:
            return "ERROR10"
        wanted = {"00": lambda _: True, "01": lambda _: False, "02": lambda s: not s & INITIALISED}
        wanted |= {"03": lambda s: s & INITIALISED and not s & ENABLED, "04": lambda s: s & ENABLED}
        # The second sensor of a plug shows once the first is initialised.
        shown = {h: t for h, t in self.tools.items() if t[1] == 0 or self.first_of(t[0])[2] & INITIALISED}
        listed = [f"{h:02X}{t[2]:03X}" for h, t in shown.items() if wanted[kind](t[2])]
        return f"{len(listed):02X}" + "".join(listed)

    def first_of(self, port: int) -> list:
        return next(tool for tool in self.tools.values() if tool[:2] == [port, 0])

    def do_phinf(self, rest: str) -> str:
        handle, option = int(rest[:2], 16), int(rest[2:], 16)
        port, channel, status = self.tools[handle]
        basic = f"{'02000000'}{'NDI':<12}{'001'}{0x34000000 + handle:08X}{status & 0xFF:02X}"
        place = f"{'00000000'}10{port:02d}{channel:02X}"
        return basic * bool(option & 1) + place * bool(option & 0x20)

    def do_phf(self, rest: str) -> str:
        return "OKAY" if int(rest, 16) in self.tools else "ERROR2B"

    def do_pvwr(self, rest: str) -> str:
        return "OKAY" if int(rest[:2], 16) in self.tools and len(rest) == 2 + 4 + 128 else "ERROR07"

    def do_pinit(self, rest: str) -> str:
        self.tools[int(rest, 16)][2] |= INITIALISED
        return "OKAY"

    def do_pena(self, rest: str) -> str:
        self.tools[int(rest[:2], 16)][2] |= ENABLED
        return "OKAY"

    def do_tstart(self, _: str) -> str:
        self.is_tracking, self.first = True, min(self.first, self.frame)
        return "OKAY"

    def do_tstop(self, _: str) -> str:
        was, self.is_tracking = self.is_tracking, False
        return "OKAY" if was else "ERROR0C"

    def do_tx(self, _: str) -> str:
        if not self.is_tracking:
            return "ERROR0C"
        frame, first = self.frame, next(iter(self.tools))
        enabled = [handle for handle, tool in self.tools.items() if tool[2] & ENABLED]
        said = [self.said(handle, frame, handle == first) for handle in enabled]
        return f"{len(said):02X}" + "".join(said) + "0000"

    def said(self, handle: int, frame: int, is_first: bool) -> str:
        script, status = self.script, self.tools[handle][2]
        if is_first and self.tracked >= script.unplug_at:
            return f"{handle:02X}UNOCCUPIED\n"
        for ranges, bit in ((script.out, OUT), (script.partly_out, PARTLY_OUT), (script.broken, BROKEN)):
            status |= bit if within(frame, ranges) else 0
        if status & (OUT | BROKEN) or within(frame, script.missing):
            return f"{handle:02X}MISSING{status:08X}{frame:08X}\n"
        quaternion, position, error = pose(handle, frame)
        error = 8.0 if within(frame, script.poor) else error
        shown = "".join(f"{round(1e4 * q):+06d}" for q in quaternion)
        shown += "".join(f"{round(1e2 * x):+07d}" for x in position) + f"{round(1e4 * error):+06d}"
        return f"{handle:02X}{shown}{status:08X}{frame:08X}\n"


def within(frame: int, ranges: list) -> bool:
    return any(first <= frame <= last for first, last in ranges)


def serve(tracker: Tracker, read_fd: int, write, speed) -> None:
    """Answer until the other side, or the script, ends it."""
    script, waiting = tracker.script, b""
    while tracker.tracked < script.die_at:
        if tracker.is_tracking and tracker.tracked >= script.flood_at:
            write(bytes(tracker.random.choices(range(65, 91), k=1500)))  # ndicapi has room for 2 KB
            time.sleep(0.001)
            continue
        if not select.select([read_fd], [], [], 0.02)[0]:
            continue
        try:
            got = os.read(read_fd, 4096)
        except OSError:  # a pty that nobody has open yet
            time.sleep(0.01)
            continue
        if not got:
            return
        waiting += got
        while b"\r" in waiting:
            line, _, waiting = waiting.partition(b"\r")
            reply = line + b"\r" if script.echo else tracker.answer(line)
            if speed() not in (None, BAUDS[tracker.baud]):
                reply = bytes(byte ^ 0x55 for byte in reply)  # what a wrong speed makes of it
            write(reply)
            if tracker.next_baud and reply:
                tracker.baud, tracker.next_baud = tracker.next_baud, ""


def over_pty(tracker: Tracker) -> None:
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    tell(tracker, os.ttyname(theirs))
    os.close(theirs)

    def write(data: bytes) -> None:
        with suppress(OSError):
            os.write(ours, data)

    serve(tracker, ours, write, lambda: termios.tcgetattr(ours)[5])


def over_tcp(tracker: Tracker) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        tell(tracker, f"tcp://127.0.0.1:{listening.getsockname()[1]}")
        while tracker.tracked < tracker.script.die_at:
            client, _ = listening.accept()
            with client, suppress(OSError):
                serve(tracker, client.fileno(), client.sendall, lambda: None)


def tell(tracker: Tracker, port: str) -> None:
    print(json.dumps({"port": port, "zero": tracker.zero, "rate": tracker.script.rate}), flush=True)


@contextmanager
def emulated(**script):
    """A tracker in a process of its own for the length of a with block: its port, zero and rate, and its process."""
    wanted = json.dumps(asdict(Script(**script)))
    with subprocess.Popen(
        [sys.executable, __file__, wanted], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield {**json.loads(process.stdout.readline()), "process": process}
        finally:
            process.kill()


def main() -> None:
    tracker = Tracker(Script(**json.loads(sys.argv[1])))

    threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()  # ends with its parent
    {"pty": over_pty, "tcp": over_tcp}[tracker.script.transport](tracker)


if __name__ == "__main__":
    main()
