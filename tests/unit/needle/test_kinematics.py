"""Kinematics: the paper's reference walk, and closed forms against dense sampling."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.needle.kinematics import Arc, circle_center, orthonormal, push, roll
from ntagen.needle.path import Path
from ntagen.needle.vectors import distance, dot, norm, rotate
from ntagen.scene import Pose, Vector
from tests.steering import ENTRY

lengths_mm = st.floats(0.0, 250.0)
radii_mm = st.floats(5.0, 500.0)
angles_rad = st.floats(-math.pi, math.pi)
points_mm = st.tuples(*[st.floats(-100.0, 100.0)] * 3)
directions = points_mm.filter(lambda v: norm(v) > 1.0)


@st.composite
def poses(draw: st.DrawFn) -> Pose:
    heading = draw(directions)
    bevel = draw(directions)
    square = norm(
        (
            heading[1] * bevel[2] - heading[2] * bevel[1],
            heading[2] * bevel[0] - heading[0] * bevel[2],
            heading[0] * bevel[1] - heading[1] * bevel[0],
        )
    )
    if square < 0.1 * norm(heading) * norm(bevel):
        bevel = rotate(heading, (1.0, 0.0, 0.0), 1.0)
        if abs(heading[0]) > 0.9 * norm(heading):
            bevel = rotate(heading, (0.0, 1.0, 0.0), 1.0)
    return orthonormal(Pose(draw(points_mm), heading, bevel))


def check_close(actual: Vector, expected: Vector, within: float = 1e-9) -> None:
    assert distance(actual, expected) <= within, (actual, expected)


def test_five_pushes_of_the_paper_end_on_the_exact_circle() -> None:
    pose = ENTRY
    for _ in range(5):
        pose = push(pose, 30.0, 2.0)
    expected = (0.0, -30.0 * math.sin(1 / 3), -30.0 * (1.0 - math.cos(1 / 3)))
    check_close(pose.position_mm, expected)
    # The model's integers end at (0, -9.72, -1.62): the exact arc is about one per cent longer.
    assert 0.005 < 1.0 - 9.72 / -pose.position_mm[1] < 0.015


def test_half_a_turn_ends_opposite_the_start() -> None:
    pose = push(ENTRY, 30.0, 30.0 * math.pi)
    check_close(pose.position_mm, (0.0, 0.0, -60.0))
    check_close(pose.heading, (0.0, 1.0, 0.0))


def test_roll_by_a_quarter_turn_is_right_handed_about_the_heading() -> None:
    # Heading -y, bevel +z: z turned right-handed about -y by 90 degrees is -x.
    check_close(roll(ENTRY, math.pi / 2).bevel, (-1.0, 0.0, 0.0))


def test_roll_by_half_a_turn_bends_to_the_other_side() -> None:
    check_close(push(roll(ENTRY, math.pi), 30.0, 30.0 * math.pi).position_mm, (0.0, 0.0, 60.0))


def test_infinite_radius_is_a_straight_line() -> None:
    check_close(push(ENTRY, math.inf, 40.0).position_mm, (0.0, -40.0, 0.0))
    nearest = Arc(ENTRY, math.inf, 40.0).nearest_to((3.0, -10.0, 4.0))
    assert nearest.distance_mm == pytest.approx(5.0)
    assert nearest.at_mm == pytest.approx(10.0)


@given(poses(), radii_mm, lengths_mm, lengths_mm)
def test_pushes_add_up(pose: Pose, radius_mm: float, first_mm: float, second_mm: float) -> None:
    twice = push(push(pose, radius_mm, first_mm), radius_mm, second_mm)
    once = push(pose, radius_mm, first_mm + second_mm)
    check_close(twice.position_mm, once.position_mm, 1e-7)
    check_close(twice.heading, once.heading)


@given(poses(), radii_mm, lengths_mm, angles_rad)
def test_poses_stay_orthonormal(pose: Pose, radius_mm: float, length_mm: float, a: float) -> None:
    moved = roll(push(pose, radius_mm, length_mm), a)
    assert norm(moved.heading) == pytest.approx(1.0)
    assert norm(moved.bevel) == pytest.approx(1.0)
    assert dot(moved.heading, moved.bevel) == pytest.approx(0.0, abs=1e-9)


@given(poses(), radii_mm, lengths_mm)
def test_push_keeps_the_centre(pose: Pose, radius_mm: float, length_mm: float) -> None:
    moved = push(pose, radius_mm, length_mm)
    check_close(circle_center(moved, radius_mm), circle_center(pose, radius_mm), 1e-6)


@given(poses(), radii_mm, lengths_mm, points_mm)
def test_nearest_point_is_that_of_dense_sampling(
    pose: Pose, radius_mm: float, length_mm: float, point_mm: Vector
) -> None:
    arc = Arc(pose, radius_mm, length_mm)
    nearest = arc.nearest_to(point_mm)
    samples = np.linspace(0.0, length_mm, 401)
    sampled_mm = min(distance(arc.pose_at(s).position_mm, point_mm) for s in samples)
    spacing_mm = length_mm / 400
    assert nearest.distance_mm <= sampled_mm + 1e-9
    assert nearest.distance_mm >= sampled_mm - spacing_mm
    assert 0.0 <= nearest.at_mm <= length_mm
    check_distance = distance(arc.pose_at(nearest.at_mm).position_mm, point_mm)
    assert check_distance == pytest.approx(nearest.distance_mm, abs=1e-9)


@given(poses(), radii_mm, lengths_mm, points_mm, st.floats(0.5, 30.0))
def test_entry_into_a_ball_is_that_of_dense_sampling(
    pose: Pose, radius_mm: float, length_mm: float, center_mm: Vector, ball_mm: float
) -> None:
    arc = Arc(pose, radius_mm, length_mm)
    entered_mm = arc.enters_at(center_mm, ball_mm)
    samples = np.linspace(0.0, length_mm, 401)
    inside = [
        s for s in samples if distance(arc.pose_at(s).position_mm, center_mm) <= ball_mm - 1e-9
    ]
    if entered_mm is None:
        assert not inside
        return
    depth_mm = distance(arc.pose_at(entered_mm).position_mm, center_mm)
    assert depth_mm <= ball_mm + 1e-7
    assert entered_mm == 0.0 or depth_mm >= ball_mm - 1e-6
    assert not inside or entered_mm <= inside[0] + 1e-9


moves = st.lists(
    st.one_of(
        st.tuples(st.just("push"), st.floats(0.1, 20.0)),
        st.tuples(st.just("roll"), angles_rad),
    ),
    max_size=8,
)


def walked(moves: list[tuple[str, float]]) -> Path:
    path = Path(ENTRY)
    for kind, value in moves:
        path = path.push(30.0, value) if kind == "push" else path.roll(value)
    return path


@given(moves)
def test_path_ends_where_the_moves_lead(moves: list[tuple[str, float]]) -> None:
    pose = ENTRY
    for kind, value in moves:
        pose = push(pose, 30.0, value) if kind == "push" else roll(pose, value)
    tip = walked(moves).tip
    check_close(tip.position_mm, pose.position_mm)
    check_close(tip.bevel, pose.bevel)


@given(moves, st.floats(0.0, 100.0))
def test_pull_goes_back_along_the_path(moves: list[tuple[str, float]], length_mm: float) -> None:
    path = walked(moves)
    pulled = path.pull(length_mm)
    assert pulled.depth_mm == pytest.approx(max(0.0, path.depth_mm - length_mm), abs=1e-9)
    assert path.nearest_to(pulled.tip.position_mm).distance_mm <= 1e-7


@given(st.floats(1.0, 20.0), angles_rad, st.floats(1.0, 20.0), st.floats(0.1, 0.9))
def test_pull_beyond_a_roll_keeps_the_shaft_turned(
    first_mm: float, angle_rad: float, second_mm: float, share: float
) -> None:
    path = Path(ENTRY).push(30.0, first_mm).roll(angle_rad).push(30.0, second_mm)
    back = path.pull(second_mm + share * first_mm)
    there = push(ENTRY, 30.0, first_mm * (1.0 - share))
    check_close(back.tip.bevel, roll(there, angle_rad).bevel, 1e-7)
    check_close(back.roll(-angle_rad).tip.bevel, there.bevel, 1e-7)
