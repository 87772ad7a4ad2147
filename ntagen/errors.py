"""The exceptions of ntagen; the command line turns each into one message and an exit code.

::

    NtagenError                exit code 70 unless a subclass says otherwise
    ├── InputError             2: what the user gave is wrong: a file, a model, a query, an option
    │   └── UndecidedError     a strategy has no decision for a state
    ├── LimitError             3: a limit on time, memory or states was reached before an answer
    ├── ModelError             4: the model ran into a run-time error (range, index, overflow, …)
    └── DeviceError            5: a device or sensor failed or gave a wrong answer

Every message is one or more complete lines for the user: what is wrong, where, and how to fix it.

`Halted` is none of these: it ends a motion, and the run goes on.
"""

from __future__ import annotations

from typing import ClassVar


class NtagenError(Exception):
    """Any error that ntagen reports to its user; `exit_code` is the command line's exit code."""

    exit_code: ClassVar[int] = 70


class InputError(NtagenError):
    """What the user gave is wrong: a missing file, a mistake in it, an unknown query name."""

    exit_code: ClassVar[int] = 2


class UndecidedError(InputError, LookupError):
    """A strategy is asked about a state for which it has no decision.

    Play under the strategy never reaches the state, or its owner does not win from it.
    """


class LimitError(NtagenError):
    """A limit on time, memory or states was reached before there was an answer."""

    exit_code: ClassVar[int] = 3


class ModelError(NtagenError):
    """The model ran into a run-time error, so that there is no verdict."""

    exit_code: ClassVar[int] = 4


class DeviceError(NtagenError):
    """A device or sensor failed, did not answer, or gave a wrong answer."""

    exit_code: ClassVar[int] = 5


class Halted(Exception):  # noqa: N818  it reports an event, not an error
    """A motion was ended early because of what was seen during it; the needle stands.

    Who watches a motion raises it. The device stops, sets `part`, and raises it again.

    Attributes:
        part: How much of the motion was made, from 0 to 1.
    """

    def __init__(self, reason: str) -> None:
        super().__init__(reason)
        self.part = 0.0
