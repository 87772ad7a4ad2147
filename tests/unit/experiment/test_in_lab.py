"""Rows whose needle stands in a lab: what they may say, and what their runs give."""

from __future__ import annotations

import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

from ntagen.drive.reading import read_log
from ntagen.drive.records import Ended, Measured, Truth
from ntagen.drive.replay import replay
from ntagen.drive.simulate import synthesiser_for
from ntagen.errors import InputError
from ntagen.experiment.campaign import carry_out
from ntagen.experiment.crew import Here
from ntagen.experiment.reading import read_experiment
from ntagen.lab import driving
from ntagen.nsl import load_task
from tests.unit.experiment.files import written

ROW = '[[row]]\nscenario = "no_cr.nsl"\nneedle = "lab"\nseeds = 2\n'

NEAR = """
environment Near {
  needle {
    tip (0, 0, 0) mm  heading -y  bevel +z
    radius 30 mm  speed 2 mm/s
  }
  motion {
    step 1 s
    roll by 180 deg  at most 1 times  at least 2 mm apart
  }
  target    T1  sphere (0, -22, 0) mm  radius 8 mm
  critical  C1  sphere (20, -10, 0) mm  radius 3 mm
}
"""
"""A target 14 mm deep: the needle needs 7 s to it."""


def test_a_lab_runs_in_real_time_if_nobody_says_otherwise(tmp_path: Path) -> None:
    (row,) = read_experiment(written(tmp_path, ROW)).rows
    assert (row.needle, row.speed) == ("lab", 1.0)


def test_needles_without_a_lab_have_no_speed(tmp_path: Path) -> None:
    assert [row.speed for row in read_experiment(written(tmp_path)).rows] == [None, None]


def test_the_speed_is_in_the_name_the_digest_and_the_settings(tmp_path: Path) -> None:
    rows = read_experiment(written(tmp_path, ROW + "speed = [1, 2.5]\n")).rows
    assert [row.id for row in rows] == ["no_cr-speed_1", "no_cr-speed_2.5"]
    assert rows[0].digest != rows[1].digest
    assert rows[1].shown_values() == {"speed": "2.5 x"}
    alone = read_experiment(written(tmp_path, ROW)).rows[0]
    assert alone.digest == rows[0].digest


def test_the_digest_of_a_lab_has_the_axes_of_its_controller(tmp_path: Path) -> None:
    row = ROW.replace("no_cr", "near")

    def digest(device: str) -> str:
        (tmp_path / "near.nsl").write_text(f"{NEAR.rstrip()[:-1]}{device}\n}}\n", "utf-8")
        (found,) = read_experiment(written(tmp_path, row)).rows
        return found.digest

    axes = 'device grbl "{}" {{ insert X {} steps/mm  roll A 10 steps/deg }}'
    digests = [digest(axes.format(*one)) for one in (("a", 1000), ("b", 1000), ("a", 500))]
    assert digests[0] == digests[1] != digests[2]
    assert digest("") not in digests


def test_a_lab_is_driven_with_the_settings_of_its_needle(tmp_path: Path) -> None:
    (row,) = read_experiment(written(tmp_path, ROW + 'noise = "0.3 mm"\n')).rows
    settings = row.configuration(load_task(row.scenario), 1).settings
    assert settings.priors.noise_mm == pytest.approx(0.3, abs=0.01)
    assert settings.overrun_mm > 0.0
    assert settings.compensated_lag_rad > 0.0


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (ROW + "speed = 0\n", (":5: row 1: `speed`: 0 is no speed", "0.01 to 100 times")),
        (ROW + "speed = 101\n", ("`speed`: 101 is no speed",)),
        (ROW + 'speed = "5"\n', ("`speed`: '5' is no speed", "hint: write for example speed = 10")),
        (ROW + "speed = true\n", ("`speed`: True is no speed",)),
        (ROW + "speed = nan\n", ("`speed`: nan is no speed",)),
        (ROW + "speed = []\n", ("`speed`: the list has no value",)),
        (ROW + "speed = [2, 2.0]\n", ("`speed`: 2.0 stands there twice",)),
        (ROW + "sped = 2\n", ("unknown key `sped`", "did you mean `speed`?")),
        (ROW.replace('"lab"', '"lap"'), ("did you mean 'lab'?",)),
        (
            ROW.replace('"lab"', '"phantom"') + "speed = 2\n",
            ("`speed`: it is that of a lab, and the needle is phantom", 'write needle = "lab"'),
        ),
        (ROW + 'roll_error = "2 deg"\n', ("`roll_error`: it means nothing to a phantom needle",)),
        (ROW + 'drive = { overrun = "0 mm" }\n', ("the settings count on 0 mm",)),
    ],
)
def test_mistakes(tmp_path: Path, text: str, parts: tuple[str, ...]) -> None:
    with pytest.raises(InputError) as caught:
        read_experiment(written(tmp_path, text))
    for part in parts:
        assert part in str(caught.value), str(caught.value)


