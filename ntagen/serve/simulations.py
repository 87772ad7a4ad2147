"""The simulations of `ntagen serve`: each has a process, which answers in lines of JSON.

What a simulation needs to be taken up again (its choices, and where the page stands) is kept here.
So a process may end at any time, by a limit or because others need the room: the next request
starts another one, which makes the same choices again, and nothing is lost.
"""

from __future__ import annotations

import contextlib
import secrets
import threading
import time
from collections.abc import Iterator
from typing import Any, Final

from ntagen.serve.jobs import File
from ntagen.serve.loopback import Refusal
from ntagen.serve.processes import Limits
from ntagen.serve.workers import Gone, Worker

_RECORDS: Final = 500
"""So many simulations are kept; those that were not used for the longest time go first."""

_KEPT: Final = ("mode", "game", "advised", "note", "position")


class Simulation:
    """A simulation, with or without a process.

    Attributes:
        number: The id of the file.
        file: The model.
        lock: Whoever asks holds it.
        worker: Its process, if it has one.
        used: When it was last asked.
    """

    def __init__(self, number: str, file: File) -> None:
        self.number = number
        self.file = file
        self.lock = threading.Lock()
        self.worker: Worker | None = None
        self.used = time.monotonic()
        self._kept: dict[str, Any] = {}

    def keep(self, news: dict[str, Any]) -> None:
        """Keeps what a view says about taking the simulation up again."""
        choices = self._kept.get("choices", [])[: news["known"]] + news["choices"]
        self._kept = {name: news[name] for name in _KEPT} | {"choices": choices}

    @property
    def kept(self) -> dict[str, Any]:
        """The request that takes it up again; empty if it is at its start."""
        return {"do": "restore", **self._kept} if self._kept else {}

    def end(self) -> None:
        """Ends its process."""
        if self.worker is not None:
            self.worker.is_cancelled = True
            self.worker.end()


class Simulations:
    """The simulations of a server."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._all: dict[str, Simulation] = {}
        self._lock = threading.Lock()
        self._running: set[Simulation] = set()
        self._room = threading.Condition()

    def close(self) -> None:
        """Ends all processes."""
        with self._lock:
            for one in self._all.values():
                one.end()

    def add(self, number: str, file: File) -> str:
        """Makes a simulation of a model; returns its id.

        Raises:
            Refusal: The file is no model.
        """
        if file.kind == "run":
            raise Refusal(400, f"{file.name} is a run, and only models are simulated")
        identity = secrets.token_hex(8)
        with self._lock:
            for old in sorted(self._all, key=lambda one: self._all[one].used)[:-_RECORDS]:
                self._all.pop(old).end()
            self._all[identity] = Simulation(number, file)
        return identity

    def get(self, identity: str) -> Simulation:
        """A simulation by its id.

        Raises:
            Refusal: There is none.
        """
        found = self._all.get(identity)
        if found is None:
            raise Refusal(
                404,
                "this simulation is not kept any more\nhint: open the model, and simulate it again",
            )
        return found

    def ask(self, identity: str, request: dict[str, Any]) -> dict[str, Any]:
        """What a simulation answers; ``resumed`` says that it has another process than before.

        Raises:
            Refusal: There is no such simulation, the request is refused, or no process answers.
        """
        one = self.get(identity)
        try:
            with one.lock:
                return self._answer(one, request)
        finally:
            # It is idle now, and may make room for another one.
            with self._room:
                self._room.notify_all()

    def _answer(self, one: Simulation, request: dict[str, Any]) -> dict[str, Any]:
        one.used = time.monotonic()
        try:
            worker, is_resumed = self._worker_of(one)
            answer = _told(worker.ask(request))
        except Gone as why:
            self._drop(one)
            raise Refusal(
                503,
                f"the process of this simulation has ended: {why}\n"
                "hint: the way until here is kept; take another step, or start the server "
                "with greater limits: ntagen serve --timeout 5min --memory 4GiB",
            ) from None
        finally:
            one.used = time.monotonic()
        view = answer.get("view", answer)
        if "keep" in view:
            one.keep(view.pop("keep"))
        return answer | ({"resumed": True} if is_resumed else {})

    def _worker_of(self, one: Simulation) -> tuple[Worker, bool]:
        """The process of a simulation, and whether it has just taken up what was kept.

        Raises:
            Refusal: Too many others compute, or what was kept is not possible.
            Gone: The process does not answer.
        """
        if one.worker is not None and one.worker.is_running:
            return one.worker, False
        self._drop(one)
        self._wait_for_room(one)
        try:
            worker = one.worker = _worker(one.file, self._limits)
            if one.kept:
                _told(worker.ask(one.kept))
        except BaseException:
            # A process that is not where the page is must answer nothing else.
            self._drop(one)
            raise
        return worker, bool(one.kept)

    def _drop(self, one: Simulation) -> None:
        """Ends the process of a simulation, if it has one; whoever calls holds its lock."""
        if one.worker is not None:
            one.worker.end()
            one.worker = None
        with self._room:
            self._running.discard(one)
            self._room.notify_all()

    def _wait_for_room(self, one: Simulation) -> None:
        """Waits until there may be another process; the oldest idle one ends for it.

        Raises:
            Refusal: All others compute for too long.
        """
        end = time.monotonic() + self._limits.timeout_s
        with self._room:
            while len(self._running) >= self._limits.simulations:
                if self._end_oldest():
                    continue
                if not self._room.wait(end - time.monotonic()):
                    raise Refusal(
                        429,
                        f"{self._limits.simulations} simulations compute already\n"
                        "hint: wait for one, and try again",
                    )
            self._running.add(one)

    def _end_oldest(self) -> bool:
        """Ends the idle process that was not used for the longest time; whether there is one."""
        for other in sorted(self._running, key=lambda one: one.used):
            with _held(other.lock) as is_idle:
                if is_idle:
                    if other.worker is not None:
                        other.worker.end()
                        other.worker = None
                    self._running.discard(other)
                    return True
        return False


def _worker(file: File, limits: Limits) -> Worker:
    options = [f"--timeout={limits.timeout_s}s", f"--memory={limits.memory_bytes}B"]
    return Worker(["simulate", file.path.name, *options], file.path.parent, limits)


@contextlib.contextmanager
def _held(lock: threading.Lock) -> Iterator[bool]:
    """Holds a lock if nobody else does; gives whether it does."""
    is_held = lock.acquire(blocking=False)
    try:
        yield is_held
    finally:
        if is_held:
            lock.release()


def _told(answer: dict[str, Any]) -> dict[str, Any]:
    """What a process says, or its message as a refusal."""
    if "ok" not in answer:
        raise Refusal(400, str(answer.get("error", "there is no answer")))
    found: dict[str, Any] = answer["ok"]
    return found
