"""The estimates of plans in a tissue with chance, against open-loop runs of the virtual needle.

The two routes share no code but the description of the task: `tests/oracles/open_loop.py` moves the
virtual needle, the engine runs the generated model. Each comparison would fail by chance with the
risk `RISK`; with the seeds that stand here it does not.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import norm

from ntagen.nsl import loads
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.chance import Sampling, odds_of
from ntagen.units import rad_from_deg
from tests.oracles import open_loop

RISK = 1e-4
RUNS = 1500
ENGINE_RUNS = 20_000

HALF_TURN = Roll(rad_from_deg(180.0))
QUARTER = Roll(rad_from_deg(90.0))

CASES = {
    "all spreads": (
        """
environment e {
  needle { radius 50 mm  speed 1 mm/s }
  target   T1  sphere (0, -50, 4) mm  radius 4 mm
  critical C1  sphere (0, -25, 0) mm  radius 2 mm
  tissue stochastic  curvature 10 %  roll 10 deg  tip 0.5 mm
}
""",
        Plan.of([Push(12.0), HALF_TURN, Push(38.0)]),
    ),
    "only the tip": (
        """
environment e {
  needle { radius 50 mm  speed 1 mm/s }
  target   T1  sphere (0, -50, 4) mm  radius 4 mm
  critical C1  sphere (0, -25, 0) mm  radius 2 mm
  tissue stochastic  curvature 0 %  roll 0 deg  tip 0.8 mm
}
""",
        Plan.of([Push(12.0), HALF_TURN, Push(38.0)]),
    ),
    "as measured, any direction, a free bevel": (
        """
environment e {
  needle { tip (1, 2, 3) mm  heading (0.6, 0, 0.8)  bevel free  radius 40 mm  speed 2 mm/s }
  motion { step 1 s }
  target   T1  sphere (22, 3, 33) mm  radius 4 mm
  critical C1  sphere (15, 1, 14) mm  radius 2 mm
  tissue stochastic
}
""",
        Plan.of([QUARTER, Push(10.0), HALF_TURN, Push(28.0)]),
    ),
    "other shapes, two targets": (
        """
environment e {
  needle { radius 50 mm  speed 1 mm/s }
  target     T1  box (0, -30, -5) mm  size (12, 10, 6) mm
  target     T2  cylinder (-6, -52, 0) mm to (6, -50, -2) mm  radius 4 mm
  critical   C1  capsule (-8, -22, 1) mm to (8, -22, 1) mm  radius 3 mm
  detection  D1  around C1  margin 3 mm
  unexplored U1  sphere (4, -40, -9) mm  radius 3 mm
  tissue stochastic  curvature 15 %  roll 8 deg  tip 0.3 mm
}
""",
        Plan.of([Push(18.0), HALF_TURN, Push(32.0)]),
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize(("text", "plan"), CASES.values(), ids=CASES)
def test_estimates_agree_with_the_virtual_needle(text: str, plan: Plan) -> None:
    scene = loads(text)
    odds = odds_of(plan, scene, Sampling(runs=ENGINE_RUNS, seed=1))
    found = open_loop.runs(plan, scene, RUNS, seed=1)
    assert odds.touch is not None
    assert odds.clearance_mm is not None
    reached = sum(one.has_reached for one in found)
    touched = sum(one.clearance_mm <= 0.0 for one in found)
    # Else the comparison would say little.
    assert 0.05 * RUNS < reached < 0.95 * RUNS
    assert_same_share(odds.reach.value, reached / RUNS)
    assert_same_share(odds.touch.value, touched / RUNS)
    clearances = np.array([one.clearance_mm for one in found])
    away = abs(odds.clearance_mm.value - clearances.mean())
    # The places on the way are 0.2 mm apart here, and 0.25 mm in the model.
    error = clearances.std() * math.sqrt(1.0 / RUNS + 1.0 / ENGINE_RUNS)
    assert away < _wide() * error + 0.01


def assert_same_share(one: float, other: float) -> None:
    """Two shares are as near to each other as those of the same probability are."""
    share = (one * ENGINE_RUNS + other * RUNS) / (ENGINE_RUNS + RUNS)
    error = math.sqrt(share * (1.0 - share) * (1.0 / ENGINE_RUNS + 1.0 / RUNS))
    assert abs(one - other) <= _wide() * error


def _wide() -> float:
    return float(norm.isf(RISK / 2.0))
