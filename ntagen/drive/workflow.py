"""Goes through the states of a run, and ends it: whatever happens, the needle is stopped first.

The tasks of the states are the controller's. An error of a task is an event too, so that the table
of states (`ntagen.drive.states`) says what follows. A run that cannot be recorded ends with a
fault.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping
from typing import Protocol

from ntagen.drive.records import Command, Ended, Journal, JournalError, Record, Transition
from ntagen.drive.states import ENDS, Event, State, next_state
from ntagen.drive.steering import Steering
from ntagen.errors import DeviceError, LimitError


class Tasks(Protocol):
    """What the states of a run do, and what its end tells.

    Attributes:
        reason: Why the run ends, as far as a task knows.
    """

    reason: str

    def by_state(self) -> Mapping[State, Callable[[], Event]]:
        """The task of each state; each returns the event with which it ended."""

    def require_time(self, at_s: float) -> None:
        """Raises `LimitError` if the time limit is over at a time."""

    def ended(self, outcome: State) -> Ended:
        """The last record."""


class Workflow:
    """The states of one run.

    Args:
        tasks: What is done.
        needle: The needle.
        journal: Records each transition.
    """

    def __init__(self, tasks: Tasks, needle: Steering, journal: Journal) -> None:
        self._tasks = tasks
        self._needle = needle
        self._journal = journal
        self._turned_s = 0.0

    def run(self, state: State) -> Ended:
        """Goes on from a state until the run ends; returns the last record."""
        tasks = self._tasks.by_state()
        try:
            while state not in ENDS:
                state = self._turn(state, self._perform(tasks[state]))
        except BaseException as error:
            # A bug, or the operator's second Ctrl-C: the needle must not move on.
            try:
                self._needle.stop_at_once()
            finally:
                self._tell_bug(state, error)
            raise
        return self._finish(self._halt(state))

    def _perform(self, task: Callable[[], Event]) -> Event:
        """Does a task; returns the event with which it ended. An error is an event too."""
        try:
            self._tasks.require_time(self._turned_s)
            return task()
        except DeviceError as error:
            self._tasks.reason = str(error)
            return Event.FAULT
        except LimitError as error:
            self._tasks.reason = str(error)
            return Event.TIMED_OUT
        except KeyboardInterrupt as error:
            self._tasks.reason = str(error) or "interrupted by the operator"
            return Event.INTERRUPT

    def _turn(self, state: State, event: Event) -> State:
        """The next state. A run that cannot be recorded ends with a fault."""
        try:
            return self._went_on(state, event)
        except JournalError as error:
            self._tasks.reason = str(error)
            return self._went_on(state, Event.FAULT)

    def _went_on(self, state: State, event: Event) -> State:
        following = next_state(state, event)
        self._turned_s = self._needle.now_s()
        self._note(Transition(self._turned_s, state.value, event.value, following.value))
        return following

    def _halt(self, state: State) -> State:
        """Stops the needle at the end of a run, whatever the reason; returns how it ends."""
        try:
            self._needle.stop()
        except JournalError as error:
            self._tasks.reason = str(error)
            return State.FAULTED
        except DeviceError as error:
            # The run ends anyway, but the report must say that the device did not stop.
            self._tasks.reason = f"{self._tasks.reason}; it cannot be stopped: {error}"
        return state

    def _finish(self, state: State) -> Ended:
        """Records the end; one that cannot be recorded is a fault."""
        try:
            return self._ended(state)
        except JournalError as error:
            self._tasks.reason = str(error)
            return self._ended(State.FAULTED)

    def _ended(self, state: State) -> Ended:
        ended = self._tasks.ended(state)
        self._note(ended)
        return ended

    def _tell_bug(self, state: State, error: BaseException) -> None:
        """Records that a mistake of the program ended the run, as far as that is possible.

        A second Ctrl-C is no such mistake: it may have come in the middle of a record.
        """
        if isinstance(error, KeyboardInterrupt):
            return
        said = " ".join(str(error).split())
        self._tasks.reason = f"internal error: {type(error).__name__}: {said}"
        with contextlib.suppress(Exception):
            self._went_on(state, Event.FAULT)
            self._note(Command(self._needle.now_s(), "stop", 0.0))
            self._ended(State.FAULTED)

    def _note(self, record: Record) -> None:
        self._journal.record(record)
