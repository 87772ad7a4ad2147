"""Runs by a strategy against a tissue that answers: what is guaranteed, and where that ends."""

from __future__ import annotations

import json
import math
import random
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.drive.fitting import settings_for
from ntagen.drive.following import Course, Following
from ntagen.drive.log import TREE, Log, metadata_of
from ntagen.drive.reading import RunLog, read_log
from ntagen.drive.records import Followed, Guaranteed, Journals, Relied, Transition
from ntagen.drive.replay import replay
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import Maker, Result, answering, simulate
from ntagen.drive.states import Event, State
from ntagen.drive.trees import COURSE, course_to_log
from ntagen.needle import answering as tissues
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.plan.against_tissue import defend
from ntagen.plan.branches import certify_all, expected_path, path_of, stretches, worst_path
from ntagen.plan.closed_loop import Segment
from ntagen.scene import Limits, Needle, Pose, Region, Scene, Tissue
from tests.drive.runs import Diary
from tests.examples import examples
from tests.oracles.synthesiser import oracle_synthesis

_DOWN = Pose((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
_SHARE = 1e-6

SCENE = Scene(
    name="small",
    needle=Needle(_DOWN, 30.0, 1.0, 45.0),
    axis=_DOWN.heading,
    limits=Limits(5.0, (math.pi / 2, math.pi, 3 * math.pi / 2), 1, 0.0),
    targets=(Region.ball("T", "target", (0.0, -36.0, -3.0), 7.0),),
    criticals=(Region.ball("C", "critical", (0.0, -22.0, 4.0), 3.0),),
    tissue=Tissue("adversarial", 0.05, 0.03, 0.2),
    resolution_per_mm=100_000,
    safety="swept",
)


@pytest.fixture(scope="module")
def tree() -> Segment:
    """A strategy for the scene."""
    found = defend(SCENE)
    assert found.holds
    assert found.tree is not None
    return found.tree


def drive(
    course: Course | None, make: Maker, noise_mm: float = 0.0, scene: Scene = SCENE
) -> tuple[Result, Diary]:
    """A run and its diary."""
    diary, errors = Diary(), Errors(noise_mm)
    chosen = settings_for(Settings(), errors, scene, "all")
    result = simulate(
        scene, oracle_synthesis, chosen, diary, errors=errors, make=make, course=course
    )
    return result, diary


def picking(way: list[tuple[float, float]], radius_mm: float = 30.0) -> Maker:
    """Needles whose tissue makes these picks; their circle may be another than is expected."""
    return lambda needle, obstacles, seed: VirtualNeedle(
        replace(needle, radius_mm=radius_mm),
        obstacles,
        Errors(),
        seed,
        SimulatedClock(),
        answers=tissues.given(way),
    )


def leaves(tree: Segment, scene: Scene) -> list[tuple[int, ...]]:
    """All ways to the target."""
    return [one.numbers for one in stretches(tree, scene) if one.branch.then is None]


def check_guaranteed(result: Result, diary: Diary, scene: Scene = SCENE) -> None:
    tip_mm = scene.tissue.tip_mm
    assert result.ended.outcome == State.TARGET_REACHED.value
    assert result.syntheses == ()
    assert result.clearance_mm >= tip_mm
    assert -result.target_distance_mm >= tip_mm
    assert [record.reason for record in diary.of(Guaranteed)] == [""]


def check_way(tree: Segment, way: tuple[int, ...], scene: Scene) -> None:
    """A tissue that picks corners is known for what it is, and nothing happens."""
    path = path_of(tree, scene, way)
    picks = [(one.branch.factor, one.branch.roll_error_rad) for one in path]
    make = picking(picks, scene.needle.radius_mm)
    result, diary = drive(Course(tree, only_guaranteed=True), make, scene=scene)
    check_guaranteed(result, diary, scene)
    assert [one.way for one in diary.of(Followed)] == [
        tuple(map(float, one.numbers)) for one in path
    ]
    assert diary.of(Guaranteed)[0].most_off_mm < _SHARE
    end_mm = path[-1].arc.end.position_mm
    assert math.isclose(
        result.target_distance_mm, scene.targets[-1].distance_mm(end_mm), abs_tol=_SHARE
    )


@settings(max_examples=examples(12), deadline=None)
@given(data=st.data())
def test_a_tissue_that_picks_corners_can_do_nothing(tree: Segment, data: st.DataObject) -> None:
    check_way(tree, data.draw(st.sampled_from(leaves(tree, SCENE))), SCENE)


@pytest.mark.slow
def test_no_way_through_a_strategy_leads_out_of_it(tree: Segment) -> None:
    for way in leaves(tree, SCENE):
        check_way(tree, way, SCENE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("free", "rolls", "target"),
    [(True, 1, (4.0, -34.0, 2.0)), (False, 2, (4.0, -40.0, -4.0)), (False, 1, (0.0, -38.0, 3.0))],
)
def test_corners_do_nothing_in_other_tasks(
    free: bool, rolls: int, target: tuple[float, float, float]
) -> None:
    scene = replace(
        SCENE,
        needle=Needle(_DOWN, 50.0, 1.0, 60.0),
        limits=replace(SCENE.limits, max_rolls=rolls, free_bevel=free),
        targets=(Region.ball("T", "target", target, 7.0),),
        criticals=(Region.ball("C", "critical", (12.0, -20.0, 0.0), 3.0),),
    )
    found = defend(scene)
    assert found.tree is not None
    assert found.holds
    ways = leaves(found.tree, scene)
    for way in random.Random(1).sample(ways, min(20, len(ways))):
        check_way(found.tree, way, scene)


@pytest.fixture(scope="module")
def near(tree: Segment) -> Scene:
    """The scene with its region as near to the branches as they can bear."""
    ends = [one.arc for one in stretches(tree, SCENE) if one.branch.then is None]
    middles = [arc.pose_at(0.7 * arc.length_mm).position_mm for arc in ends]
    x, y, z = (sum(axis) / len(middles) for axis in zip(*middles, strict=True))
    for tenths in range(40, 100):
        away_mm = 0.1 * tenths
        middle = (x + 0.866 * away_mm, y, z + 0.5 * away_mm)
        scene = replace(SCENE, criticals=(Region.ball("C", "critical", middle, 4.0),))
        if certify_all(tree, scene).holds(SCENE.tissue.tip_mm + 0.01):
            return scene
    raise AssertionError("no place is free")


def test_a_known_region_beside_a_branch_is_no_surprise(tree: Segment, near: Scene) -> None:
    # The force rises there, as it must where the branch leads.
    for way in leaves(tree, near)[::3]:
        check_way(tree, way, near)


@settings(max_examples=examples(10), deadline=None)
@given(seed=st.integers(0, 10**6), radius_mm=st.floats(28.0, 32.0))
def test_what_is_guaranteed_holds_whatever_the_tissue_does(
    tree: Segment, near: Scene, seed: int, radius_mm: float
) -> None:
    random_picks = random.Random(seed)
    picks = [
        (1.0 + random_picks.uniform(-0.05, 0.05), random_picks.uniform(-0.03, 0.03))
        for _ in range(2)
    ]
    course = Course(tree, only_guaranteed=True)
    result, diary = drive(course, picking(picks, radius_mm), scene=near)
    (kept,) = diary.of(Guaranteed)
    assert kept.most_off_mm <= kept.allowed_mm
    # The mean of some readings is late by less than this.
    assert result.clearance_mm > -0.02
    if result.ended.outcome == State.TARGET_REACHED.value:
        assert kept.reason == ""
        assert result.target_distance_mm < 0.02
    else:
        assert result.ended.outcome == State.NOT_GUARANTEED.value


@pytest.mark.parametrize("kind", ["corners", "between", "worst", "expected"])
def test_simulated_tissues_keep_to_their_bounds(tree: Segment, kind: str) -> None:
    for seed in range(3):
        make = answering(Errors(), SCENE, kind, tree)
        needle = make(SCENE.needle, (), seed)
        needle.push(10.0)
        needle.roll(1.0)
        needle.roll_on(0.5)
        needle.push(10.0)
        first, second = needle.pierced
        for arc in (first, second):
            assert 30.0 / 1.05 - _SHARE <= arc.radius_mm <= 30.0 / 0.95 + _SHARE
        if kind in ("corners", "worst", "expected"):
            assert any(math.isclose(30.0 / first.radius_mm, f) for f in SCENE.tissue.factors)


def test_what_is_worst_for_a_strategy_is_what_its_certificate_says(tree: Segment) -> None:
    result, diary = drive(Course(tree), answering(Errors(), SCENE, "worst", tree))
    check_guaranteed(result, diary)
    reach = certify_all(tree, SCENE)
    least_mm = min(reach.clearance_mm, reach.depth_mm)
    assert min(result.clearance_mm, -result.target_distance_mm) == pytest.approx(least_mm, abs=0.02)
    assert worst_path(tree, SCENE)[-1].branch.then is None
    assert expected_path(tree, SCENE)[0].branch.factor == 1.0


def test_a_strategy_is_followed_through_noise(tree: Segment) -> None:
    for seed in range(3):
        errors, diary = Errors(0.05), Diary()
        result = simulate(
            SCENE,
            oracle_synthesis,
            settings_for(Settings(), errors, SCENE, "all"),
            diary,
            errors=errors,
            make=answering(errors, SCENE, "corners"),
            seed=seed,
            course=Course(tree),
        )
        assert result.target_distance_mm < 0.0
        assert result.clearance_mm > 0.0
        assert len(diary.of(Guaranteed)) == 1


def test_the_run_says_where_the_guarantee_ends_and_goes_on_by_plans(tree: Segment) -> None:
    result, diary = drive(Course(tree), picking([], radius_mm=24.0))
    (kept,) = diary.of(Guaranteed)
    assert "nearest branch, and 0.2 mm is allowed" in kept.reason
    assert 0.0 < kept.until_mm < result.ended.depth_mm
    assert kept.most_off_mm <= 0.2
    assert result.guaranteed == kept
    assert result.ended.syntheses > 0
    assert Event.OFF_TREE.value in [record.event for record in diary.of(Transition)]
    assert "strategy with" in diary.of(Relied)[0].text


def test_only_what_is_guaranteed_is_driven_if_that_is_wanted(tree: Segment) -> None:
    result, diary = drive(Course(tree, only_guaranteed=True), picking([], radius_mm=24.0))
    assert result.ended.outcome == State.NOT_GUARANTEED.value
    assert result.ended.syntheses == 0
    assert result.ended.depth_mm - diary.of(Guaranteed)[0].until_mm <= 0.25 + _SHARE
    nothing = Course(None, only_guaranteed=True, lack="no strategy wins")
    result, diary = drive(nothing, picking([]))
    assert result.ended.outcome == State.NO_STRATEGY.value
    assert result.ended.depth_mm == 0.0
    assert result.guaranteed is None


def test_a_region_that_nobody_knew_ends_the_guarantee(tree: Segment) -> None:
    way = expected_path(tree, SCENE)
    x, y, z = way[0].arc.pose_at(0.9 * way[0].branch.length_mm).position_mm
    hidden = Region.ball("H", "critical", (x, y, z), 2.0)
    scene = replace(SCENE, criticals=(*SCENE.criticals, hidden))
    diary, errors = Diary(), Errors()
    for only in (False, True):
        result = simulate(
            scene,
            oracle_synthesis,
            settings_for(Settings(), errors, scene, "C"),
            diary,
            known="C",
            make=picking([]),
            course=Course(tree, only_guaranteed=only),
        )
        assert result.clearance_mm > 0.0
        assert "force rises" in diary.of(Guaranteed)[-1].reason
        assert (result.ended.outcome == State.NOT_GUARANTEED.value) == only


def test_a_strategy_that_may_not_end_in_time_is_not_begun(tree: Segment) -> None:
    result = simulate(
        SCENE,
        oracle_synthesis,
        Settings(timeout_s=20.0),
        Diary(),
        make=picking([]),
        course=Course(tree),
    )
    assert result.ended.outcome == State.NO_TIME_LEFT.value
    assert result.ended.depth_mm == 0.0


def logged(path: Path, course: Course, radius_mm: float) -> RunLog:
    """The log of a run with noise."""
    said, attached = course_to_log(course)
    chosen = settings_for(Settings(), Errors(0.05), SCENE, "all")
    metadata = metadata_of({"settings": chosen.to_json(), COURSE: said})
    with Log(path, metadata, {} if attached is None else {TREE: attached}) as log:
        make = picking([(1.05, 0.0), (0.95, 0.03)], radius_mm)
        simulate(SCENE, oracle_synthesis, chosen, Journals(log), make=make, seed=2, course=course)
    return read_log(path)


@pytest.mark.parametrize(("radius_mm", "only"), [(30.0, True), (24.0, False), (24.0, True)])
def test_a_run_by_a_strategy_is_decided_again_from_its_log(
    tree: Segment, tmp_path: Path, radius_mm: float, only: bool
) -> None:
    run = logged(tmp_path / "run.mcap", Course(tree, only), radius_mm)
    assert run.course == Course(tree, only)
    comparison = replay(run, oracle_synthesis)
    assert comparison.is_same, comparison
    assert comparison.complete
    # Another strategy decides differently.
    other = json.loads(run.attachments[TREE])
    for branch in other["branches"]:
        branch["length_mm"] -= 5.0
    attachments = run.attachments | {TREE: json.dumps(other).encode()}
    assert not replay(replace(run, attachments=attachments), oracle_synthesis).is_same


def test_following_does_not_move_what_it_is_not_told(tree: Segment) -> None:
    following = Following(tree, SCENE, Settings())
    assert following.expected() == _DOWN
    assert following.off_mm() == 0.0
    following.note(0.0, (0.0, 5.0, 0.0))
    assert not following.is_near()
