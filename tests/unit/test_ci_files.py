"""The files by which other projects use ntagen in CI: hooks of pre-commit, the action."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml

from ntagen.cli import main

ROOT = Path(__file__).parents[2]
GATE = "process Gate() { state Shut, Open; init Shut; trans Shut -> Open { }; }\nsystem Gate;\n"


def test_hooks_are_commands_that_know_their_options(tmp_path: Path) -> None:
    hooks = re.findall(
        r"^  entry: ntagen (.+)$", (ROOT / ".pre-commit-hooks.yaml").read_text(), re.M
    )
    assert len(hooks) == 2
    path = tmp_path / "paper.nsl"
    path.write_bytes((ROOT / "examples" / "paper.nsl").read_bytes())
    for words in hooks:
        assert main([*words.split(), str(path)]) == 0
    path.write_text(path.read_text().replace("  ", "     "))
    assert main(["fmt", "--check", str(path)]) == 1


def action_run(folder: Path, models: str, arguments: str = "--expect") -> tuple[int, str]:
    """The exit code and the output of the action's last step."""
    tools = folder / "tools"
    tools.mkdir(exist_ok=True)
    command = tools / "ntagen"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m ntagen "$@"\n')
    command.chmod(0o755)
    found = subprocess.run(
        ["bash", str(ROOT / ".ci" / "check_models.sh")],
        cwd=folder,
        env={
            **os.environ,
            "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}",
            "PYTHONPATH": str(ROOT),
            "MODELS": models,
            "ARGUMENTS": arguments,
        },
        capture_output=True,
        text=True,
        check=False,
    )
    return found.returncode, found.stdout + found.stderr


def test_the_action_checks_each_model_with_the_queries_beside_it(tmp_path: Path) -> None:
    folder = tmp_path / "some models"
    folder.mkdir()
    for name, said in (("one", "true"), ("two", "false")):
        (folder / f"{name}.xta").write_text(GATE)
        (folder / f"{name}.q").write_text(f"E<> Gate.Open // {said}\n")
    code, out = action_run(tmp_path, "  some models/o*.xta\n\n", "--expect --timeout 60s")
    assert (code, out) == (
        0,
        "some models/one.xta: 1 query: 1 satisfied; 1 as expected, 0 not as expected\n",
    )
    code, out = action_run(tmp_path, "**/*.xta")
    assert code == 1
    assert "::error file=some models/two.q,line=1,col=1,title=E<> Gate.Open::" in out


@pytest.mark.parametrize("models", ["", "none/*.xml"])
def test_the_action_refuses_a_list_without_models(tmp_path: Path, models: str) -> None:
    code, out = action_run(tmp_path, models)
    assert (code, out.startswith("::error title=No model::")) == (2, True)


def test_the_action_names_its_script_and_its_inputs() -> None:
    action = (ROOT / "action.yml").read_text()
    script = (ROOT / ".ci" / "check_models.sh").read_text()
    assert "$GITHUB_ACTION_PATH/.ci/check_models.sh" in action
    for name in ("models", "queries", "arguments"):
        assert f"{name.upper()}: ${{{{ inputs.{name} }}}}" in action
        assert f"${name.upper()}" in script or f"${{{name.upper()}:-}}" in script


def release_jobs() -> dict[str, Any]:
    """The jobs of the workflow that makes a release."""
    text = (ROOT / ".github" / "workflows" / "release.yml").read_text()
    jobs: dict[str, Any] = yaml.safe_load(text)["jobs"]
    return jobs


@pytest.mark.parametrize("name", ["run", "check_models.sh", "wheels", "try_wheel"])
def test_scripts_can_be_read_and_run(name: str) -> None:
    script = ROOT / ".ci" / name
    assert os.access(script, os.X_OK)
    subprocess.run(["bash", "-n", str(script)], check=True)


def test_a_release_builds_each_target_of_the_script_once() -> None:
    script = (ROOT / ".ci" / "wheels").read_text()
    known = [
        target for found in re.findall(r"targets=\(([^)\"]+)\)", script) for target in found.split()
    ]
    jobs = release_jobs()
    built = [one["target"] for one in jobs["wheels"]["strategy"]["matrix"]["include"]]
    assert sorted(built) == sorted(known)
    assert len(set(built)) == 5
    page = (ROOT / "docs" / "releasing.md").read_text()
    assert all(f"`{target}`" in page for target in built)


def test_a_release_tries_each_wheel_before_any_is_published() -> None:
    jobs = release_jobs()
    steps = [step["run"] for step in jobs["wheels"]["steps"] if "run" in step]
    assert [step.split()[1] for step in steps] == [".ci/wheels", ".ci/try_wheel"]
    assert (jobs["wheels"]["needs"], jobs["publish"]["needs"]) == ("sources", "wheels")
    assert jobs["publish"]["if"] == "github.ref_type == 'tag'"


def test_a_release_uses_the_maturin_of_development() -> None:
    (pin,) = re.findall(r"^maturin==[\w.]+", (ROOT / "requirements-dev.lock").read_text(), re.M)
    for name in (".ci/wheels", ".github/workflows/release.yml"):
        assert re.findall(r"maturin==[\w.]+", (ROOT / name).read_text()) == [pin]


def test_a_wheel_is_tried_without_the_package_beside_it() -> None:
    # What the script copies is there, and the package itself is not among it.
    script = (ROOT / ".ci" / "try_wheel").read_text().replace("\\\n", " ")
    (copied,) = re.findall(r'^cp -r (.+) "\$folder/work"$', script, re.M)
    assert "ntagen" not in copied.split()
    assert all((ROOT / name).exists() for name in copied.split())
    named = re.findall(r"\bexamples/[\w./]+", script + (ROOT / "README.md").read_text())
    assert all((ROOT / name).exists() for name in named)


def test_trying_nothing_is_refused() -> None:
    found = subprocess.run(
        ["bash", str(ROOT / ".ci" / "try_wheel")], capture_output=True, text=True, check=False
    )
    assert (found.returncode, found.stderr[:6]) == (2, "usage:")


def test_tests_that_a_wheel_does_without_are_there() -> None:
    script = (ROOT / ".ci" / "try_wheel").read_text()
    assert all((ROOT / name).is_file() for name in re.findall(r"--ignore (\S+)", script))
    left_out = re.findall(r"--deselect (\S+)::(\w+)", script)
    assert left_out
    for path, name in left_out:
        assert f"def {name}(" in (ROOT / path).read_text()
