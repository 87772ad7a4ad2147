"""Who makes the blocks: this process, processes of this machine, or a cluster."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar


class Job(Protocol):
    """What one worker does in one piece; it can be sent to another process."""

    @property
    def name(self) -> str:
        """A name that no other job of the campaign has."""

    def make(self) -> list[Any]:
        """Does it; the results."""


J = TypeVar("J", bound=Job)


@dataclass(frozen=True, slots=True)
class Done(Generic[J]):
    """A job that is over.

    Attributes:
        job: The job.
        made: All its results; None if its worker died.
    """

    job: J
    made: list[Any] | None


class Crew(Protocol[J]):
    """Does jobs."""

    @property
    def size(self) -> int:
        """The number of workers."""

    @property
    def has_room(self) -> bool:
        """Whether another job should be handed over."""

    def start(self, job: J) -> None:
        """Hands a job over."""

    def wait(self) -> list[Done[J]]:
        """Waits until at least one of the jobs is over; none if none was handed over.

        Raises:
            InputError: A worker cannot work, or cannot write.
        """

    def close(self) -> None:
        """Ends all workers at once, also in the middle of a job."""


def work_off(crew: Crew[J], jobs: Iterable[J], take: Callable[[Done[J]], Iterable[J]]) -> None:
    """Has all jobs done, and lets the crew go.

    Args:
        crew: Who does them.
        jobs: The jobs, the most urgent first.
        take: Takes a job that is over, and gives those that are to be done in its place.

    Raises:
        InputError: A worker cannot work, or cannot write.
    """
    try:
        waiting = deque(jobs)
        busy = 0
        while waiting or busy:
            while waiting and crew.has_room:
                crew.start(waiting.popleft())
                busy += 1
            for done in crew.wait():
                busy -= 1
                waiting.extendleft(take(done))
    finally:
        crew.close()


def made_by(job: Job) -> list[Any]:
    """The results of a job: what a worker does."""
    return job.make()


class Here(Generic[J]):
    """This process: for tests, and for looking into a run with a debugger."""

    size = 1

    def __init__(self) -> None:
        self._jobs: list[J] = []

    @property
    def has_room(self) -> bool:
        """Whether no job is waiting."""
        return not self._jobs

    def start(self, job: J) -> None:
        """Keeps the job for `wait`."""
        self._jobs.append(job)

    def wait(self) -> list[Done[J]]:
        """Does the jobs."""
        jobs, self._jobs = self._jobs, []
        return [Done(job, made_by(job)) for job in jobs]

    def close(self) -> None:
        """Does nothing."""
