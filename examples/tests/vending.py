"""A coffee machine with simulated time: the implementation that tests of `vending.xml` drive.

`FAULTS` has machines with a fault each; tests that are worth something find them all.
"""

from __future__ import annotations

from fractions import Fraction

RETURN_AFTER = 30
SMALL_TAKES, LARGE_TAKES = 10, 18


class Machine:
    """The machine; `advance` lets time pass, and `given` says what came out since it was asked."""

    def __init__(self) -> None:
        self.state = "Idle"
        self.served = 0
        self._left = Fraction(0)
        self._outputs: list[str] = []

    def coin(self) -> None:
        """Somebody pays."""
        if self.state == "Idle":
            self.state, self._left = "Paid", Fraction(RETURN_AFTER)

    def small(self) -> None:
        """The button for a small coffee."""
        self._brew(SMALL_TAKES)

    def large(self) -> None:
        """The button for a large coffee."""
        self._brew(LARGE_TAKES)

    def cancel(self) -> None:
        """The button that gives the coin back."""
        if self.state == "Paid":
            self._refund()

    def advance(self, seconds: Fraction) -> None:
        """Time passes."""
        while self.state != "Idle" and seconds >= self._left:
            seconds -= self._left
            self._expire()
        if self.state != "Idle":
            self._left -= seconds

    def given(self) -> list[str]:
        """What has come out since this was last asked."""
        given, self._outputs = self._outputs, []
        return given

    def _brew(self, seconds: int) -> None:
        if self.state == "Paid":
            self.state, self._left = "Brewing", Fraction(seconds)

    def _expire(self) -> None:
        if self.state == "Paid":
            self._refund()
        else:
            self.state, self.served = "Idle", (self.served + 1) % 4
            self._outputs.append("cup")

    def _refund(self) -> None:
        self.state = "Idle"
        self._outputs.append("refund")


class KeepsCoin(Machine):
    """It does not give the coin back when nobody chooses."""

    def _expire(self) -> None:
        if self.state == "Paid":
            self.state = "Idle"
        else:
            super()._expire()


class Slow(Machine):
    """A small coffee takes as long as a large one."""

    def small(self) -> None:
        """The button for a small coffee."""
        self._brew(LARGE_TAKES)


class DeadButton(Machine):
    """The button that gives the coin back does nothing."""

    def cancel(self) -> None:
        """The button that gives the coin back."""


class Miscounts(Machine):
    """It does not count what it has served."""

    def _expire(self) -> None:
        count = self.served
        super()._expire()
        self.served = count


class Impatient(Machine):
    """It gives the coin back too early."""

    def coin(self) -> None:
        """Somebody pays."""
        super().coin()
        self._left = Fraction(RETURN_AFTER - 1)


FAULTS = {one.__name__: one for one in (KeepsCoin, Slow, DeadButton, Miscounts, Impatient)}
"""Machines with a fault, by name."""
