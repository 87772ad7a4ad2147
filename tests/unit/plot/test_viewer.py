"""The page of a scene or a run: what it shows, and that it loads nothing."""

from __future__ import annotations

import json
import math
import re
import shutil
import subprocess
import sys
import types
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

import ntagen
from ntagen.cli import main
from ntagen.drive.log import Log, metadata_of
from ntagen.drive.reading import RunLog, read_log
from ntagen.drive.records import Learned, Synthesised, Truth
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.drive.states import State
from ntagen.errors import InputError
from ntagen.plot.picture import Picture
from ntagen.plot.run import moments_of, picture_of_plans, picture_of_run
from ntagen.plot.viewer import data_of, page_of
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN, PAPER


def data_in(text: str) -> dict[str, Any]:
    """The data that a page shows."""
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)
    assert found is not None
    data: dict[str, Any] = json.loads(found[1])
    return data


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that learns of the region that it did not know."""
    path = tmp_path_factory.mktemp("viewer") / "run.mcap"
    with Log(path, metadata_of({"settings": Settings().to_json(), "seed": 1}), {}) as log:
        simulate(HIDDEN, oracle_synthesis, Settings(), log, known="C1")
    return path


@pytest.fixture(scope="module")
def run(log: Path) -> RunLog:
    return read_log(log)


def test_a_page_has_regions_where_they_are() -> None:
    data = data_of(picture_of_plans(PAPER, None, 0))
    for shown, region in zip(data["regions"], PAPER.regions, strict=True):
        away = [math.dist(point, region.center_mm) for point in shown["points"]]
        assert away == pytest.approx([region.radius_mm] * len(away), abs=0.02)
        assert len(shown["faces"]) % 3 == 0
        assert max(shown["faces"]) < len(away)


def test_plans_lead_from_the_tip_into_the_target() -> None:
    data = data_of(picture_of_plans(PAPER, oracle_synthesis(PAPER), 5))
    others, best = data["paths"]
    assert (best["name"], len(best["lines"])) == ("best plan", 1)
    assert len(others["lines"]) == 4
    target = next(one for one in PAPER.regions if one.kind == "target")
    for line in (*others["lines"], *best["lines"]):
        assert line[0] == list(PAPER.needle.tip.position_mm)
        assert math.dist(line[-1], target.center_mm) < target.radius_mm


def test_the_needle_goes_down_the_page() -> None:
    data = data_of(picture_of_plans(PAPER, None, 0))
    assert sum(a * b for a, b in zip(data["down"], PAPER.axis, strict=True)) > 0.9
    for one, other in (("down", "right"), ("right", "away"), ("down", "away")):
        assert sum(a * b for a, b in zip(data[one], data[other], strict=True)) == 0


def test_a_run_has_each_moment_once_and_in_order(run: RunLog) -> None:
    data = data_of(picture_of_run(run, 5))
    times = [moment["t"] for moment in data["moments"]]
    assert times == sorted(set(times))
    truths = [record for record in run.records if isinstance(record, Truth)]
    last = [moment["true"] for moment in data["moments"] if "true" in moment][-1]
    assert last == pytest.approx(truths[-1].position_mm, abs=0.01)
    assert {line["t"] for line in data["log"]} <= set(times)
    shown = set[str]().union(*data["moments"])
    assert {track["key"] for track in data["tracks"]} | {"f", "off", "d", "state"} <= shown


def test_a_run_has_its_plans_when_they_were_made(run: RunLog) -> None:
    made = [record for record in run.records if isinstance(record, Synthesised)]
    picture = picture_of_run(run, 0)
    assert [one.time_s for one in picture.plans] == [record.time_s for record in made]
    assert [bool(one.bent) for one in picture.plans] == [bool(record.plan) for record in made]
    for one in data_of(picture)["plans"]:
        for before, after in pairwise(one["bent"] + one["spun"]):
            assert before[-1] == after[0]
    # The last plan that was followed leads into the target.
    last = [one for one in picture.plans if one.bent][-1].bent[-1][-1]
    target = next(region for region in run.actual.regions if region.kind == "target")
    assert math.dist(last, target.center_mm) < target.radius_mm


def test_the_state_of_the_driver_is_that_of_the_log(run: RunLog) -> None:
    states = [one.state for one in moments_of(run.records) if one.state]
    assert states[0] == State.INITIAL_PUSH.value
    assert states[-1] == State.TARGET_REACHED.value
    # The stop before it takes no time here: its moment ends in the state that follows.
    assert State.PULL_BACK.value in states


def test_a_learned_region_appears_when_it_was_learned(run: RunLog) -> None:
    learned = [record for record in run.records if isinstance(record, Learned)]
    assert learned
    shown = {one["name"]: one for one in data_of(picture_of_run(run, 0))["regions"]}
    kept = [record for record in learned if record.name in shown]
    first = {record.name: record.time_s for record in reversed(kept)}
    assert first
    assert {name: shown[name]["from"] for name in first} == first
    assert shown["T1"]["from"] is None


def test_moments_without_anything_to_see_are_left_out(run: RunLog) -> None:
    for one in moments_of(run.records):
        assert one.said or one.state or one.true_mm or one.measured_mm or one.tip_mm


def test_texts_cannot_end_the_data() -> None:
    picture = Picture(scene=PAPER, title="</script><b>&", caption="<!--")
    text = page_of(picture).text
    assert data_in(text)["title"] == "</script><b>&"
    assert text.count("</script>") == 2


def test_a_page_loads_nothing() -> None:
    page = page_of(Picture(scene=PAPER))
    assert "default-src 'none'" in page.text
    assert re.findall(r"https?:|\bsrc=|\bhref=|@import|url\(", page.text) == []
    assert "sandbox=" in page._repr_html_()


def test_plot_and_view_write_the_same_page(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.html"
    assert main(["plot", str(log), "-o", str(path), "--plans", "3"]) == 0
    assert ntagen.view(log, plans=3).text == path.read_text("utf-8")


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_the_script_of_the_page_is_javascript(tmp_path: Path) -> None:
    text = page_of(Picture(scene=PAPER)).text
    script = tmp_path / "page.js"
    script.write_text(text.rpartition("<script>")[2].partition("</script>")[0], "utf-8")
    done = subprocess.run(["node", "--check", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_run_is_rows_with_each_part_of_a_vector_apart(run: RunLog) -> None:
    rows = run.rows()
    assert [row["time_s"] for row in rows] == [record.time_s for record in run.records]
    truth = next(record for record in run.records if isinstance(record, Truth))
    row = next(row for row in rows if row["record"] == "truth")
    assert row == {
        **{"record": "truth", "time_s": truth.time_s, "clearance_mm": truth.clearance_mm},
        **{f"position_{axis}_mm": truth.position_mm[i] for i, axis in enumerate("xyz")},
    }
    assert all(isinstance(one, int | float | str | bool) for row in rows for one in row.values())


def test_a_run_is_a_frame_if_there_is_a_library(
    monkeypatch: pytest.MonkeyPatch, run: RunLog
) -> None:
    library = types.ModuleType("pandas")
    library.DataFrame = dict  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pandas", library)
    frame = run.to_frame()
    assert {len(column) for column in frame.values()} == {len(run.records)}
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "polars", None)
    with pytest.raises(InputError, match=r"pip install polars; `rows` has the records"):
        run.to_frame()
