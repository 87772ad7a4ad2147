"""The models in `examples/models/` answer as their files of queries say."""

from __future__ import annotations

from pathlib import Path

import pytest

from ntagen.cli import main
from tests.tutorials import ROOT

MODELS = sorted((ROOT / "examples" / "models").glob("*.xta"))


@pytest.mark.parametrize("model", MODELS, ids=lambda path: path.stem)
def test_answers_are_as_expected(model: Path, capsys: pytest.CaptureFixture[str]) -> None:
    queries = model.with_suffix(".q")
    expected = queries.read_text("utf-8").count("// EXPECT:")
    assert main(["check", str(model), str(queries), "--expect"]) == 0
    assert expected > 1
    assert f"; {expected} as expected, 0 not as expected" in capsys.readouterr().out


def test_there_are_five() -> None:
    assert [model.stem for model in MODELS] == [
        "fischer",
        "four_states",
        "light_switch",
        "service",
        "train_gate",
    ]
