"""Workers that are processes of this machine.

Each worker is a pool of one process, so that it is known which job a process had that died. The
processes are started afresh, not forked: a fork copies locks and threads in any state.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any, Final, Generic

from ntagen import system
from ntagen.errors import InputError
from ntagen.experiment.crew import Done, J, Job, made_by

_MOST_FAILED_STARTS: Final = 2

_MAIN: Final = "MainProcess"
"""The name that Python gives to a process that no other Python has started."""


class LocalCrew(Generic[J]):
    """Worker processes.

    Args:
        count: How many.

    Raises:
        InputError: This is a worker itself: the main program starts its work when it is imported.
    """

    def __init__(self, count: int) -> None:
        require_main_process()
        self._idle = [_Worker() for _ in range(count)]
        self._busy: dict[Future[list[Any]], tuple[_Worker, J]] = {}
        self.size = count
        self._failed_starts = 0

    @property
    def has_room(self) -> bool:
        """Whether a worker has nothing to do."""
        return bool(self._idle)

    def start(self, job: J) -> None:
        """Gives a job to a worker that has nothing to do."""
        worker = self._idle.pop()
        self._busy[worker.start(job)] = worker, job

    def wait(self) -> list[Done[J]]:
        """Waits until a job is over; a worker that died is replaced.

        Raises:
            InputError: Workers end before they begin.
        """
        ready, _ = wait(self._busy, return_when=FIRST_COMPLETED)
        done = []
        for future in ready:
            worker, job = self._busy.pop(future)
            try:
                made = future.result()
            except BrokenProcessPool:
                self._count_start(worker)
                worker.close()
                self._idle.append(_Worker())
                done.append(Done(job, None))
            else:
                self._failed_starts = 0
                self._idle.append(worker)
                done.append(Done(job, made))
        return done

    def _count_start(self, worker: _Worker) -> None:
        """Gives up if workers die before they have begun, again and again."""
        self._failed_starts = 0 if worker.pid is not None else self._failed_starts + 1
        if self._failed_starts > _MOST_FAILED_STARTS:
            raise InputError(
                "workers end before they begin; what they say stands above\n"
                'hint: a script must call this below `if __name__ == "__main__":`, because each '
                "worker imports it"
            )

    def close(self) -> None:
        """Ends all processes, in the middle of a run if need be."""
        for worker in [*self._idle, *(worker for worker, _ in self._busy.values())]:
            worker.close()
        self._idle, self._busy = [], {}


class _Worker:
    """A pool of one process, which starts with its first job."""

    def __init__(self) -> None:
        self._pool = ProcessPoolExecutor(
            1, mp_context=multiprocessing.get_context("spawn"), initializer=_arrive
        )
        self._pid: Future[int] | None = None

    def start(self, job: Job) -> Future[list[Any]]:
        """Gives it a job."""
        try:
            if self._pid is None:
                self._pid = self._pool.submit(os.getpid)
            return self._pool.submit(made_by, job)
        except BrokenProcessPool as error:
            # It died between two jobs.
            failed: Future[list[Any]] = Future()
            failed.set_exception(error)
            return failed

    @property
    def pid(self) -> int | None:
        """The number of its process, as soon as that came so far as to do something."""
        if self._pid is None or not self._pid.done() or self._pid.exception() is not None:
            return None
        return self._pid.result()

    def close(self) -> None:
        """Ends it at once."""
        pid = self.pid
        if pid is not None:
            with contextlib.suppress(OSError):
                os.kill(pid, system.KILL)
        self._pool.shutdown(wait=False, cancel_futures=True)


def require_main_process() -> None:
    """Refuses to start workers in a worker, whose main program began its work when imported.

    Raises:
        InputError: This is one.
    """
    # While a worker imports the main program, it has its name, but no parent yet.
    if multiprocessing.current_process().name != _MAIN:
        raise InputError(
            "a worker cannot start workers\n"
            'hint: call this below `if __name__ == "__main__":`, because each worker imports the '
            "main program"
        )


def _arrive() -> None:
    """Prepares a worker: Ctrl-C is for the main process, and without that nobody needs it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        multiprocessing.connection.wait([parent.sentinel])
        os.kill(os.getpid(), system.KILL)
