"""What can go wrong, as exceptions; the command line turns each into one message and an exit code.

::

    NtagenError                exit code 70 unless a subclass says otherwise
    ├── InputError             2: what the user gave is wrong: a file, a model, a query, an option
    │   └── UndecidedError     a strategy is asked about a state of which it says nothing
    ├── LimitError             3: a limit of time, memory or states was reached before an answer
    ├── ModelError             4: the model ran into a run-time error (range, index, overflow, …)
    └── DeviceError            5: a device or sensor failed or answered what it must not

Every message is one or more complete lines for the user: what is wrong, where, and what to do.
"""

from __future__ import annotations

from typing import ClassVar


class NtagenError(Exception):
    """Anything that ntagen reports to its user; `exit_code` is what the command line ends with."""

    exit_code: ClassVar[int] = 70


class InputError(NtagenError):
    """What the user gave is wrong: a missing file, a mistake in it, an unknown query name."""

    exit_code: ClassVar[int] = 2


class UndecidedError(InputError, LookupError):
    """A strategy is asked about a state of which it says nothing.

    Play under the strategy does not get there, or its owner does not win from there.
    """


class LimitError(NtagenError):
    """A limit of time, memory or states was reached before there was an answer."""

    exit_code: ClassVar[int] = 3


class ModelError(NtagenError):
    """The model ran into a run-time error, so that there is no verdict."""

    exit_code: ClassVar[int] = 4


class DeviceError(NtagenError):
    """A device or sensor failed, fell silent or answered what it must not."""

    exit_code: ClassVar[int] = 5
