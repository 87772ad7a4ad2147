"""What the driver learns from measurements: where the force rises, and what targets are reached."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from ntagen.drive.force import ForceMonitor, Rise, stop_force_n
from ntagen.drive.knowledge import Knowledge, assumed_of, position_unsure_mm
from ntagen.drive.records import Breathed, Forgotten, Journal, Learned, Visited
from ntagen.drive.settings import Settings
from ntagen.drive.steering import Steering
from ntagen.needle.contact import Contact
from ntagen.needle.kinematics import orthonormal
from ntagen.needle.measurement import Measurement
from ntagen.scene import Pose, Scene, Vector


class Learner:
    """The knowledge of a run, and what adds to it.

    Args:
        scene: The a-priori scene.
        settings: How to drive.
        needle: The needle.
        journal: Records what is learned.

    Attributes:
        knowledge: What is known.
    """

    def __init__(
        self, scene: Scene, settings: Settings, needle: Steering, journal: Journal
    ) -> None:
        self.knowledge = Knowledge(scene)
        self._settings = settings
        self._needle = needle
        self._journal = journal
        self._force = ForceMonitor(settings, scene.needle.length_mm)
        self._rise: Rise | None = None
        self._started_s = 0.0

    @property
    def a_priori(self) -> Scene:
        """What was known at the start."""
        return self.knowledge.a_priori

    def clock_s(self, at_s: float) -> float:
        """The time of the breath at a time of the device; 0 where nothing moves."""
        breath = self.a_priori.breath
        if breath is None:
            return 0.0
        return (breath.clock_s + at_s - self._started_s) % breath.period_s

    def clock_now_s(self) -> float:
        """The time of the breath now; it is recorded, since decisions depend on it."""
        if self.a_priori.breath is None:
            return 0.0
        now_s = self._needle.now_s()
        clock_s = self.clock_s(now_s)
        self._journal.record(Breathed(now_s, clock_s))
        return clock_s

    def scene(self, tip: Pose, radius_mm: float, depth_mm: float) -> Scene:
        """The known scene now; see `Knowledge.scene`."""
        scene = self.knowledge.scene(tip, radius_mm, depth_mm, self.clock_now_s())
        return scene.with_shaft(self._needle.shaft_mm(depth_mm) if scene.breath else ())

    @property
    def has_visited_all(self) -> bool:
        """Whether all targets were reached."""
        return self.knowledge.visited == len(self.a_priori.targets)

    def arm(self, measurement: Measurement) -> None:
        """Takes the measurement before anything moves; the clock of the breath begins."""
        self._started_s = measurement.time_s
        if self._settings.force_sensing:
            tip_mm = self.a_priori.needle.tip.position_mm
            self._force.note(0.0, measurement.force_n, self._explained_n(tip_mm))

    def expected_force_n(self, depth_mm: float, tip_mm: Vector) -> float:
        """The force that insertion and known regions explain, when the tip is there."""
        return self._force.expected_n(depth_mm) + self._explained_n(tip_mm)

    def _explained_n(self, tip_mm: Vector) -> float:
        clock_s = self.clock_s(self._needle.seen_s)
        return self.knowledge.expected_force_n(tip_mm, self._settings, clock_s)

    def feels(self, measurement: Measurement) -> bool:
        """Whether the force rises more than plain insertion and known regions explain."""
        if not self._settings.force_sensing:
            return False
        tip_mm = self._needle.path.tip.position_mm
        allowed_n = self._explained_n(tip_mm)
        note = self._force.note if self._needle.cuts else self._force.note_in_channel
        self._rise = note(self._needle.depth_mm, measurement.force_n, allowed_n)
        return self._rise is not None

    def learn(self) -> None:
        """Turns a rise that was felt into a region, ahead of where it was felt."""
        rise, self._rise = self._rise, None
        if rise is None:
            return
        self._force.forget_rise()
        known = self.knowledge.with_contact(
            self._contact(rise),
            assumed_of(self._settings),
            self._needle.channels,
            position_unsure_mm(self._settings),
            self.clock_s(self._needle.seen_s),
        )
        self._know(known)

    def recall(self) -> None:
        """Records what runs before this one learned, and learns what their last reading felt."""
        before = self.knowledge.learned
        self.learn()
        for region in self.knowledge.learned:
            if region in before:
                self._journal.record(Learned.of(self._needle.now_s(), region))

    def doubt(self) -> bool:
        """Assumes smaller regions where some were felt; whether any got smaller."""
        known = self.knowledge.doubted(assumed_of(self._settings))
        if known is None:
            return False
        self._know(known)
        return True

    @contextmanager
    def supposing_least(self) -> Iterator[bool]:
        """Supposes that the felt regions are as small as can be; whether that makes any smaller."""
        before = self.knowledge
        least = before.doubted(assumed_of(self._settings), 0.0)
        self.knowledge = least or before
        try:
            yield least is not None
        finally:
            self.knowledge = before

    def _know(self, known: Knowledge) -> None:
        """Records what is learned, and what is not assumed any more."""
        before, self.knowledge = self.knowledge.learned, known
        for region in self.knowledge.learned:
            if region not in before:
                self._journal.record(Learned.of(self._needle.now_s(), region))
        kept = {(region.kind, region.name) for region in self.knowledge.learned}
        for region in before:
            if (region.kind, region.name) not in kept:
                self._journal.record(Forgotten(self._needle.now_s(), region.name, region.kind))

    def _contact(self, rise: Rise) -> Contact:
        """Where a region was felt, and how far it is away from there.

        A needle that stops as soon as it feels a region has just felt it, where the rise began.
        """
        path, risen_mm = self._needle.glance().path, 0.0
        if stop_force_n(self._settings) > 0.0:
            risen_mm = rise.force_n / self._settings.force_rise_n_per_mm
        else:
            path = path.pull(rise.felt_mm - rise.began_mm)
        tip = orthonormal(path.tip)
        away_mm = max(0.0, self._settings.sensing_margin_mm - risen_mm)
        return Contact(tip.position_mm, tip.heading, away_mm)

    def visit(self, position_mm: Vector, *, last_too: bool) -> None:
        """Counts targets that the tip has reached; the last one only with `last_too`."""
        targets = self.a_priori.targets
        while self.knowledge.visited < len(targets):
            target = targets[self.knowledge.visited]
            is_last = self.knowledge.visited == len(targets) - 1
            if is_last and not last_too:
                return
            if target.distance_at_mm(position_mm, self.clock_s(self._needle.seen_s)) > 0.0:
                return
            self.knowledge = self.knowledge.visiting()
            self._journal.record(Visited(self._needle.now_s(), target.name))
