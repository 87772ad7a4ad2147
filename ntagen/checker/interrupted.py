"""What is raised when the user interrupts random runs that have something to say already."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ntagen.checker.answer import Answer


class Interrupted(KeyboardInterrupt):
    """The user interrupted random runs; `answer` is that of the runs until then.

    Its verdict is ``unknown``, and `Answer.stop` is ``interrupted``. Whoever does not catch it sees
    what every interruption is, a `KeyboardInterrupt`::

        try:
            answer = model.check("Pr[<=1000](<> p)", epsilon=0.0001)
        except checker.Interrupted as interrupted:
            answer = interrupted.answer
    """

    def __init__(self, answer: Answer) -> None:
        super().__init__(f"{answer!r}")
        self.answer = answer
