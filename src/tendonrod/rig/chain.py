"""`Chain`: tasks one after another, as one task in one record."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import InvalidInput
from .interfaces import STILL, Command, Sample, Task


class Chain:
    """Tasks in their order; each begins where the one before has ended. Raises `InvalidInput` for no task."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        if not tasks:
            raise InvalidInput("tasks", tasks, "one or more")
        self.tasks, self._done = tuple(tasks), 0
        self.name = ", then ".join(task.name for task in self.tasks)

    @property
    def task(self) -> Task:
        """The one that is being done, in the end the last."""
        return self.tasks[min(self._done, len(self.tasks) - 1)]

    @property
    def phase(self) -> str:
        """What it is at, "" where it does not say."""
        return getattr(self.task, "phase", "")

    @property
    def is_done(self) -> bool:
        """Whether all are."""
        return self._done == len(self.tasks)

    @property
    def progress(self) -> float:
        """Share that is done, 0 to 1; every task counts as much."""
        return 1.0 if self.is_done else (self._done + self.task.progress) / len(self.tasks)

    def update(self, sample: Sample, dt: float) -> Command:
        """Ask the task whose turn it is."""
        if self.is_done:
            return STILL
        command = self.task.update(sample, dt)
        self._done += self.task.is_done
        return command
