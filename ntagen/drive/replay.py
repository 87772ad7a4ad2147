"""Repeats the decisions of a logged run.

The driver runs once more, on a device that does not move and reports the logged measurements. All
its decisions (each state, command, prediction, estimate, synthesis and learned region) are compared
with the log, record by record. The driver depends only on measurements, scene, settings and engine,
so the decisions must be the same. If they differ, the program, its engine or the log has changed.
Of a run that goes on from other runs, those are repeated first: their logs are in its own.
"""

from __future__ import annotations

from dataclasses import dataclass

from ntagen.drive.controller import Controller
from ntagen.drive.past import Relay, bring_back, legs_before
from ntagen.drive.reading import RunLog
from ntagen.drive.records import Record
from ntagen.drive.stage import Different, LogOver, Stage
from ntagen.plan.synthesise import Synthesiser


@dataclass(frozen=True, slots=True)
class Comparison:
    """The result of a replay.

    Attributes:
        compared: The number of decisions that were compared.
        logged: The first logged record that was decided differently; None if all are the same.
        decided: The decision instead; None if there was none.
        complete: Whether the run was compared to its end; a log that is cut off is not.
    """

    compared: int
    logged: Record | None
    decided: Record | None
    complete: bool

    @property
    def is_same(self) -> bool:
        """Whether all decisions were the same."""
        return self.logged is None and self.decided is None


def replay(log: RunLog, synthesise: Synthesiser) -> Comparison:
    """Runs the decisions of a log again and compares them.

    Args:
        log: The log.
        synthesise: Finds plans, with the settings of the log.

    Raises:
        InputError: The log has no scene or no settings.
        LimitError: The engine reached a limit that it did not reach in the run.
    """
    stage = Stage(log.records)
    relay = Relay(stage, stage, stage.listen, lambda _: stage.listen(), stage.answer)
    controller = Controller(
        log.scene,
        relay,
        synthesise,
        log.settings,
        relay,
        relay.listen,
        agree=relay.agree,
        course=log.course,
        policy=log.policy,
        ask=relay.ask,
    )
    compared = 0
    try:
        if before := legs_before(log):
            compared = bring_back(controller, relay, before)
            controller.resume()
        else:
            controller.run()
    except LogOver:
        return Comparison(compared + stage.compared, None, None, complete=False)
    except Different as found:
        count = compared + stage.compared
        return Comparison(count, found.logged, found.decided, complete=False)
    left = stage.next_logged
    return Comparison(compared + stage.compared, left, None, complete=left is None)
