"""Runs the driver with a real needle: a device that takes real time, and a tracker that sees it.

Nobody knows the truth of such a run. What a simulation says about a run (`ntagen.drive.simulate`)
is therefore missing here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

from ntagen.drive.controller import Controller
from ntagen.drive.device import Assembly, LiveSensor, WatchedActuator
from ntagen.drive.following import Course
from ntagen.drive.knowledge import told
from ntagen.drive.outcome import Driven, SynthesisCounter
from ntagen.drive.past import Leg, Relay, go_on
from ntagen.drive.records import Journal, Journals
from ntagen.drive.resuming import Ask
from ntagen.drive.settings import Settings
from ntagen.drive.spinning import steered
from ntagen.drive.supervisor import Supervisor
from ntagen.errors import InputError
from ntagen.plan.policy import Policy
from ntagen.plan.synthesise import Synthesiser
from ntagen.scene import Scene

_SMALL_MM: Final = 1e-9


def require_overrun(settings: Settings, needs_mm: float) -> None:
    """Refuses settings that count on a shorter overrun than the device has.

    Raises:
        InputError: They do.
    """
    if settings.overrun_mm < needs_mm - _SMALL_MM:
        raise InputError(
            f"the needle goes on for {needs_mm:.2f} mm after a stop, and the settings count on "
            f"{settings.overrun_mm:g} mm\n"
            f"hint: give --set 'overrun {needs_mm + 0.005:.2f} mm', push more slowly, or let the "
            "controller brake harder"
        )


class RealRun:
    """A run with a real needle, which can be pulled back after it.

    Args:
        scene: The scene.
        actuator: What moves the needle.
        sensor: What measures it, also while it moves.
        synthesise: Finds plans.
        settings: How to drive.
        journal: Records what happens.
        known: The critical regions that the driver knows (`ntagen.drive.knowledge.told`).
        listen: Raises `KeyboardInterrupt` if somebody wants the run to end.
        agree: As in `Controller`.
        course: As in `Controller`.
        policy: As in `Controller`.
        legs: The runs from which this one goes on (`ntagen.drive.past`).
        ask: As in `Controller`.
    """

    def __init__(
        self,
        scene: Scene,
        actuator: WatchedActuator,
        sensor: LiveSensor,
        synthesise: Synthesiser,
        settings: Settings,
        journal: Journal,
        *,
        known: str = "all",
        listen: Callable[[], None] = lambda: None,
        agree: Callable[[str], None] = lambda _: None,
        course: Course | None = None,
        policy: Policy | None = None,
        legs: Sequence[Leg] = (),
        ask: Ask = lambda _: False,
    ) -> None:
        supervisor = Supervisor(sensor, listen)
        actuator.watch = supervisor.watch
        self._legs = legs
        self._counter = SynthesisCounter()
        device = Assembly(steered(actuator, scene, settings.compensated_lag_rad), sensor)
        self._relay = Relay(device, Journals(journal, self._counter), listen, agree, ask)
        self._controller = Controller(
            told(scene, known),
            self._relay,
            synthesise,
            settings,
            self._relay,
            self._relay.listen,
            supervisor,
            self._relay.agree,
            course,
            policy,
            self._relay.ask,
        )

    def drive(self) -> Driven:
        """Drives until the run ends.

        Raises:
            InputError: The runs before it are decided otherwise now.
        """
        ended, counter = go_on(self._controller, self._relay, self._legs), self._counter
        return Driven(ended, tuple(counter.syntheses), counter.guaranteed, counter.promised)

    def retract(self) -> None:
        """Pulls the needle back to the entry, after the run has ended; see `Controller.retract`."""
        self._controller.retract()
