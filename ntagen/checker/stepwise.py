"""Random runs in which somebody else decides for the controller, step by step."""

from __future__ import annotations

from collections.abc import Callable

import ntagen._checker as _checker
from ntagen.checker.errors import RejectedError, rejecting
from ntagen.errors import InputError

__all__ = ["Moment", "StepwiseRuns"]

Moment = _checker.Moment
"""A moment at which the controller decides, or the end of a run."""


class StepwiseRuns:
    """Random runs of a model that stop wherever the controller decides.

    `ntagen.gymnasium.Environment` says what a moment is.

    Attributes:
        maximises: Whether the greatest value is the best.
        wait: After how many units of time the controller is asked again at the latest; infinite if
            no clock is seen.
        actions: The texts of all actions; the last one is ``WAIT``.
        discrete: The texts of what is seen exactly.
        continuous: The texts of what is seen in intervals.
    """

    def __init__(self, raw: _checker.Environment) -> None:
        self._raw: _checker.Environment | None = raw
        self.maximises = raw.is_greatest
        self.wait = raw.wait
        self.actions = tuple(raw.actions())
        discrete, continuous = raw.features()
        self.discrete, self.continuous = tuple(discrete), tuple(continuous)

    def begin(self, seed: int, run: int) -> Moment:
        """Begins a run, and goes on until something is to be decided.

        Raises:
            RejectedError: The run fails.
            InputError: The runs are closed.
        """
        return self._reported(self._open().begin, seed, run)

    def act(self, action: int) -> Moment:
        """Takes the action with this number, and goes on in the same way."""
        return self._reported(self._open().act, action)

    def close(self) -> None:
        """Gives back what runs take; there can be no more."""
        self._raw = None

    def _open(self) -> _checker.Environment:
        if self._raw is None:
            raise InputError("the environment is closed\nhint: make another one")
        return self._raw

    def _reported(self, ask: Callable[..., Moment], *command: int) -> Moment:
        """What the engine reports on a command. An interruption closes the runs."""
        try:
            with rejecting():
                return ask(*command)
        except RejectedError:
            raise
        except BaseException:
            self.close()
            raise
