"""Runs in which the whole shape of the needle is measured: logged, repeated, sent and refused."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from ntagen.cli import main
from ntagen.drive.reading import read_log
from ntagen.drive.records import Command, Measured
from ntagen.scene import Vector

PAPER = str(Path(__file__).parents[2] / "examples" / "paper.nsl")
NEEDLE = ["drive", PAPER, "--needle", "phantom", "--seed", "1", "--noise", "0.3"]
RUN = [*NEEDLE, "--set", "whole shape on"]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("shapes") / "run.mcap"
    assert main([*RUN, "--log", str(path), "--quiet"]) == 0
    return path


Places = Sequence[Vector]
Change = Callable[[Places], Places]


def table(log: Path, path: Path, change: Change = lambda places: places, first: int = 0) -> str:
    """The shapes of a log as the words of a tracker; from one of them on, the places change."""
    lines = ["time_s,x_mm,y_mm,z_mm,force_n"]
    measured = [one for one in read_log(log).records if isinstance(one, Measured)]
    for number, one in enumerate(measured):
        for x, y, z in change(one.shape) if number >= first else one.shape:
            lines.append(f"{one.time_s!r},{x!r},{y!r},{z!r},{one.force_n!r}")
    path.write_text("\n".join(lines) + "\n")
    return f"shape:{path}"


def commands(log: Path) -> list[Command]:
    return [one for one in read_log(log).records if isinstance(one, Command)]


def test_a_log_has_all_shapes_and_gives_the_same_decisions(
    log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    measured = [one for one in read_log(log).records if isinstance(one, Measured)]
    for one in measured:
        assert one.shape[-1] == one.position_mm
        # Each place is a mm behind the next one, from 20 mm outside of the tissue on.
        assert abs(len(one.shape) - 21 - one.depth_mm) <= 1.0
    assert main(["replay", str(log)]) == 0
    assert "the same decisions again" in capsys.readouterr().out


@pytest.mark.slow
def test_a_table_of_shapes_leads_to_the_same_end(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*RUN, "--tracker", table(log, tmp_path / "shapes.csv"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["outcome"] == "target reached"
    assert found["depth_mm"] == pytest.approx(44.0, abs=1.0)


@pytest.mark.slow
def test_shapes_on_the_network_lead_to_the_same_commands(log: Path, tmp_path: Path) -> None:
    again = tmp_path / "network.mcap"
    options = ["--tracker", "openigtlink+sim", "--log", str(again), "--quiet"]
    assert main([*RUN, *options]) == 0
    pairs = list(zip(commands(log), commands(again), strict=True))
    assert all((a.kind, a.value) == (b.kind, pytest.approx(b.value, abs=1e-2)) for a, b in pairs)


def from_the_tip(places: Places) -> Places:
    # The tip is where it was, so that nothing but the order is wrong.
    x, y, z = places[-1]
    return [(2.0 * x - a, 2.0 * y - b, 2.0 * z - c) for a, b, c in places]


def bent(places: Places) -> Places:
    changed = np.array(places)
    changed[10] += (5.0, 0.0, 0.0)
    return [(x, y, z) for x, y, z in changed.tolist()]


def jumping(places: Places) -> Places:
    return [(x, y + 12.0, z) for x, y, z in places]


def aside(places: Places) -> Places:
    return [(x + 9.0, y, z) for x, y, z in places]


def long(places: Places) -> Places:
    x, y, z = places[0]
    return [*((x, y + step, z) for step in range(300, 0, -5)), *places]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (from_the_tip, "is the tip the first one?"),
        (bent, "the shape has a kink at"),
        (long, "mm long, and the needle"),
        (jumping, "mm from the entry"),
    ],
)
def test_a_shape_that_cannot_be_true_ends_the_run_before_it_begins(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], change: Change, message: str
) -> None:
    tracker = table(log, tmp_path / "wrong.csv", change)
    assert main([*NEEDLE, "--tracker", tracker]) == 5
    said = capsys.readouterr().out
    assert message in said
    assert "0.0 mm deep" in said


def test_a_shape_that_jumps_on_the_way_stops_the_needle(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    tracker = table(log, tmp_path / "jump.csv", aside, first=8)
    assert main([*NEEDLE, "--tracker", tracker]) == 5
    assert "the measured tip jumped by" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda places: [(x / 1e3, y / 1e3, z / 1e3) for x, y, z in places], "is it in mm and not"),
        (lambda places: places[-2:], ":2: the shape has 2 places"),
        (lambda places: [(math.nan, y, z) for _, y, z in places], ":2: 'nan' is not a number"),
        (lambda places: [*places[-9:]], "10 mm is the least"),
        (lambda places: [(x, 30.0 * y, z) for x, y, z in places], "jumps by"),
    ],
)
def test_a_table_without_shapes_is_refused(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], change: Change, message: str
) -> None:
    tracker = table(log, tmp_path / "wrong.csv", change)
    assert main([*NEEDLE, "--tracker", tracker]) == 2
    assert message in capsys.readouterr().err
