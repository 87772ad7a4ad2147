"""A simulated needle whose measurements go through OpenIGTLink on this machine."""

from __future__ import annotations

import math

import pytest

from ntagen.needle.measurement import Measurement
from ntagen.needle.vectors import dot
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.scene import Needle, Pose, Vector
from ntagen.tracking.simulated import SimulatedTracker

START = Pose((1.0, 2.0, 3.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))


def near(found: Vector | None, expected: Vector | None) -> bool:
    if found is None or expected is None:
        return found is expected
    return math.dist(found, expected) < 1e-5


@pytest.mark.parametrize("reports_pose", [True, False])
def test_what_comes_back_is_what_was_measured(reports_pose: bool) -> None:
    clock = SimulatedClock()
    needle = VirtualNeedle(
        Needle(START, 30.0, 1.0), (), Errors(noise_mm=0.1), 1, clock, reports_pose=reports_pose
    )

    class Recording:
        """Keeps the measurements."""

        last: Measurement

        def measure(self) -> Measurement:
            self.last = needle.measure()
            return self.last

    recording = Recording()
    with SimulatedTracker(recording, clock.now_s, reports_pose=reports_pose) as tracker:
        for _ in range(20):
            needle.push(1.0)
            needle.roll(0.3)
            found = tracker.measure()
            sent = recording.last
            assert found.time_s == sent.time_s == clock.now_s()
            assert found.force_n == sent.force_n
            assert near(found.position_mm, sent.position_mm)
            assert near(found.heading, sent.heading)
            assert near(found.bevel, sent.bevel)
            assert found.heading is None or abs(dot(found.heading, found.heading) - 1.0) < 1e-9
