"""What measured positions can be true, by the motions that were commanded."""

from __future__ import annotations

import numpy as np
import pytest

from ntagen.drive.settings import Settings
from ntagen.drive.steering import Reach
from ntagen.errors import DeviceError
from ntagen.needle.estimate import Priors
from ntagen.needle.measurement import Measurement

SPARE_MM = 3.0 + 8.0 * 0.1


def seen(z_mm: float) -> Measurement:
    return Measurement(0.0, (0.0, 0.0, z_mm), 0.0)


def reach_of(*ways_mm: float) -> Reach:
    """What has been measured at 0, and then moved, with a measurement there between the moves."""
    reach = Reach(Settings(priors=Priors(noise_mm=0.1)))
    for way_mm in ways_mm:
        reach.require(seen(0.0))
        reach.moved(way_mm)
    return reach


@pytest.mark.parametrize("ways_mm", [(0.25,), (10.0, 0.25)])
def test_the_tip_may_be_as_far_as_the_needle_was_moved(ways_mm: tuple[float, ...]) -> None:
    reach_of(*ways_mm).require(seen(sum(ways_mm) + SPARE_MM - 1e-6))
    with pytest.raises(DeviceError, match=rf"moved by {sum(ways_mm):.2f} mm at most") as caught:
        reach_of(*ways_mm).require(seen(sum(ways_mm) + SPARE_MM + 1e-6))
    assert "hint:" in str(caught.value)


def test_motions_of_long_ago_do_not_count() -> None:
    reach = reach_of(10.0, 0.25, 0.25)
    with pytest.raises(DeviceError, match=r"moved by 0\.50 mm at most"):
        reach.require(seen(8.0))


@pytest.mark.parametrize("noise_mm", [0.1, 2.0])
def test_noise_alone_is_no_jump(noise_mm: float) -> None:
    rng = np.random.default_rng(1)
    reach = Reach(Settings(priors=Priors(noise_mm=noise_mm)))
    for _ in range(20_000):
        x, y, z = (float(c) for c in rng.normal(0.0, noise_mm, 3))
        reach.require(Measurement(0.0, (x, y, z), 0.0))
