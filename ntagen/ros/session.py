"""The order in which a needle is armed, driven and pulled back, whoever asks for it.

Services ask from threads of their own; all work is done in one thread, that of `Session.run`.
Only one thing is done at a time: what comes meanwhile is refused, except for a stop.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from enum import Enum, unique
from typing import Final, Protocol

from ntagen.drive.operator import Operator
from ntagen.drive.records import Ended
from ntagen.errors import NtagenError

Answer = tuple[bool, str]
"""Whether it was done, and what there is to say about it."""

_LOOK_S: Final = 0.05


@unique
class Phase(Enum):
    """What a session does."""

    IDLE = "idle"
    ARMING = "arming"
    ARMED = "armed"
    DRIVING = "driving"
    OVER = "over"
    PULLING = "pulling back"
    OUT = "pulled back"


_NEXT: Final = {
    "arm": {Phase.IDLE: Phase.ARMING},
    "start": {Phase.ARMED: Phase.DRIVING},
    "pull back": {Phase.OVER: Phase.PULLING},
}
"""What may be asked for in which phase, and the phase of its work."""

_WHY_NOT: Final = {
    Phase.IDLE: "the needle is not armed: call arm first",
    Phase.ARMING: "the needle is being armed",
    Phase.ARMED: "the needle is armed: call start",
    Phase.DRIVING: "the needle is being steered: call stop first",
    Phase.OVER: "the run is over: call pull_back, and start this program again for another run",
    Phase.PULLING: "the needle is being pulled back",
    Phase.OUT: "the needle is out: start this program again for another run",
}


class Work(Protocol):
    """What a session does, in its own thread."""

    def arm(self) -> str:
        """Opens and checks everything, and moves nothing; what was found.

        Raises:
            NtagenError: Something is not ready; nothing is open then.
        """

    def drive(self, listen: Callable[[], None]) -> Ended:
        """Steers the needle."""

    def halt(self) -> None:
        """Lets nothing move on, at once and from any thread; who listens ends the work."""

    def retract(self, listen: Callable[[], None]) -> None:
        """Pulls the needle back to the entry.

        Raises:
            NtagenError: That failed.
            KeyboardInterrupt: It was stopped.
        """


class Session:
    """One run and what comes before and after it.

    Args:
        work: Does it.
        tell: Is told each state and its reason.

    Attributes:
        ended: How the run ended; None before.
    """

    def __init__(self, work: Work, tell: Callable[[str, str], None]) -> None:
        self.ended: Ended | None = None
        self._work = work
        self._tell = tell
        self._lock = threading.Lock()
        self._phase = Phase.IDLE
        self._operator = Operator()
        self._refusal: NtagenError | None = None
        self._asked: queue.SimpleQueue[tuple[str, queue.SimpleQueue[Answer]]] = queue.SimpleQueue()

    def arm(self) -> Answer:
        """Asks to arm, and waits until that is done."""
        return self._ask("arm")

    def start(self) -> Answer:
        """Asks to steer; the answer comes when it begins."""
        return self._ask("start")

    def pull_back(self) -> Answer:
        """Asks to pull the needle back; the answer comes when it begins."""
        return self._ask("pull back")

    def stop(self, why: str = "the service stop was called") -> Answer:
        """Stops whatever moves, at once and from any thread."""
        self._operator.end(why)
        with self._lock:
            moves = self._phase in (Phase.DRIVING, Phase.PULLING)
            was_armed = self._phase is Phase.ARMED
            if was_armed:
                # What stood ready must be made ready again by somebody who wants it.
                self._phase = Phase.IDLE
        if moves:
            self._work.halt()
        if was_armed:
            self._tell("idle", why)
        return True, "stopping" if moves else "nothing moves"

    def run(self, listen: Callable[[], None], *, at_once: bool = False) -> None:
        """Does what is asked for until `listen` raises.

        Args:
            listen: Raises `KeyboardInterrupt` if somebody wants the program to end.
            at_once: Arms and steers by itself, and returns when the run is over.

        Raises:
            NtagenError: It cannot be armed, if that was wanted at once.
        """
        if at_once:
            self._phase = Phase.ARMING
            ok, text = self._arm()
            if not ok:
                raise self._refusal or NtagenError(text)
            self._phase = Phase.DRIVING
            self._drive(listen)
            return
        while True:
            try:
                listen()
            except KeyboardInterrupt:
                return
            try:
                name, answered = self._asked.get(timeout=_LOOK_S)
            except queue.Empty:
                continue
            self._do(name, answered, listen)

    def _ask(self, name: str) -> Answer:
        answered: queue.SimpleQueue[Answer] = queue.SimpleQueue()
        with self._lock:
            following = _NEXT[name].get(self._phase)
            if following is None:
                return False, _WHY_NOT[self._phase]
            self._phase = following
            self._operator = Operator()
        self._asked.put((name, answered))
        return answered.get()

    def _do(
        self, name: str, answered: queue.SimpleQueue[Answer], listen: Callable[[], None]
    ) -> None:
        if name == "arm":
            answered.put(self._arm())
            return
        answered.put((True, "steering" if name == "start" else "pulling back"))
        if name == "start":
            self._drive(listen)
        else:
            self._retract(listen)

    def _arm(self) -> Answer:
        self._tell("arming", "the devices are opened and looked at")
        try:
            text = self._work.arm()
        except NtagenError as error:
            self._refusal = error
            self._set(Phase.IDLE)
            self._tell("refused", str(error))
            return False, str(error)
        if self._operator.wants_end:
            self._set(Phase.IDLE)
            self._tell("idle", "it was stopped while it was armed")
            return False, "it was stopped meanwhile"
        self._set(Phase.ARMED)
        self._tell("armed", text)
        return True, text

    def _drive(self, listen: Callable[[], None]) -> None:
        outcome, reason = "device fault", "internal error: see the terminal of the node"
        try:
            self.ended = self._work.drive(self._both(listen))
            outcome, reason = self.ended.outcome, self.ended.reason
        finally:
            # It is told last: whoever hears it may ask for the next thing.
            self._set(Phase.OVER)
            self._tell(outcome, reason)

    def _retract(self, listen: Callable[[], None]) -> None:
        self._tell("pulling back", "the service pull_back was called")
        try:
            self._work.retract(self._both(listen))
        except (NtagenError, KeyboardInterrupt) as error:
            self._set(Phase.OVER)
            self._tell("stopped", str(error) or "interrupted by the operator")
            return
        self._set(Phase.OUT)
        self._tell("pulled back", "the needle is at the entry")

    def _both(self, listen: Callable[[], None]) -> Callable[[], None]:
        """Listens to the services and to the terminal."""
        operator = self._operator

        def both() -> None:
            operator.listen()
            listen()

        return both

    def _set(self, phase: Phase) -> None:
        with self._lock:
            self._phase = phase
