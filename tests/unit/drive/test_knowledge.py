"""What is told, what is learned, and that learning converges."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.drive.knowledge import Knowledge, told
from ntagen.drive.settings import Settings
from ntagen.drive.shells import sensing_margin_mm, shells_of
from ntagen.errors import InputError
from ntagen.needle.contact import Assumed, Contact
from ntagen.needle.kinematics import Arc
from ntagen.needle.vectors import distance
from ntagen.scene import Pose, Region
from tests.steering import CRITICAL, DETECTION, ENTRY, PAPER, scene, sphere

OTHER = sphere("C2", "critical", (20.0, -25.0, 0.0), 2.0)
PLAIN_SHELL = sphere("D2", "detection", (20.0, -25.0, 0.0), 4.0)
TWO = scene(CRITICAL, OTHER, DETECTION, PLAIN_SHELL)
ASSUMED = Assumed(margin_mm=3.0, clearance_mm=3.0, radius_mm=2.0)
"""The needle stops as soon as it feels a region."""


def pose_at(x: float, y: float, z: float) -> Pose:
    return Pose((x, y, z), ENTRY.heading, ENTRY.bevel)


def felt_at(tip: Pose, away_mm: float = 3.0) -> Contact:
    return Contact(tip.position_mm, tip.heading, away_mm)


def check_told(known: str, *names: str) -> None:
    kept = told(TWO, known)
    assert [region.name for region in kept.criticals + kept.detections] == list(names)
    assert kept.targets == TWO.targets


def test_all_is_everything() -> None:
    check_told("all", "C1", "C2", "D1", "D2")


def test_none_hides_the_shells_too() -> None:
    check_told("none")


def test_a_shell_belongs_to_the_region_that_it_contains() -> None:
    check_told("C2", "C2", "D2")
    check_told(" C1 ", "C1", "D1")


def test_an_unknown_name_is_refused_with_the_choice() -> None:
    with pytest.raises(InputError, match="choose from all, none, C1, C2"):
        told(TWO, "C1,C3")


def test_the_sensing_margin_is_the_depth_of_the_shell() -> None:
    assert shells_of(OTHER, TWO.detections) == (PLAIN_SHELL,)
    assert sensing_margin_mm(OTHER, TWO.detections, 9.0) == pytest.approx(2.0)
    assert sensing_margin_mm(CRITICAL, (), 9.0) == pytest.approx(9.0)


def test_a_contact_becomes_a_ball_ahead_whose_shell_touches_the_tip() -> None:
    tip = pose_at(0.0, -10.0, 0.0)
    learned = Knowledge(scene()).with_contact(felt_at(tip), ASSUMED).learned
    ball, shell = learned
    assert (ball.kind, ball.center_mm, ball.radius_mm) == ("critical", (0.0, -15.0, 0.0), 2.0)
    assert (shell.kind, shell.around, shell.radius_mm) == ("detection", ball.name, 5.0)
    assert distance(tip.position_mm, shell.center_mm) == pytest.approx(shell.radius_mm)


def test_a_region_that_may_be_passed_has_a_thin_shell() -> None:
    assumed = replace(ASSUMED, clearance_mm=0.75)
    contact = felt_at(pose_at(0.0, -10.0, 0.0), away_mm=1.0)
    ball, shell = Knowledge(scene()).with_contact(contact, assumed).learned
    assert (ball.center_mm, ball.radius_mm) == ((0.0, -13.0, 0.0), 2.0)
    # The place of the contact is not tried again.
    assert shell.radius_mm == pytest.approx(3.0)


def test_contacts_far_apart_stay_two_regions() -> None:
    knowledge = Knowledge(scene()).with_contact(felt_at(pose_at(0.0, -10.0, 0.0)), ASSUMED)
    knowledge = knowledge.with_contact(felt_at(pose_at(15.0, -10.0, 0.0)), ASSUMED)
    assert [r.kind for r in knowledge.learned].count("critical") == 2


def test_contacts_with_nothing_between_them_become_one_region() -> None:
    knowledge = Knowledge(scene()).with_contact(felt_at(pose_at(0.0, -10.0, 0.0)), ASSUMED)
    knowledge = knowledge.with_contact(felt_at(pose_at(6.0, -10.0, 0.0)), ASSUMED)
    (ball,) = (r for r in knowledge.learned if r.kind == "critical")
    for x in (0.0, 6.0):
        felt_at_mm = distance(ball.center_mm, (x, -10.0, 0.0)) - ball.radius_mm
        assert felt_at_mm == pytest.approx(3.0, abs=1.0)


def test_a_contact_near_a_known_region_widens_its_shell() -> None:
    tip = pose_at(0.0, -20.2, 0.0)
    knowledge = Knowledge(PAPER).with_contact(felt_at(tip), ASSUMED)
    (shell,) = knowledge.learned
    assert (shell.kind, shell.center_mm) == ("detection", CRITICAL.center_mm)
    again = knowledge.with_contact(felt_at(tip), ASSUMED)
    assert again.learned[0].radius_mm > shell.radius_mm > DETECTION.radius_mm
    assert len(again.learned) == 1


contacts = st.lists(st.tuples(*[st.floats(-20.0, 20.0)] * 3), min_size=1, max_size=12)


@given(contacts)
def test_learned_shells_cover_every_contact(
    places: list[tuple[float, float, float]],
) -> None:
    knowledge = Knowledge(scene())
    for place in places:
        knowledge = knowledge.with_contact(felt_at(pose_at(*place)), ASSUMED)
        assert covered(place, knowledge.learned)
    assert all(covered(place, knowledge.learned) for place in places)


def covered(place: tuple[float, float, float], regions: tuple[Region, ...]) -> bool:
    return any(distance(place, r.center_mm) <= r.radius_mm + 1e-9 for r in regions)


def test_visited_targets_are_planned_for_no_more() -> None:
    near = sphere("near", "target", (0.0, -8.0, 0.0), 3.0)
    far = sphere("far", "target", (0.0, -20.0, 0.0), 3.0)
    knowledge = Knowledge(scene(targets=[near, far])).visiting()
    assert knowledge.scene(ENTRY, 30.0).targets == (far,)


def test_what_was_cut_safely_is_never_covered_by_a_learned_region() -> None:
    channel = (Arc(pose_at(4.0, 0.0, 0.0), math.inf, 40.0),)
    places = [(0.0, -10.0, 0.0), (8.0, -10.0, 0.0)]
    knowledge = Knowledge(scene())
    for place in places:
        knowledge = knowledge.with_contact(felt_at(pose_at(*place)), ASSUMED, channel)
    balls = [region for region in knowledge.learned if region.kind == "critical"]
    assert balls
    for ball in balls:
        assert channel[0].nearest_to(ball.center_mm).distance_mm > ball.radius_mm


def test_a_plan_may_leave_a_shell_but_not_lead_deeper_into_it() -> None:
    inside = pose_at(0.0, -21.0, 0.0)
    (shell,) = Knowledge(PAPER).scene(inside, 30.0).detections
    assert shell.radius_mm == pytest.approx(4.0 - 0.1)
    (whole,) = Knowledge(PAPER).scene(pose_at(0.0, 0.0, 0.0), 30.0).detections
    assert whole.radius_mm == 5.0


def test_known_regions_explain_a_rise_up_to_their_surface() -> None:
    knowledge, settings = Knowledge(PAPER), Settings()
    forces = [
        knowledge.expected_force_n((0.0, -25.0 + away, 0.0), settings) for away in (9.0, 5.2, 3.0)
    ]
    assert forces[0] == 0.0 < forces[1] < forces[2]


def test_a_learned_region_does_not_reach_into_a_safe_one() -> None:
    tip = pose_at(0.0, -10.0, 0.0)
    safe = sphere("S", "safe", (3.0, -15.0, 0.0), 2.0)
    knowledge = Knowledge(replace(scene(), safe=(safe,))).with_contact(felt_at(tip), ASSUMED)
    ball, shell = knowledge.learned
    assert ball.radius_mm == pytest.approx(1.0)
    assert distance(tip.position_mm, shell.center_mm) <= shell.radius_mm + 1e-9


def test_a_smaller_region_has_its_surface_where_it_was_felt() -> None:
    contact = felt_at(pose_at(0.0, -20.0, 0.0), away_mm=0.75)
    assumed = replace(ASSUMED, clearance_mm=0.75)
    known = Knowledge(scene()).with_contact(contact, assumed)
    for radius_mm in (1.0, 0.5):
        smaller = known.doubted(assumed)
        assert smaller is not None
        ball, shell = smaller.learned
        assert ball.radius_mm == radius_mm
        assert ball.distance_mm(contact.position_mm) == pytest.approx(0.75)
        # So the same way is not tried again.
        assert shell.distance_mm(contact.position_mm) == pytest.approx(0.0, abs=1e-9)
        known = smaller
    assert known.doubted(assumed) is None


def test_a_smaller_region_keeps_all_its_contacts_in_its_shell() -> None:
    contacts = [felt_at(pose_at(x, -20.0, 0.0)) for x in (-2.0, 2.0)]
    known = Knowledge(scene())
    for one in contacts:
        known = known.with_contact(one, ASSUMED)
    smaller = known.doubted(ASSUMED)
    assert smaller is not None
    ball, shell = smaller.learned
    assert ball.radius_mm < known.learned[0].radius_mm
    assert all(shell.distance_mm(one.position_mm) <= 1e-9 for one in contacts)


def test_nothing_that_was_told_gets_smaller() -> None:
    known = Knowledge(scene(CRITICAL, DETECTION))
    assert known.doubted(ASSUMED) is None
