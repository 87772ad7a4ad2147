"""Shields on the command line: options, outputs, and what scripts read."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen.cli import main
from tests.choices import TANK

QUERY = "strategy S = acontrol: A[] level >= 0 && level < 8 { level[0,10]:4 }"
WIDE = "strategy S = acontrol: A[] level >= 0 && level < 11 { level[0,7.5]:3 }"


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("tank.xta").write_text(TANK, encoding="utf-8")
    return tmp_path


def check(capsys: pytest.CaptureFixture[str], *words: str, query: str = QUERY) -> str:
    assert main(["check", "tank.xta", "--query", query, *words]) == 0
    shown = capsys.readouterr()
    return shown.out + shown.err


def test_an_answer_says_what_is_known(capsys: pytest.CaptureFixture[str]) -> None:
    assert "3 of 4 cells are safe (75.0000 %)" in check(capsys, "--set", "shield samples 2")
    words = ["--json", "--set", "shield samples 2", "--seed", "3"]
    found = json.loads(check(capsys, *words).splitlines()[0])
    assert (found["cells"], found["safe_cells"], found["unseen_pairs"]) == (4, 3, 0)
    assert found["trial"]["value"] == 0.0


@pytest.mark.parametrize("number", ["1", "safe"])
def test_what_counts_outside_is_an_option(capsys: pytest.CaptureFixture[str], number: str) -> None:
    assert main(["check", "tank.xta", "--query", WIDE]) == 2
    assert "outside the grid" in capsys.readouterr().err
    out = check(capsys, "--out-of-bounds", number, query=WIDE)
    assert "3 of 3 cells are safe" in out


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("s.json", '"format":"ntagen-shield"'),
        ("s", '"format":"ntagen-shield"'),
        ("s.c", "uint64_t S_allowed("),
        ("s.py", "def allowed("),
    ],
)
def test_a_shield_is_written(capsys: pytest.CaptureFixture[str], name: str, wanted: str) -> None:
    check(capsys, "--strategy", name)
    assert wanted in Path(name).read_text(encoding="utf-8")


def test_options_without_effect_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--out-of-bounds", "safe", "--set", "shield repeats 2"]
    out = check(capsys, *words, query="Pr[#<=5; 10](<> level >= 0)")
    assert "--out-of-bounds has no effect here: no query is for a shield" in out
    assert "--set 'shield repeats …' has no effect here: no query is for a shield" in out
    out = check(capsys, "--runs", "9", "--alpha", "0.1", "--seed", "1")
    assert "--runs has no effect here: no query is a statistical one" in out
    assert "--alpha" not in out
    assert "seed" not in out
    assert main(["check", "tank.xta", "--query", QUERY, "--out-of-bounds", "4"]) == 2
    assert "none of error, safe, unsafe and sample" in capsys.readouterr().err


def test_verifyta_says_the_verdict_only(capsys: pytest.CaptureFixture[str]) -> None:
    Path("q.q").write_text(f"{WIDE}\nPr[#<=50; 100](<> level < 0) under S\n", encoding="utf-8")
    assert main(["verifyta", "--out-of-bounds", "1", "tank.xta", "q.q"]) == 0
    lines = capsys.readouterr().out.replace("\x1b[2K", "").splitlines()
    verdict = lines.index("Verifying formula 1 at q.q:1") + 1
    assert lines[verdict] == " -- Formula is satisfied."
    assert "(0/100 runs) Pr(<> …)" in "\n".join(lines)
