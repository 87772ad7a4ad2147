"""The order of arm, start, stop and pull back."""

from __future__ import annotations

import threading
from collections.abc import Callable

import pytest

from ntagen.drive.records import Ended
from ntagen.errors import DeviceError, NtagenError
from ntagen.ros.session import Session


class Work:
    """Work that waits until it is told to go on."""

    def __init__(self) -> None:
        self.trouble = ""
        self.halts = 0
        self.begun = threading.Event()
        self.told: list[tuple[str, str]] = []
        self.goes_on = threading.Event()

    def arm(self) -> str:
        if self.trouble:
            raise DeviceError(self.trouble)
        return "the tip is seen"

    def drive(self, listen: Callable[[], None]) -> Ended:
        reason = self._until(listen)
        outcome = "interrupted" if reason else "target reached"
        return Ended(1.0, outcome, reason or "the tip is in the last target", 1.0, 0, 1)

    def halt(self) -> None:
        self.halts += 1

    def retract(self, listen: Callable[[], None]) -> None:
        reason = self._until(listen)
        if reason:
            raise KeyboardInterrupt(reason)

    def _until(self, listen: Callable[[], None]) -> str:
        """Works until it may end, or somebody wants it to: the reason."""
        self.begun.set()
        while not self.goes_on.wait(0.001):
            try:
                listen()
            except KeyboardInterrupt as error:
                return str(error)
        self.goes_on.clear()
        return ""


class Bench:
    """A session whose work is done in a thread."""

    def __init__(self) -> None:
        self.work = Work()
        self.session = Session(self.work, lambda *told: self.work.told.append(told))
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self.session.run, args=(self._listen,))

    def __enter__(self) -> Bench:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._closing.set()
        self._thread.join(10.0)

    def _listen(self) -> None:
        if self._closing.is_set():
            raise KeyboardInterrupt

    def wait_for(self, state: str) -> None:
        for _ in range(5000):
            if self.work.told and self.work.told[-1][0] == state:
                return
            threading.Event().wait(0.001)
        raise AssertionError(f"{state}: {self.work.told}")


def test_nothing_moves_before_it_is_armed_and_started() -> None:
    with Bench() as bench:
        assert bench.session.start() == (False, "the needle is not armed: call arm first")
        assert not bench.session.pull_back()[0]
        assert bench.session.arm() == (True, "the tip is seen")
        assert bench.session.start() == (True, "steering")
        bench.work.begun.wait(5.0)
        assert bench.session.arm() == (False, "the needle is being steered: call stop first")
        bench.work.goes_on.set()
        bench.wait_for("target reached")
        assert bench.session.pull_back() == (True, "pulling back")
        bench.work.goes_on.set()
        bench.wait_for("pulled back")
        assert "start this program again" in bench.session.arm()[1]


def test_a_refusal_is_told_and_may_be_tried_again() -> None:
    with Bench() as bench:
        bench.work.trouble = "nobody publishes /sensor/tip"
        assert bench.session.arm() == (False, "nobody publishes /sensor/tip")
        assert bench.work.told[-1] == ("refused", "nobody publishes /sensor/tip")
        bench.work.trouble = ""
        assert bench.session.arm()[0]


def test_stop_ends_what_moves_from_any_thread() -> None:
    with Bench() as bench:
        assert bench.session.stop() == (True, "nothing moves")
        bench.session.arm()
        bench.session.start()
        bench.work.begun.wait(5.0)
        assert bench.session.stop() == (True, "stopping")
        assert bench.work.halts == 1
        bench.wait_for("interrupted")
        assert bench.work.told[-1][1] == "the service stop was called"
        assert bench.session.pull_back()[0]
        bench.session.stop()
        bench.wait_for("stopped")
        assert bench.session.pull_back()[0]
        bench.work.goes_on.set()
        bench.wait_for("pulled back")


def test_a_stop_takes_back_that_it_is_armed() -> None:
    with Bench() as bench:
        bench.session.arm()
        bench.session.stop()
        assert not bench.session.start()[0]
        assert bench.session.arm()[0]


def test_at_once_raises_why_it_cannot_be_armed() -> None:
    work = Work()
    work.trouble = "the stage is silent"
    with pytest.raises(NtagenError, match="the stage is silent"):
        Session(work, lambda *_: None).run(lambda: None, at_once=True)
