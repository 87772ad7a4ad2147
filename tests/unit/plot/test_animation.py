"""Animations of runs and of moving regions: what is where at which moment, and what is refused."""

from __future__ import annotations

import io
import json
import re
import shutil
import subprocess
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import ntagen
from ntagen.cli import main
from ntagen.errors import InputError
from ntagen.motion import Motion
from ntagen.nsl import load
from ntagen.plot.animation import animation_of
from ntagen.plot.picture import Moment, Picture
from ntagen.plot.run import picture_of_plans
from ntagen.plot.viewer import data_of, page_of
from tests.steering import PAPER

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[3] / "examples"
RIBS = EXAMPLES / "ribs" / "ribs.nsl"
PAPER_FILE = EXAMPLES / "paper.nsl"


def frames(data: bytes) -> list[np.ndarray]:
    """The frames, one for each 80 ms: the file joins those that are equal."""
    image = Image.open(io.BytesIO(data))
    found = []
    for number in range(image.n_frames):  # type: ignore[attr-defined]
        image.seek(number)
        shown = np.asarray(image.convert("RGB")).astype(int)
        found += [shown] * round(image.info["duration"] / 80)
    return found


def dark(frame: np.ndarray) -> int:
    """How many pixels have the colour of the true path."""
    return int((np.abs(frame - np.array([0x0B, 0x25, 0x45])).sum(axis=2) < 60).sum())


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("animation") / "run.mcap"
    assert main(["drive", str(PAPER_FILE), "--quiet", "--log", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def run() -> Picture:
    """A tip that goes straight down, and a region that is learned on the way."""
    start = PAPER.needle.tip.position_mm
    down = PAPER.axis
    at = [tuple(a + 0.4 * step * b for a, b in zip(start, down, strict=True)) for step in range(50)]
    moments = [Moment(0.1 * number, true_mm=place) for number, place in enumerate(at)]  # type: ignore[arg-type]
    critical = next(one for one in PAPER.regions if one.kind == "critical")
    return Picture(
        scene=PAPER,
        moments=moments,
        learned=frozenset({critical.name}),
        appears_s={critical.name: 2.5},
    )


@pytest.fixture(scope="module")
def shown(run: Picture) -> list[np.ndarray]:
    return frames(animation_of(run).data)


def test_the_path_grows(shown: list[np.ndarray]) -> None:
    amounts = [dark(frame) for frame in shown]
    # The last one stays for two seconds.
    assert len(amounts) == 119 + 25
    thirds = [amounts[5], amounts[60], amounts[119]]
    assert thirds == sorted(thirds)
    assert thirds[2] > 1.3 * thirds[0]


def test_a_learned_region_appears_when_it_was_learned(shown: list[np.ndarray]) -> None:
    red = [
        int(((frame[..., 0] > 180) & (frame[..., 1] < 120) & (frame[..., 2] < 120)).sum())
        for frame in shown
    ]
    changes = [number for number, (one, other) in enumerate(pairwise(red)) if other > one + 50]
    # The moment 2.5 s of 4.9 s is in the middle of 120 frames.
    assert [round(number / 119, 2) for number in changes] == [pytest.approx(0.51, abs=0.02)]


def test_equal_pictures_give_equal_files(run: Picture) -> None:
    short = replace(run, moments=run.moments[:2])
    assert animation_of(short).data == animation_of(short).data


def test_a_picture_without_motion_is_refused() -> None:
    with pytest.raises(InputError, match="nothing moves here, so there is no animation\nhint"):
        animation_of(picture_of_plans(PAPER, None, 0))


def test_moving_regions_are_on_the_page_where_they_are() -> None:
    scene = load(RIBS)
    picture = replace(picture_of_plans(scene, None, 0), clock_s=0.7)
    data = data_of(picture)
    assert data["clock"] == 0.7
    shown = {one["name"]: one["motion"] for one in data["regions"]}
    for region in scene.regions:
        motion = region.motion
        if motion is None:
            assert shown[region.name] is None
            continue
        rows = shown[region.name]["places"]
        assert (rows[0][0], rows[-1][0]) == (0.0, motion.period_s)
        for time_s in np.linspace(0.0, motion.period_s, 31):
            drawn = [
                np.interp(time_s, [row[0] for row in rows], [row[i] for row in rows])
                for i in (1, 2, 3)
            ]
            assert drawn == pytest.approx(motion.at_mm(float(time_s)), abs=0.05)
    assert [data["moments"][0]["t"], data["moments"][-1]["t"]] == [0.0, motion_of(scene).period_s]


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_the_page_moves_regions_as_the_breath_does() -> None:
    scene = load(RIBS)
    page = page_of(replace(picture_of_plans(scene, None, 0), clock_s=0.7)).text
    function = re.search(r"^function displacement.*?^}", page, re.DOTALL | re.MULTILINE)
    data = re.search(r'type="application/json">(.*?)</script>', page, re.DOTALL)
    assert function is not None
    assert data is not None
    times_s = [-1.0, 0.0, 0.3, 1.9, 3.3, 4.0, 17.5]
    script = (
        f"const data = {data[1]};\n{function[0]}\nconsole.log(JSON.stringify(data.regions.map("
        f"(region) => {times_s}.map((time) => displacement(region, time)))));"
    )
    done = subprocess.run(["node", "-"], input=script, capture_output=True, text=True, check=True)
    for region, places in zip(scene.regions, json.loads(done.stdout), strict=True):
        for time_s, place in zip(times_s, places, strict=True):
            still = (0.0, 0.0, 0.0)
            expected = still if region.motion is None else region.motion.at_mm(0.7 + time_s)
            assert place == pytest.approx(expected, abs=0.05)


def motion_of(scene: object) -> Motion:
    return next(one.motion for one in scene.regions if one.motion is not None)  # type: ignore[attr-defined]


def test_one_breath_goes_round(tmp_path: Path) -> None:
    task, path = tmp_path / "moving.nsl", tmp_path / "moving.gif"
    text = PAPER_FILE.read_text("utf-8").replace("step 2 s", "step 2 s  wait 1 s  at most 2 times")
    task.write_text(text.replace("radius 10 mm", "radius 10 mm  moves 12 mm along +z every 4 s"))
    assert main(["plot", str(task), "--plans", "0", "-o", str(path)]) == 0
    shown = frames(path.read_bytes())
    assert len(shown) == 60
    steps = [np.abs(one - other).sum() for one, other in pairwise([*shown, shown[0]])]
    # Regions are slow at the ends of their way; the last step is no jump.
    assert steps[-1] <= max(steps[:-1])
    assert max(steps) > 0


def test_a_call_animates(log: Path, tmp_path: Path) -> None:
    path = tmp_path / "run.gif"
    animation = ntagen.animate(log, plans=0)
    animation.save(path)
    with Image.open(path) as image:
        assert image.n_frames > 20  # type: ignore[attr-defined]
    assert animation._repr_html_().startswith('<img src="data:image/gif;base64,R0lG')


def test_plot_refuses_to_animate_what_stands(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["plot", str(PAPER_FILE), "--plans", "0", "-o", str(tmp_path / "a.gif")]) == 2
    assert "nothing moves here" in capsys.readouterr().err
