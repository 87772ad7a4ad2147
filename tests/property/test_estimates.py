"""Whatever is done with a phantom, its estimate is a needle that says how much it errs."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.drive.configure import configure
from ntagen.drive.deviation import require_explained
from ntagen.drive.fitting import settings_for_phantom
from ntagen.needle.estimate import Estimator
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.phantom_parameters import PhantomParameters, Sensing
from ntagen.needle.vectors import distance
from ntagen.needle.virtual import SimulatedClock
from ntagen.scene import Needle
from tests.steering import ENTRY, PAPER

NEEDLE = Needle(ENTRY, 30.0, 1.0)
USUAL = configure([], PAPER, needle="phantom").settings

moves = st.lists(
    st.one_of(
        st.tuples(st.just("push"), st.floats(0.1, 15.0)),
        st.tuples(st.just("roll"), st.floats(-math.pi, math.pi)),
        st.tuples(st.just("pull"), st.floats(0.1, 20.0)),
    ),
    max_size=8,
)


@settings(max_examples=40, deadline=None)
@given(moves, st.integers(0, 1000), st.sampled_from([0.05, 0.3, 1.0]), st.booleans())
def test_any_history_of_a_phantom_has_an_estimate(
    history: list[tuple[str, float]], seed: int, noise_mm: float, directed: bool
) -> None:
    parameters = PhantomParameters(sensing=Sensing(noise_mm=noise_mm, latency_s=0.0))
    fitted = settings_for_phantom(USUAL, parameters, PAPER, "all")
    device = PhantomNeedle(NEEDLE, (), seed, SimulatedClock(), parameters, reports_pose=directed)
    estimator = Estimator(ENTRY, 30.0, fitted.priors)
    for kind, value in history:
        count = math.ceil(value / 0.5) if kind == "push" else 1
        for _ in range(count):
            getattr(device, kind)(value / count)
            getattr(estimator, kind)(value / count)
            if kind != "roll":
                estimator.measure(device.measure())
    estimate = estimator.estimate()
    require_explained(estimate, fitted, 30.0)
    assert distance(estimate.tip.position_mm, device.true_tip.position_mm) < 1.0 + 3.0 * noise_mm
    before = 0.0
    for length_mm in (0.0, 1.0, 10.0, 30.0, 150.0):
        covariance = estimate.position_covariance_mm2(length_mm)
        assert np.all(np.isfinite(covariance))
        assert np.linalg.eigvalsh(covariance)[0] > 0.0
        now = estimate.position_std_mm(length_mm)
        # A short push may come nearer to what is known.
        assert now > 0.8 * before
        before = now