def test_a_scene_that_moves_or_has_impossible_axes_is_refused(tmp_path: Path) -> None:
    file = written(tmp_path, ROW)
    scene = tmp_path / "no_cr.nsl"
    plain = scene.read_text("utf-8")
    device = '  device grbl "x" { insert U 100 steps/mm  roll A 100 steps/deg }\n'
    scene.write_text(plain.replace("  target T1", device + "  target T1"), "utf-8")
    with pytest.raises(InputError, match="U"):
        read_experiment(file)
    moving = plain.replace("radius 8 mm", "radius 8 mm moves 1 mm along +z every 4 s")
    scene.write_text(moving, "utf-8")
    with pytest.raises(InputError, match="no region moves in a lab"):
        read_experiment(file)


def test_the_clock_of_the_driver_runs_at_the_rate_that_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    outside_s = [7.0]
    monkeypatch.setattr(driving, "time", SimpleNamespace(monotonic=lambda: outside_s[0]))
    clock = driving.Clock(5.0)
    shown = [clock.now_s()]
    for rate in (5.0, 0.0, 1.0):
        with clock.at_rate(rate):
            outside_s[0] += 2.0
            shown.append(clock.now_s())
        outside_s[0] += 1.0
    shown.append(clock.now_s())
    assert shown == pytest.approx([0.0, 10.0, 11.0, 14.0, 15.0])


@pytest.mark.slow
def test_a_run_opens_a_lab_reaches_the_target_and_leaves_nothing_open(tmp_path: Path) -> None:
    text = '[[row]]\nid = "near"\nscenario = "near.nsl"\nneedle = "lab"\nspeed = 10\nseeds = 1\n'
    file = written(tmp_path, text)
    (tmp_path / "near.nsl").write_text(NEAR, "utf-8")
    before = threading.active_count()
    campaign = carry_out(read_experiment(file), tmp_path / "x", Here)
    assert threading.active_count() == before
    (row,), (run,) = campaign.table, campaign.runs
    assert run["outcome"] == "target reached", run["reason"]
    assert (row["needle"], row["speed"], row["reached"], row["hits"]) == ("lab", 10.0, 1, 0)
    # The lab's clock: a needle of 2 mm/s needs that long at least.
    assert run["needle_s"] > run["depth_mm"] / 2.0
    assert run["target_mm"] <= 0.0
    log = read_log(tmp_path / "x" / run["log"])
    truths = [one for one in log.records if isinstance(one, Truth)]
    measured = [one for one in log.records if isinstance(one, Measured)]
    assert len(truths) == len(measured) + 1
    assert truths[-1].clearance_mm == pytest.approx(run["clearance_mm"])
    assert [one.time_s for one in log.records] == sorted(one.time_s for one in log.records)
    (ended,) = (one for one in log.records if isinstance(one, Ended))
    assert ended.time_s == pytest.approx(run["needle_s"])
    assert replay(log, synthesiser_for(log.settings)).is_same
    assert log.metadata["needle"] == "lab"
