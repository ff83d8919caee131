"""Exchanges with a motor board over a serial port: one command, one answer, by sequence number, in bounded time.

A command that only asks, or that may be given twice, is repeated (`BoardLink.ask`), each time with a new sequence
number. MOVE and HOME are carried out at most once (`BoardLink.tell`): a repeated MOVE would set a velocity that was
computed for a moment that has passed, after the board may long have stopped. Where the answer to one of them is
missing, the board is asked for its state, which names the newest command that it carried out: so it is known whether it
was.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic

from .board_protocol import ANSWER_LONGEST, REFUSALS, SEQUENCES, Answer, BoardState, DamagedLine, answer, command, state
from .interfaces import DeviceError
from .serial_port import close_port, open_port


class Refused(DeviceError):
    """A command that the board refuses; ``code`` as in board_protocol.REFUSALS."""

    def __init__(self, port: str, name: str, code: str) -> None:
        super().__init__(f"{port}: {name} refused: {REFUSALS.get(code, code)}")
        self.code = code


@dataclass(kw_only=True, slots=True)
class LinkCounts:
    """What happened on the line so far."""

    commands: int = 0
    repeated: int = 0  # commands that were asked again
    unanswered: int = 0
    damaged: int = 0  # lines from the board that were none
    strange: int = 0  # whole answers, to no command that waits
    lost: int = 0  # MOVE or HOME that the board never carried out


@dataclass(frozen=True, kw_only=True, slots=True)
class Reply:
    """An answer and when the command went out and the answer was complete, s of the bench's clock."""

    answer: Answer
    asked: float
    answered: float

    @property
    def state(self) -> BoardState:
        """The state that the answer holds. Raises `DeviceError` for words of another protocol."""
        try:
            return state(self.answer.words)
        except DamagedLine as error:
            raise DeviceError(f"the board answers {' '.join(self.answer.words)[:80]!r}: {error}") from None


class BoardLink:
    """A port that is open, and the exchanges over it. ``now``: the bench's clock, s; ``timeout``: s for one answer."""

    def __init__(self, port: str, baud: int, *, now: Callable[[], float], timeout: float, tries: int) -> None:
        self.port, self.timeout, self.tries = port, timeout, tries
        self.counts = LinkCounts()
        self._now = now
        self._sequence = 0
        self._received = b""
        self._serial = open_port(port, baud)

    def close(self) -> None:
        """Let the port go; a second time does nothing."""
        close_port(self._serial)

    def ask(self, name: str, *arguments: int) -> Reply:
        """Give a command that may be given twice, until it is answered. Raises `DeviceError`."""
        for attempt in range(self.tries):
            self.counts.repeated += attempt > 0
            reply = self._exchange(self._next(), name, arguments, self.timeout)
            if reply is not None:
                return self._accepted(name, reply)
        raise DeviceError(f"{self.port}: no answer from the board to {name}, asked {self.tries} times")

    def tell(self, name: str, *arguments: int) -> Reply | None:
        """Give a command at most once; None where the board never got it. Raises `DeviceError`."""
        sequence = self._next()
        reply = self._exchange(sequence, name, arguments, self.timeout)
        if reply is not None:
            return self._accepted(name, reply)
        reply = self.ask("READ")
        if reply.state.done == sequence:
            return reply
        self.counts.lost += 1
        return None

    def _next(self) -> int:
        self._sequence = (self._sequence + 1) % SEQUENCES
        return self._sequence

    def _accepted(self, name: str, reply: Reply) -> Reply:
        if not reply.answer.is_ok:
            raise Refused(self.port, name, " ".join(reply.answer.words))
        return reply

    def _exchange(self, sequence: int, name: str, arguments: tuple[int, ...], timeout: float) -> Reply | None:
        """Send once and wait for the answer; None where there is none, or the board could not read the command."""
        self.counts.commands += 1
        asked = self._now()
        # The newline before it ends whatever noise may have left in the board's buffer.
        self._write(b"\n" + command(sequence, name, *arguments))
        deadline = monotonic() + timeout
        while (found := self._next_answer(deadline)) is not None:
            if found.sequence == sequence:
                return Reply(answer=found, asked=asked, answered=self._now())
            if found.sequence is None:
                break  # the board got a damaged line: most likely this one
            self.counts.strange += 1  # an answer that came too late
        self.counts.unanswered += 1
        return None

    def _next_answer(self, deadline: float) -> Answer | None:
        while (line := self._next_line(deadline)) is not None:
            try:
                return answer(line)
            except DamagedLine:
                self.counts.damaged += 1
        return None

    def _next_line(self, deadline: float) -> bytes | None:
        """The next line without its newline; None at the deadline, also where noise without end comes in.

        Of what comes in only the newest is kept: the answer that is waited for is the last thing a board sends.
        """
        while b"\n" not in self._received:
            if monotonic() >= deadline:
                return None
            self._received = (self._received + self._read())[-ANSWER_LONGEST:]
        line, _, self._received = self._received.partition(b"\n")
        return line

    def _read(self) -> bytes:
        try:
            return self._serial.read(1) + self._serial.read(self._serial.in_waiting)
        except (OSError, TypeError, ValueError) as error:  # unplugged, or closed meanwhile
            raise DeviceError(f"{self.port}: the board is gone ({error})") from None

    def _write(self, line: bytes) -> None:
        from serial import SerialTimeoutException

        try:
            self._serial.write(line)
        except SerialTimeoutException:  # nobody takes it, or this process was held up: no answer will tell which
            return
        except (OSError, TypeError, ValueError) as error:
            raise DeviceError(f"{self.port}: the board is gone ({error})") from None
