"""The operator of a run, who speaks by signals and answers questions at the terminal."""

from __future__ import annotations

import contextlib
import signal
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from ntagen.cli.signals import Handler, handled
from ntagen.drive.operator import Operator
from ntagen.system import HANG_UPS

if TYPE_CHECKING:
    from types import FrameType


class SignalledOperator(Operator):
    """An operator who speaks by signals."""

    def __init__(self) -> None:
        super().__init__()
        self.was_terminated = False
        self._is_asked = False

    def interrupt(self, _number: int, _frame: FrameType | None) -> None:
        """Ctrl-C: the first one ends the run in an orderly way, the second one at once."""
        if self.wants_end or self._is_asked:
            raise KeyboardInterrupt
        self.end("interrupted by the operator")

    def terminate(self, _number: int, _frame: FrameType | None) -> None:
        """SIGTERM: ends the run in an orderly way."""
        self.was_terminated = True
        self.end("ended by the system (SIGTERM)")

    def hang_up(self, number: int, _frame: FrameType | None) -> None:
        """The terminal is gone, so nobody could end the run any more."""
        self.was_terminated = True
        self.end(f"the terminal was closed ({signal.Signals(number).name})")

    def agree(self, text: str) -> None:
        """Asks whether the driver may do this.

        Raises:
            KeyboardInterrupt: It may not.
        """
        if not self.may(text):
            raise KeyboardInterrupt(f"the operator did not agree to {text}")

    def may(self, text: str) -> bool:
        """Asks whether the driver may do this, and returns the answer; Ctrl-C is a no."""
        self._is_asked = True
        try:
            return click.confirm(f"May the needle {text}?", err=True)
        except (click.Abort, KeyboardInterrupt):
            return False
        finally:
            self._is_asked = False


@contextlib.contextmanager
def signalled_operator() -> Iterator[SignalledOperator]:
    """The operator, who gets the signals until the end of the block."""
    operator = SignalledOperator()
    handlers: dict[signal.Signals, Handler] = {
        signal.SIGINT: operator.interrupt,
        signal.SIGTERM: operator.terminate,
        **dict.fromkeys(HANG_UPS, operator.hang_up),
    }
    with handled(handlers):
        yield operator
