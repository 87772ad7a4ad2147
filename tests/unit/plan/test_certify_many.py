"""Many certificates at once are those of single plans, and pages of plans are all plans."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace

import pytest

from ntagen import checker
from ntagen.needle.nearest import TOLERANCE_MM
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.certify import Certificate, certify
from ntagen.plan.certify_many import certify_all
from ntagen.plan.document import plan_document, plan_line
from ntagen.plan.extract import extract, pages_of
from ntagen.plan.prospects import first_part
from ntagen.plan.rank import Candidate
from ntagen.plan.synthesise import STRATEGY_QUERY, Margins
from ntagen.render import render
from ntagen.scene import Region, Scene
from ntagen.shapes import Box, Capsule, Cylinder, HalfSpace, Sphere
from tests.scenes import PAPER, with_limits

NEAR_MM = 1e-9

ON_THE_WAY = Region.ball("T0", "target", (0.0, -20.0, -3.0), 4.0)
SCENES = {
    "paper": PAPER,
    "two targets": replace(PAPER, targets=(ON_THE_WAY, *PAPER.targets)),
    "capsule": replace(
        PAPER,
        criticals=(
            Region("V", "critical", Capsule((-9.0, -20.0, 4.0), (9.0, -20.0, 4.0), 1.0, 1.0)),
            *PAPER.criticals,
        ),
    ),
    "solids": replace(
        PAPER,
        criticals=(
            *PAPER.criticals,
            Region("B", "critical", Box((5.0, -30.0, 2.0), (4.0, 6.0, 3.0)).grown(0.7)),
            Region("C", "critical", Cylinder((-6.0, -40.0, 0.0), (-6.0, -40.0, 9.0), 2.0)),
        ),
        unexplored=(Region("H", "unexplored", HalfSpace((0.0, 0.0, 40.0), (0.0, 0.1, 1.0))),),
    ),
    "free bevel": with_limits(PAPER, free_bevel=True),
}


def some_plans() -> list[Plan]:
    """Plans that share their beginnings, also without a push, and with two rolls at a place."""
    angles = [math.radians(angle) for angle in (0.0, 45.0, 90.0, 250.0)]
    pushes = (0.0, 2.0, 14.0, 37.0)
    ways = itertools.product(pushes, angles, pushes, angles, pushes)
    return [
        Plan.of([Push(a), Roll(first), Push(b), Roll(second), Push(c)])
        for a, first, b, second, c in ways
    ]


def numbers(certificate: Certificate) -> list[float]:
    """All lengths and places of a certificate; -1 where a target is not entered."""
    found = [*certificate.end_mm, certificate.end_distance_mm, certificate.length_mm]
    for arrival in certificate.arrivals:
        entered_mm = -1.0 if arrival.entered_at_mm is None else arrival.entered_at_mm
        found += [entered_mm, arrival.depth_mm]
    return found


def error_mm(region: Region) -> float:
    """How far two certificates may be apart."""
    return NEAR_MM if isinstance(region.shape, Sphere) else TOLERANCE_MM


@pytest.mark.parametrize("name", SCENES)
def test_many_certificates_are_those_of_single_plans(name: str) -> None:
    scene, plans = SCENES[name], some_plans()
    for plan, together in zip(plans, certify_all(plans, scene), strict=True):
        alone = certify(plan, scene)
        assert numbers(together) == pytest.approx(numbers(alone), abs=NEAR_MM)
        assert together.roll_count == alone.roll_count
        names = [(one.region, one.kind) for one in together.clearances]
        assert names == [(one.region, one.kind) for one in alone.clearances]
        for near, same, region in zip(
            together.clearances, alone.clearances, scene.avoided, strict=True
        ):
            assert near.distance_mm == pytest.approx(same.distance_mm, abs=error_mm(region))
            # Where two places are equally near, either may be given.
            if error_mm(region) == NEAR_MM:
                assert near.at_mm == pytest.approx(same.at_mm, abs=1e-6)
                continue
            place = Plan.of(first_part(plan, near.at_mm).actions).end(scene.needle).position_mm
            away_mm = region.distance_mm(place)
            assert 0.0 <= away_mm - near.distance_mm <= TOLERANCE_MM + NEAR_MM


@pytest.mark.parametrize("name", SCENES)
def test_lines_are_those_of_json(name: str) -> None:
    scene, plans = SCENES[name], some_plans()
    for plan, certificate in zip(plans, certify_all(plans, scene), strict=True):
        candidate = Candidate(plan, certificate)
        expected = json.dumps(plan_document(candidate, Margins()))
        assert plan_line(candidate, Margins()) == expected


@pytest.mark.parametrize("scene", [PAPER, with_limits(PAPER, free_bevel=True)])
def test_pages_have_all_plans_in_the_order_of_the_model(scene: Scene) -> None:
    answer = checker.load(render(scene, only_plans=True)).check(STRATEGY_QUERY, plans="all")
    plans = list(itertools.chain.from_iterable(pages_of(answer, scene)))
    assert plans == list(extract(answer.plans, scene))
    assert len(plans) == answer.plan_count == len(set(plans))
