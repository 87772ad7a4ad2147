"""Pictures: what must be seen is in them, and files are whole or not there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.patches import Circle

from ntagen.drive.log import Log, metadata_of
from ntagen.drive.reading import read_log
from ntagen.drive.records import Foreseen
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.errors import InputError
from ntagen.plan.wording import counted
from ntagen.plot.picture import Picture, draw
from ntagen.plot.run import picture_of_plans, picture_of_run
from ntagen.plot.save import save
from ntagen.scene import Pose
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN, PAPER, scene, sphere


def slow(ending: str) -> object:
    """A kind of file that takes a second to write."""
    return pytest.param(ending, marks=pytest.mark.slow)


def plans_picture(shown: int) -> Picture:
    return picture_of_plans(PAPER, oracle_synthesis(PAPER) if shown else None, shown)


def run_picture(folder: Path) -> Picture:
    path = folder / "run.mcap"
    with Log(path, metadata_of({"settings": Settings().to_json(), "seed": 1}), {}) as log:
        simulate(HIDDEN, oracle_synthesis, Settings(), log, known="C1")
    return picture_of_run(read_log(path), 10)


def labels(picture: Picture) -> set[str]:
    return {text.get_text() for text in draw(picture).legends[0].get_texts()}


def panels(picture: Picture) -> list[Any]:
    return list(draw(picture).axes)


def test_every_kind_of_thing_is_named_in_the_legend() -> None:
    named = {"target", "critical", "detection", "best plan", "other plans", "start"}
    assert labels(plans_picture(5)) == named


def test_a_scene_without_plans_names_only_its_regions() -> None:
    assert labels(plans_picture(0)) == {"target", "critical", "detection", "start"}
    assert plans_picture(0).best == ()


def test_the_caption_says_what_the_best_plan_is() -> None:
    synthesis = oracle_synthesis(PAPER)
    assert synthesis.best is not None
    caption = plans_picture(5).caption
    assert str(synthesis.best.plan) in caption
    assert counted(synthesis.found, len(synthesis.candidates)) in caption
    none = replace(synthesis, found=0, candidates=())
    assert picture_of_plans(PAPER, none, 5).caption == "no plan found"


@pytest.mark.slow
def test_a_run_shows_truth_measurements_and_what_was_learned(tmp_path: Path) -> None:
    shown = labels(run_picture(tmp_path))
    assert {"true path", "measured", "last plan", "critical (learned)"} <= shown


def test_a_run_shows_the_tube_as_wide_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    ways_mm = ((0.0, 0.0, 0.0), (0.0, -5.0, -10.0), (0.0, 0.0, 0.0))
    one = Foreseen(1.0, 0.0, (0.0, 5.0, 10.0), (0.5, 0.5, 1.0), *ways_mm, confidence=1.0)
    settings = replace(Settings(), accept=0.975)
    with Log(path, metadata_of({"settings": settings.to_json()}), {}) as log:
        log.started(PAPER)
        log.record(one)
    assert read_log(path).rows()[0]["y_mm"] == "0 -5 -10"
    picture = picture_of_run(read_log(path), 10)
    assert "tube (97.5 %)" in labels(picture)
    patch = next(one for one in panels(picture)[0].patches if one.get_label() == "tube (97.5 %)")
    low, high = patch.get_path().get_extents().get_points()
    assert (low[0], high[0]) == pytest.approx((-1.96, 1.96), abs=0.01)
    assert (low[1], high[1]) == pytest.approx((-11.96, 0.98), abs=0.01)
    # Earlier logs have none.
    assert not run_picture(tmp_path).tubes


def test_a_pull_back_divides_the_true_path(tmp_path: Path) -> None:
    assert len(run_picture(tmp_path).true_path) >= 2


def test_lengths_have_one_scale_and_a_unit() -> None:
    first, second, space = panels(plans_picture(3))
    for panel in (first, second):
        assert panel.get_aspect() == 1.0
        assert "[mm]" in panel.get_xlabel()
        assert "[mm]" in panel.get_ylabel()
    assert "[mm]" in space.get_zlabel()


def test_regions_are_drawn_where_they_are() -> None:
    first = panels(plans_picture(0))[0]
    circles = [patch for patch in first.patches if isinstance(patch, Circle)]
    centers = {(circle.center, circle.radius) for circle in circles}
    assert centers == {((0.0, -50.0), 10.0), ((0.0, -25.0), 2.0), ((0.0, -25.0), 5.0)}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_insertion_goes_down_the_page(sign: float) -> None:
    turned = replace(
        scene(targets=[sphere("T", "target", (sign * 50.0, 0.0, 0.0), 10.0)]),
        axis=(sign, 0.0, 0.0),
    )
    tip = Pose((0.0, 0.0, 0.0), (sign, 0.0, 0.0), (0.0, 0.0, 1.0))
    bottom, top = panels(Picture(turned.with_needle(tip, 30.0)))[0].get_ylim()
    assert sign * bottom > sign * top


@pytest.mark.parametrize("ending", [slow("png"), slow("pdf"), "svg"])
def test_equal_pictures_are_equal_files(tmp_path: Path, ending: str) -> None:
    paths = [tmp_path / f"{name}.{ending}" for name in "ab"]
    for path in paths:
        save(draw(plans_picture(3)), path)
    assert paths[0].stat().st_size > 5000
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize("name", ["scene.bmp", "scene"])
def test_unknown_endings_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=r"\.svg, \.png, \.pdf"):
        save(draw(plans_picture(0)), tmp_path / name)


def test_a_folder_is_no_place_for_a_picture(tmp_path: Path) -> None:
    (tmp_path / "scene.png").mkdir()
    with pytest.raises(InputError, match="folder"):
        save(draw(plans_picture(0)), tmp_path / "scene.png")
    assert [path.name for path in tmp_path.iterdir()] == ["scene.png"]
