"""Which plan is followed: one after whose first part the target can still be reached."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from ntagen.drive.prospect import by_prospect
from ntagen.drive.settings import Settings
from ntagen.needle.estimate import Estimate, Estimator, Priors
from ntagen.needle.measurement import Measurement
from ntagen.needle.path import Path
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.certify import certify
from ntagen.plan.prospects import Place, Prospects, first_part
from ntagen.plan.rank import ROBUST_RANKING, Candidate, rank
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene
from tests.steering import ENTRY, scene, sphere

DRIFTING = Priors(curvature_drift=0.2, turn_drift_rad=0.2)
EXACT = Priors(0.001, 1e-4, 1e-4, 1e-4, 1e-4, 0.001)
SETTINGS = Settings(ranking=ROBUST_RANKING, priors=DRIFTING, review_mm=20.0)

# The needle bends towards -z. The target lies a little aside, so that ways lead to all its sides.
STIFF = scene(targets=[sphere("T", "target", (1.0, -45.0, -2.0), 3.0)]).with_needle(ENTRY, 80.0)


def estimated(of: Scene, priors: Priors) -> Estimate:
    """That of a needle after 10 mm."""
    needle = of.needle
    estimator = Estimator(needle.tip, needle.radius_mm, priors)
    path = Path(needle.tip)
    for number in range(40):
        path = path.push(needle.radius_mm, 0.25)
        estimator.push(0.25)
        estimator.measure(Measurement(0.25 * number, path.tip.position_mm, 0.0))
    return estimator.estimate()


def synthesis(of: Scene, *plans: Plan) -> Synthesis:
    candidates = rank([Candidate(plan, certify(plan, of)) for plan in plans], ROBUST_RANKING)
    return Synthesis(of, "", len(plans), candidates, 0.0, ranking=ROBUST_RANKING)


def at(estimate: Estimate, of: Scene) -> Scene:
    return of.with_needle(estimate.tip, estimate.radius_mm, 10.0)


def plans_of(found: Synthesis) -> list[str]:
    return [str(one.plan) for one in found.candidates]


def prospect(plan: Plan, here: Scene, estimate: Estimate) -> float:
    """The prospect of where the driver looks at a plan again."""
    look_mm = SETTINGS.review_mm
    ahead_mm = math.dist(here.needle.tip.position_mm, here.targets[-1].center_mm)
    covariance = estimate.position_covariance_mm2(ahead_mm - look_mm)
    prospects = Prospects(here, SETTINGS.margins.depth_mm)
    place = first_part(plan, look_mm).end(here.needle)
    left_mm = here.needle.length_mm - look_mm
    (judged,) = prospects.judge([Place(place)], left_mm, covariance)
    return judged.prospect


def test_plans_are_ordered_by_the_prospect_of_where_they_are_looked_at_again() -> None:
    far = scene(targets=[sphere("T", "target", (3.0, -75.0, -16.0), 3.0)])
    estimate = estimated(far.with_needle(ENTRY, 110.0), DRIFTING)
    here = at(estimate, far)
    # It bends away from the target until the driver looks at it again.
    away = Plan.of([Roll(math.pi), Push(30.0), Roll(math.pi), Push(40.0)])
    found = by_prospect(synthesis(here, away), estimate, SETTINGS, 100.0)
    assert found.candidates[-1].plan == away
    assert len(found.candidates) > 1
    values = [prospect(one.plan, here, estimate) for one in found.candidates]
    # The driver adds the noise of a measurement, and compares in steps.
    assert all(first > second - 0.1 for first, second in pairwise(values))
    assert values[0] > values[-1] + 0.1
    for one in found.candidates[:-1]:
        assert one.plan.roll_count <= here.limits.max_rolls
        assert SETTINGS.margins.allow(one.certificate)
        assert one.certificate == certify(one.plan, here)


def test_an_exact_needle_follows_the_ranking() -> None:
    estimate = estimated(STIFF, EXACT)
    here = at(estimate, STIFF)
    found = by_prospect(synthesis(here), estimate, replace(SETTINGS, priors=EXACT), 100.0)
    assert found.candidates == rank(found.candidates, ROBUST_RANKING)


def test_without_time_there_is_no_plan() -> None:
    estimate = estimated(STIFF, DRIFTING)
    found = by_prospect(synthesis(at(estimate, STIFF)), estimate, SETTINGS, 10.0)
    assert found.candidates == ()


def test_near_the_target_plans_are_looked_at_half_way() -> None:
    near = STIFF.with_targets([sphere("T", "target", (0.0, -14.0, -1.0), 3.0)])
    estimate = estimated(near, DRIFTING)
    found = by_prospect(synthesis(at(estimate, near)), estimate, SETTINGS, 100.0)
    assert found.best is not None
    assert found.best.certificate.length_mm < 8.0


def test_scenes_in_which_nothing_can_be_judged_stay_as_they_are() -> None:
    two = STIFF.with_targets([sphere("T", "target", (0.0, -20.0, 0.0), 3.0), *STIFF.targets])
    before = synthesis(two)
    assert by_prospect(before, estimated(two, DRIFTING), SETTINGS, 100.0) is before


@pytest.mark.parametrize(
    ("ranking", "expected"),
    [(ROBUST_RANKING, True), (("clearance", "rolls"), False), (("length", "reserve"), False)],
)
def test_prospects_count_where_the_reserve_comes_first(
    ranking: tuple[str, ...], expected: bool
) -> None:
    assert replace(SETTINGS, ranking=ranking).counts_reserve is expected
