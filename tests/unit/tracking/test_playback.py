"""Recorded runs as trackers."""

from __future__ import annotations

from pathlib import Path

import pytest

from ntagen.errors import DeviceError, InputError
from ntagen.needle.measurement import Measurement
from ntagen.needle.virtual import SimulatedClock
from ntagen.tracking.frames import IDENTITY, Transform
from ntagen.tracking.playback import END_S, HOLD_S, Playback, samples_of_table
from ntagen.tracking.spec import Recording, open_tracker

SHIFTED = Transform(
    "bench", "scene", ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (100.0, 0.0, 0.0)
)


def at(time_s: float, x_mm: float) -> Measurement:
    return Measurement(time_s, (x_mm, 0.0, 0.0), 0.0)


def x_mm_of(sensor: Playback) -> float:
    return sensor.measure().position_mm[0]


def test_samples_come_at_their_times() -> None:
    clock = SimulatedClock()
    clock.advance(50.0)
    sensor = Playback("r", [at(7.0, 1.0), at(7.1, 2.0), at(8.0, 3.0)], clock.now_s)
    assert x_mm_of(sensor) == 1.0
    clock.advance(0.05)
    assert x_mm_of(sensor) == 1.0
    # Ten steps of 0.005 are not exactly 0.05.
    for _ in range(10):
        clock.advance(0.005)
    assert x_mm_of(sensor) == 2.0
    clock.advance(0.9)
    assert sensor.measure() == Measurement(pytest.approx(51.0), (3.0, 0.0, 0.0), 0.0)


def test_a_measurement_has_the_time_of_its_sample() -> None:
    clock = SimulatedClock()
    sensor = Playback("r", [at(0.0, 1.0), at(4.0, 2.0)], clock.now_s)
    sensor.measure()
    clock.advance(3.0)
    assert sensor.measure().time_s == 0.0


def test_the_end_of_a_recording_is_a_fault() -> None:
    clock = SimulatedClock()
    sensor = Playback("run.csv", [at(0.0, 1.0), at(2.0, 2.0)], clock.now_s)
    sensor.measure()
    clock.advance(2.0 + END_S)
    assert x_mm_of(sensor) == 2.0
    clock.advance(0.1)
    with pytest.raises(DeviceError, match=r"run.csv has ended: it has 2.00 s, .* at 2.60 s"):
        sensor.measure()


def test_a_gap_in_a_recording_is_a_fault() -> None:
    clock = SimulatedClock()
    sensor = Playback("run.csv", [at(0.0, 1.0), at(60.0, 2.0)], clock.now_s)
    sensor.measure()
    clock.advance(HOLD_S + 1.0)
    with pytest.raises(DeviceError, match=r"has a gap: no sample for 6.00 s"):
        sensor.measure()
    clock.advance(60.0 - HOLD_S - 1.0)
    assert x_mm_of(sensor) == 2.0


def test_recordings_that_are_wrong_are_refused() -> None:
    with pytest.raises(InputError, match="there are no measurements"):
        Playback("r", [], lambda: 0.0)
    with pytest.raises(InputError, match="the time goes back, from 2 s to 1 s"):
        Playback("r", [at(2.0, 0.0), at(1.0, 0.0)], lambda: 0.0)


# Tables.


def table(tmp_path: Path, text: str, transform: Transform = IDENTITY) -> list[Measurement]:
    path = tmp_path / "run.csv"
    path.write_text(text)
    return samples_of_table(path, transform)[0]


def test_a_table_in_the_frame_of_the_scene(tmp_path: Path) -> None:
    text = (
        "# bench, 3 May\n"
        "time_s,x_mm,y_mm,z_mm,force_n,heading_x,heading_y,heading_z,bevel_x,bevel_y,bevel_z\n"
        "0,1,2,3,0.5,0,-2,0,0,0,1\n"
        "0.5,4,5,6,0.25,,,,,,\n"
    )
    assert table(tmp_path, text) == [
        Measurement(0.0, (1.0, 2.0, 3.0), 0.5, (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
        Measurement(0.5, (4.0, 5.0, 6.0), 0.25),
    ]


def test_a_table_in_another_frame_and_unit(tmp_path: Path) -> None:
    text = "time_s,bench_x_cm,bench_y_cm,bench_z_cm,heading_x,heading_y,heading_z\n0,1,2,3,1,0,0\n"
    (found,) = table(tmp_path, text, SHIFTED)
    assert found.position_mm == pytest.approx((80.0, 10.0, 30.0))
    assert found.heading == pytest.approx((0.0, 1.0, 0.0))


@pytest.mark.parametrize(
    ("text", "transform", "match"),
    [
        ("", IDENTITY, "this file is empty"),
        ("x_mm,y_mm,z_mm\n1,2,3\n", IDENTITY, "no column time_s"),
        ("time_s,x_mm,y_mm\n1,2,3\n", IDENTITY, "the columns are"),
        ("time_s,x_mm,y_mm,z_mm\n1,2,3\n", IDENTITY, "run.csv:2: there are 3 columns, but 4"),
        ("time_s,x_mm,y_mm,z_mm\n0,1,2,x\n", IDENTITY, "run.csv:2: 'x' is not a number"),
        ("time_s,x_mm,y_mm,z_mm\n0,1,2,nan\n", IDENTITY, "run.csv:2: 'nan' is not a number"),
        ("time_s,x_mm,y_mm,z_mm,force_n\n0,1,2,3,\n", IDENTITY, "'' is not a number"),
        ("time_s,bench_x_mm,bench_y_mm,bench_z_mm\n", IDENTITY, "give --registration FILE"),
        ("time_s,lab_x_mm,lab_y_mm,lab_z_mm\n", SHIFTED, "registration is from bench"),
        ("time_s,x_mm,y_mm,z_mm\n", SHIFTED, "leave it out"),
        (
            "time_s,x_mm,y_mm,z_mm,a_x_mm,a_y_mm,a_z_mm\n",
            IDENTITY,
            "positions in 2 frames",
        ),
        (
            "time_s,x_mm,y_mm,z_mm,heading_x,heading_y,heading_z\n0,1,2,3,0,0,0\n",
            IDENTITY,
            "the heading has no direction",
        ),
        (
            "time_s,x_mm,y_mm,z_mm,heading_x,heading_y,heading_z,bevel_x,bevel_y,bevel_z\n"
            "0,1,2,3,0,1,0,0,1,0\n",
            IDENTITY,
            "not at a right angle",
        ),
    ],
)
def test_wrong_tables_are_refused(
    tmp_path: Path, text: str, transform: Transform, match: str
) -> None:
    with pytest.raises(InputError, match=match):
        table(tmp_path, text, transform)


@pytest.mark.parametrize("has_force", [True, False])
def test_a_table_is_opened_as_a_tracker(tmp_path: Path, has_force: bool) -> None:
    path = tmp_path / "run.csv"
    head, row = "time_s,x_mm,y_mm,z_mm", "3,1,2,3"
    path.write_text(f"{head},force_n\n{row},0\n" if has_force else f"{head}\n{row}\n")
    with open_tracker(Recording("csv", path), None, lambda: 8.0) as sensor:
        assert sensor.measures_force == has_force
        assert sensor.measure() == Measurement(8.0, (1.0, 2.0, 3.0), 0.0)
