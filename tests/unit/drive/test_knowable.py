"""A target that is too small for what can be known of the tip is refused before anything moves."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from ntagen.cli import main
from ntagen.drive.configure import Configuration, configure, require_knowable
from ntagen.errors import InputError
from ntagen.motion import Breath, Motion
from ntagen.nsl import Task
from ntagen.parameters import BY_WORDS, Given
from ntagen.scene import Scene
from tests.steering import scene, sphere


def to_a_target(radius_mm: float) -> Scene:
    return scene(targets=[sphere("T", "target", (2.0, -40.0, 3.0), radius_mm)])


def configured(where: Scene, needle: str = "phantom", **values: str) -> Configuration:
    given = [Given(BY_WORDS[one], BY_WORDS[one].parse(text), one) for one, text in values.items()]
    return configure(given, where, needle=needle)


def test_what_would_do_does() -> None:
    with pytest.raises(InputError) as caught:
        configured(to_a_target(0.5), noise="2mm")
    found = re.search(
        r"'T' is too small .* 0\.5 mm deep.* known to ([\d.]+) mm at best.*confidence of ([\d.]+), "
        r"and 0\.98 is asked for\nhint: a target that is ([\d.]+) mm deep .* "
        r"--set 'accept ([\d.]+)'\n"
        r"note: `noise`: noise$",
        str(caught.value),
        re.DOTALL,
    )
    assert found is not None
    std_mm, confidence, deep_mm, accept = map(float, found.groups())
    assert deep_mm == pytest.approx(2.054 * std_mm, abs=0.02)
    assert accept <= confidence < 0.98
    configured(to_a_target(deep_mm), noise="2mm")
    configured(to_a_target(0.5), noise="2mm", accept=f"{accept}")
    configured(to_a_target(0.5), noise="0.1mm")
    with pytest.raises(InputError, match="too small"):
        configured(to_a_target(deep_mm - 0.02), noise="2mm")


def test_only_needles_and_targets_that_need_the_confidence_are_judged() -> None:
    configured(to_a_target(0.5), needle="virtual", noise="2mm")
    settings = configured(to_a_target(5.0), noise="2mm").settings
    still = to_a_target(0.5)
    with pytest.raises(InputError, match="too small"):
        require_knowable(settings, still)
    motion = Motion(4.0, (0.0, 0.0, 8.0))
    moving = replace(still.targets[-1], motion=motion)
    require_knowable(settings, replace(still, targets=(moving,), breath=Breath(4.0, 0.5, 2)))


def test_a_refused_run_leaves_no_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, log = tmp_path / "small.nsl", tmp_path / "run.mcap"
    path.write_text(Task(to_a_target(0.5)).to_nsl())
    drive = ["drive", str(path), "--needle", "phantom", "--log", str(log)]
    assert main([*drive, "--noise", "2mm"]) == 2
    assert "'T' is too small" in capsys.readouterr().err
    assert not log.exists()


@pytest.mark.parametrize("accept", ["0", "1", "-0.5", "nan"])
def test_a_confidence_that_is_none_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], accept: str
) -> None:
    path = tmp_path / "task.nsl"
    path.write_text(Task(to_a_target(5.0)).to_nsl())
    assert main(["drive", str(path), "--needle", "phantom", "--set", f"accept {accept}"]) == 2
    said = capsys.readouterr().err
    assert "greater than 0 and less than 1" in said or "write for example `accept 0.98`" in said
    path.write_text(path.read_text().rstrip().removesuffix("}") + f"drive {{ accept {accept} }} }}")
    assert main(["drive", str(path), "--needle", "phantom"]) == 2
    assert "accept" in capsys.readouterr().err
