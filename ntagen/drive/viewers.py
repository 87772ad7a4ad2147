"""What viewers see of a run, event by event, as messages on topics (`ntagen.drive.viewing`).

The log has them beside the records, and a viewer can get them while the run goes on.
"""

from __future__ import annotations

from ntagen.drive.records import Record
from ntagen.drive.viewing import Shaft, Shown, show_hidden, show_plan, show_record, show_scene
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene


class Viewers:
    """Makes the messages of a run."""

    def __init__(self, actual: Scene | None) -> None:
        """Begins before the run.

        Args:
            actual: The true scene; None if nobody knows it.
        """
        self._actual = actual
        self._shaft: Shaft | None = None

    def started(self, scene: Scene) -> Shown:
        """The messages for the scene that the driver was told."""
        self._shaft = Shaft(scene.needle.tip.position_mm)
        yield from show_scene(scene)
        if self._actual is not None:
            yield from show_hidden(self._actual, scene)

    def synthesised(self, synthesis: Synthesis, time_s: float) -> Shown:
        """The messages for a synthesis."""
        return show_plan(synthesis, time_s)

    def recorded(self, record: Record, *, is_due: bool = True) -> Shown:
        """The messages for a record.

        Args:
            record: The record.
            is_due: Whether it is to be seen; the needle moves on in any case.
        """
        if is_due:
            yield from show_record(record)
        if self._shaft is not None:
            yield from self._shaft.show(record, is_due=is_due)
