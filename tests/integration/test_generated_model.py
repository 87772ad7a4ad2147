"""From a scene to verdicts and plans: the generated model in the project's own engine."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ntagen import checker
from ntagen.render import render
from ntagen.scene import Region, Scene
from tests.scenes import PAPER, paper


def check_plans(scene: Scene, plans: int) -> None:
    """Both queries of the paper have the same verdict, and the game has so many plans."""
    model = checker.load(render(scene))
    verdicts = [model.check(query.text).verdict for query in model.queries]
    assert verdicts == ["satisfied" if plans else "not satisfied"] * 2
    answer = model.check(model.queries[1].text, plans="all")
    assert len(answer.plans) == plans


@pytest.mark.parametrize(
    ("scene", "plans"),
    [
        # The hand-written enumerator in C gives these.
        (PAPER, 129),
        (paper(detections=()), 204),
        (paper(criticals=(), detections=()), 215),
        # One sphere that nothing gets past.
        (
            paper(
                criticals=(Region.ball("C1", "critical", (0.0, -25.0, 0.0), 20.0),), detections=()
            ),
            0,
        ),
    ],
    ids=["all regions", "no detection", "no region", "blocked"],
)
def test_plans_of_the_paper_scene(scene: Scene, plans: int) -> None:
    check_plans(scene, plans)


def test_an_earlier_target_that_all_paths_pass_changes_nothing() -> None:
    first = Region.ball("T0", "target", (0.0, -30.0, 0.0), 12.0)
    check_plans(paper(targets=(first, *PAPER.targets), detections=()), 204)


@pytest.mark.parametrize("safety", ["sampled", pytest.param("swept", marks=pytest.mark.slow)])
def test_no_plan_enters_an_unexplored_region_and_safe_regions_change_nothing(safety: str) -> None:
    sphere = ((0.0, -25.0, 0.0), 5.0)
    shell = paper(safety=safety)
    unknown = paper(
        safety=safety, detections=(), unexplored=(Region.ball("U1", "unexplored", *sphere),)
    )
    safe = replace(shell, safe=(Region.ball("S1", "safe", (0.0, -9.0, 0.0), 9.0),))
    counts = []
    for scene in (shell, unknown, safe):
        model = checker.load(render(scene))
        counts.append(len(model.check(model.queries[1].text, plans="all").plans))
    assert counts[0] == counts[1] == counts[2] > 0


def test_a_path_is_given_up_in_a_region_at_its_start_and_at_its_end_only_if_swept() -> None:
    # As templates/README.md says: after the last target, `sampled` does not ask any more.
    around_target = Region.ball("D1", "detection", (0.0, -50.0, 0.0), 11.0)
    around_start = Region.ball("D1", "detection", (0.0, 0.0, 0.0), 1.0)
    for region, safety, verdict in (
        (around_target, "sampled", "satisfied"),
        (around_target, "swept", "not satisfied"),
        (around_start, "sampled", "not satisfied"),
        (around_start, "swept", "not satisfied"),
    ):
        # The paths enter shell and target in the same push, and end there.
        target = Region.ball("T1", "target", (0.0, -50.0, 0.0), 10.9)
        scene = paper(targets=(target,), criticals=(), detections=(region,), safety=safety)
        answer = checker.load(render(scene)).check("E<> Checker.Final_TR_Reached")
        assert answer.verdict == verdict, (region, safety)


def test_only_the_swept_check_sees_a_small_region_between_two_pushes() -> None:
    # The first push goes from (0, 0, 0) to (0, -1.95, -0.09); the region lies half way.
    grain = Region.ball("C1", "critical", (0.0, -1.0, 0.0), 0.1)
    scene = paper(criticals=(grain,), detections=())
    answer = checker.load(render(scene)).check("E<> Checker.Final_TR_Reached")
    assert answer.verdict == "satisfied"
    swept = checker.load(render(replace(scene, safety="swept")))
    assert swept.check("E<> Checker.Final_TR_Reached").verdict == "not satisfied"
