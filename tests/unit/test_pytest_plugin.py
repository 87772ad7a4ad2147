"""The plugin for pytest: models as test files, in projects of their own."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

GATE = """int n;
process Gate() { state Shut, Open; init Shut; trans Shut -> Open { assign n = 1; }; }
system Gate;
"""

GAME = """process P() { state A, B; init A; trans A -> B { }; }
system P;
"""


def pytest_run(folder: Path, *words: str) -> tuple[int, str]:
    """The exit code and the output of pytest in a project that has the plugin."""
    found = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "ntagen.pytest_plugin", "-rs", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    return found.returncode, found.stdout + found.stderr


def test_pytest_finds_the_plugin_by_its_entry_point() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert hasattr(import_module(project["entry-points"]["pytest11"]["ntagen"]), "ModelFile")


def test_queries_are_tests_and_a_failure_shows_the_trace(tmp_path: Path) -> None:
    (tmp_path / "gate.xta").write_text(GATE)
    (tmp_path / "gate.q").write_text(
        "E<> Gate.Open // true\n/* Nothing is counted. */\nA[] n == 0 // true\nsup: n\n"
        "E<> Gate.Opne\nsup: n // EXPECT:1\n"
    )
    code, out = pytest_run(tmp_path, "gate.xta")
    assert code == 1
    assert "2 failed, 2 passed, 1 skipped" in out
    assert (
        "A[] n == 0 is not satisfied; expected: satisfied\n"
        "Nothing is counted.\n"
        "     start  Gate.Shut\n"
        "        1.  at 0: Gate.Shut -> Open\n"
        "              n: 0 -> 1\n"
    ) in out
    assert "the query is refused\n" in out
    assert "gate.q:5:10: error[E0266]" in out
    assert "the file does not say what is expected" in out
    code, out = pytest_run(tmp_path, "gate.xta", "-k", "Open")
    assert (code, "1 passed" in out) == (0, True)


@pytest.mark.slow
def test_only_models_that_are_asked_for_are_collected(tmp_path: Path) -> None:
    for folder in ("models", "reports"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "gate.xta").write_text(GATE)
        (tmp_path / folder / "gate.q").write_text("E<> Gate.Open // true\n")
    (tmp_path / "reports" / "junit.xml").write_text("<testsuites/>")
    assert pytest_run(tmp_path)[0] == pytest.ExitCode.NO_TESTS_COLLECTED
    (tmp_path / "pytest.ini").write_text("[pytest]\nntagen_models = models/*.xta\n")
    code, out = pytest_run(tmp_path, "-q")
    assert code == 0, out
    assert "1 passed" in out
    code, out = pytest_run(tmp_path, "reports/junit.xml")
    assert code == pytest.ExitCode.INTERRUPTED
    assert "this XML file is not a UPPAAL model: its root is `<testsuites>`" in out


@pytest.mark.slow
def test_a_query_under_a_strategy_can_be_tested_alone(tmp_path: Path) -> None:
    (tmp_path / "game.xta").write_text(GAME)
    (tmp_path / "game.q").write_text(
        "strategy S = control: A[] P.A // yes\nE<> P.B under S // no\n"
    )
    code, out = pytest_run(tmp_path, "game.xta", "-k", "under")
    assert code == 0, out
    (tmp_path / "pytest.ini").write_text("[pytest]\nntagen_timeout_s = soon\n")
    code, out = pytest_run(tmp_path, "game.xta")
    assert "ntagen_timeout_s is 'soon'; write a number of seconds" in out
