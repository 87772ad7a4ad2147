"""The examples of anatomy: their scripts make their files, and their tasks are solved."""

from __future__ import annotations

import gzip
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from ntagen import checker, nsl
from ntagen.cli import main
from ntagen.render import render

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
TASKS = {"segmentation": "biopsy.nsl", "liver": "liver.nsl"}


def made(tmp_path: Path, folder: str, script: str) -> Path:
    """A copy of an example whose script has been run, without the files that it makes."""
    copy = tmp_path / folder
    shutil.copytree(EXAMPLES / folder, copy)
    for name in ("biopsy.seg.nrrd", "vessels.nsl"):
        (copy / name).unlink(missing_ok=True)
    subprocess.run([sys.executable, script], cwd=copy, check=True)
    return copy


@pytest.mark.slow
def test_the_script_makes_the_segmentation(tmp_path: Path) -> None:
    """Compressed bytes may differ between versions of zlib; what is in them may not."""
    new = made(tmp_path, "segmentation", "make_segmentation.py") / "biopsy.seg.nrrd"
    heads = [
        path.read_bytes().partition(b"\n\n")
        for path in (new, EXAMPLES / "segmentation" / "biopsy.seg.nrrd")
    ]
    assert heads[0][0] == heads[1][0]
    assert gzip.decompress(heads[0][2]) == gzip.decompress(heads[1][2])


def test_the_script_grows_the_vessels(tmp_path: Path) -> None:
    new = made(tmp_path, "liver", "make_vessels.py") / "vessels.nsl"
    kept = (EXAMPLES / "liver" / "vessels.nsl").read_text("utf-8")
    assert nsl.format_text(new.read_text("utf-8")) == kept


@pytest.mark.parametrize("folder", TASKS)
def test_the_examples_have_plans(folder: str) -> None:
    task = nsl.load_task(EXAMPLES / folder / TASKS[folder])
    assert task.warnings == ()
    model = checker.load(render(task.scene, only_plans=True))
    assert model.check(model.queries[1].text).verdict == "satisfied"


@pytest.mark.slow
@pytest.mark.parametrize("folder", TASKS)
def test_the_phantom_reaches_the_targets(
    folder: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "run.mcap"
    task = str(EXAMPLES / folder / TASKS[folder])
    assert main(["drive", task, "--needle", "phantom", "--seed", "2", "--log", str(log)]) == 0
    assert "target reached" in capsys.readouterr().out
    assert main(["replay", str(log)]) == 0
    assert "the same decisions again" in capsys.readouterr().out
