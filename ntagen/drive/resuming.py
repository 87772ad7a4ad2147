"""What a run does first that goes on from a log: it looks, finds the needle, asks, and looks again.

The log says where the needle was, and not where it is. So several fresh readings are taken, and the
needle is found in its channel (`ntagen.drive.finding`). Then the operator is asked: nothing moves
without an answer. While somebody thinks, time goes by; so as many readings are taken once more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from ntagen.drive.device import Counts
from ntagen.drive.finding import LOOKS, Clues, Place, find, mean_mm, require_still
from ntagen.drive.learning import Learner
from ntagen.drive.records import Answered, Command, Found, Journal
from ntagen.drive.settings import Settings
from ntagen.drive.states import Event
from ntagen.drive.steering import Steering
from ntagen.drive.torsion import Lag
from ntagen.needle.measurement import Measurement

Ask = Callable[[str], bool]
"""Asks the operator whether the needle may do something."""

_SIGMAS: Final = 6.0

GO_ON: Final = "go on from {depth_mm:.2f} mm deep"
PULL_BACK: Final = "be pulled back along its channel to the entry, by {depth_mm:.2f} mm"


class Resuming:
    """Finds a needle that lies in the tissue, and asks whether the run may go on.

    Args:
        needle: The needle, with all that is known of it.
        learner: What the driver knows.
        settings: How to drive.
        journal: Records what is found and answered.
        ask: Asks the operator.
    """

    def __init__(
        self,
        needle: Steering,
        learner: Learner,
        settings: Settings,
        journal: Journal,
        ask: Ask,
    ) -> None:
        self._needle = needle
        self._learner = learner
        self._settings = settings
        self._journal = journal
        self._ask = ask
        self._origin: Counts | None = None
        # The motion in which the log was cut off, until the needle was found.
        self._pending: Command | None = None

    def begins(self) -> None:
        """Notes where the axes stand while the needle is at the entry."""
        self._origin = self._needle.counts()

    def was_cut(self, pending: Command | None) -> None:
        """Notes that a run was cut off, perhaps in a motion."""
        if pending is not None:
            self._pending = pending

    def task(self) -> Event:
        """Finds the needle, and asks.

        Raises:
            DeviceError: What is measured does not fit what is known.
            KeyboardInterrupt: The operator wants nothing of what is possible.
        """
        counts = self._needle.counts()
        looks = [self._needle.look() for _ in range(LOOKS)]
        place = find(self._clues(looks, counts), self._settings)
        self._needle.lies(place.depth_mm, place.turn_rad, place.wound_rad)
        self._pending = None
        if counts is not None:
            base_rad = self._needle.turned_rad + place.wound_rad
            self._origin = (counts[0] - place.depth_mm, counts[1] - base_rad)
        lack = "; ".join(filter(None, (place.lack, *self._dangers(place, looks))))
        self._note(place, lack)
        event = self._answer(place.depth_mm, may_go_on=not lack)
        again = [self._needle.measure() for _ in range(LOOKS)]
        require_still(again, mean_mm(looks), self._settings)
        return event

    def _clues(self, looks: list[Measurement], counts: Counts | None) -> Clues:
        """What is known of the needle."""
        counted = None
        if counts is not None and self._origin is not None:
            turned_rad = counts[1] - self._origin[1] - self._needle.turned_rad
            counted = (counts[0] - self._origin[0], turned_rad)
        lag = Lag(self._settings.compensated_lag_rad)
        return Clues(
            looks,
            self._needle.glance(),
            self._pending,
            counted,
            lag.at_rad(self._needle.depth_mm),
        )

    def _dangers(self, place: Place, looks: list[Measurement]) -> list[str]:
        """Why the driver may not go on although it knows where the needle is."""
        scene, settings = self._learner.a_priori, self._settings
        found = []
        if scene.breath is not None:
            found.append("regions move, and nothing says at which phase of the breath they are")
        if scene.limits.spins:
            found.append("plans of this task spin the needle, and the log may end within a turn")
        noise_mm = _SIGMAS * settings.priors.noise_mm + settings.priors.distortion_mm
        for region in scene.criticals if scene.breath is None else ():
            if -region.distance_mm(place.tip_mm) > noise_mm:
                found.append(f"the tip is measured in the critical region '{region.name}'")
        if settings.force_sensing:
            force_n = sum(one.force_n for one in looks) / len(looks)
            expected_n = self._learner.expected_force_n(place.depth_mm, place.tip_mm)
            allowed_n = expected_n + settings.halt_force_n + _SIGMAS * settings.force_noise_n
            if force_n > allowed_n:
                found.append(f"the force is {force_n:.2f} N, and {allowed_n:.2f} N is allowed")
        return found

    def _note(self, place: Place, lack: str) -> None:
        self._journal.record(
            Found(
                self._needle.now_s(),
                place.depth_mm,
                place.off_mm,
                place.allowed_mm,
                place.text,
                lack,
            )
        )

    def _answer(self, depth_mm: float, *, may_go_on: bool) -> Event:
        """What the operator wants.

        Raises:
            KeyboardInterrupt: Nothing of what is possible.
        """
        choices = {Event.GOES_ON: GO_ON} if may_go_on else {}
        for event, question in (choices | {Event.ONLY_BACK: PULL_BACK}).items():
            text = question.format(depth_mm=depth_mm)
            agrees = self._ask(text)
            self._journal.record(Answered(self._needle.now_s(), text, agrees))
            if agrees:
                return event
        raise KeyboardInterrupt("the operator did not agree to go on, nor to pull back")
