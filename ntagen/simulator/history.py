"""The states on the way of a course, and a position among them.

The course itself stands at one state. If something is done at another one, it begins again and
makes the same steps: courses are deterministic, so a list of choices is all that must be kept.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

from ntagen.simulator.courses import Choice, Course, Done, Offer, State
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """A state on the way.

    Attributes:
        done: The step that led here; ``None`` for the initial state.
        state: The state.
        time: When it was entered; 0 without exact times.
    """

    done: Done | None
    state: State
    time: Fraction


class History:
    """The way of a course so far.

    Attributes:
        entries: The states, the initial one first.
        position: The index of the state that is shown.
    """

    def __init__(self, begin: Callable[[], Course]) -> None:
        """Begins in the initial state.

        Args:
            begin: Makes a course in the initial state.

        Raises:
            ModelError: The initial state cannot be computed.
        """
        self._begin = begin
        self._course = begin()
        self._at = 0
        self._offers: dict[int, Offer] = {}
        self.entries = [Entry(None, self._course.state(), Fraction(0))]
        self.position = 0

    @property
    def mode(self) -> str:
        """What kind of course it is."""
        return self._course.mode

    @property
    def here(self) -> Entry:
        """The state that is shown."""
        return self.entries[self.position]

    @property
    def choices(self) -> list[Choice]:
        """What was chosen on the way."""
        return [one.done.choice for one in self.entries if one.done is not None]

    def offer(self) -> Offer:
        """What can happen in the state that is shown.

        Raises:
            ModelError: The model fails in computing it.
        """
        if self.position not in self._offers:
            self._offers[self.position] = self.course().offer()
        return self._offers[self.position]

    def course(self) -> Course:
        """The course, at the state that is shown."""
        if self._at > self.position:
            self._course, self._at = self._begin(), 0
        for done in [one.done for one in self.entries[self._at + 1 : self.position + 1]]:
            if done is not None:
                self._course.do(done.choice)
                self._at += 1
        return self._course

    def do(self, choice: Choice) -> None:
        """Makes a step from the state that is shown; the steps that followed it are dropped.

        Raises:
            InputError: It is not possible.
            ModelError: The model fails in it.
        """
        course = self.course()
        try:
            done = course.do(choice)
        except Exception:
            # A course may have moved before it failed.
            self._course, self._at = self._begin(), 0
            raise
        del self.entries[self.position + 1 :]
        self._offers = {at: one for at, one in self._offers.items() if at <= self.position}
        time = self.here.time + (done.delay or 0)
        self.entries.append(Entry(done, course.state(), time))
        self.position += 1
        self._at = self.position

    def go(self, position: int) -> None:
        """Shows another state of the way; positions beyond its ends are its ends."""
        self.position = min(max(position, 0), len(self.entries) - 1)
