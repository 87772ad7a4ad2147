"""Between the generated tests and the machine: what the steps of a test mean for it."""

from __future__ import annotations

import os
from fractions import Fraction

from vending import FAULTS, Machine


class Adapter:
    """Drives a machine: the right one, or that with the fault which VENDING_FAULT names."""

    def __init__(self) -> None:
        self._machine = FAULTS.get(os.environ.get("VENDING_FAULT", ""), Machine)()
        self._seen: list[str] = []

    def wait(self, seconds: Fraction) -> None:
        """Time passes; nothing may come out before its end."""
        moment = Fraction(1, 1000)
        if seconds > moment:
            self._machine.advance(seconds - moment)
            assert self._machine.given() == [], "something came out too early"
            seconds = moment
        self._machine.advance(seconds)

    def send(self, action: str) -> None:
        """An input of the machine."""
        getattr(self._machine, action)()

    def expect(self, action: str) -> None:
        """An output of the machine."""
        self._seen += self._machine.given()
        assert self._seen[:1] == [action], f"{action} did not come"
        del self._seen[0]

    def check(self, *, location: str, served: int) -> None:
        """The state in which the machine must be now."""
        assert (self._machine.state, self._machine.served) == (location, served)
        assert self._seen + self._machine.given() == [], "something came out"
