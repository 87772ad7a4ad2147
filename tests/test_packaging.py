"""That what is installed is complete: the templates, which the build does not find by itself.

`ntagen/templates` is a link to the top-level folder. Where links are not kept (some archives, some
checkouts) it becomes a small text file, and nothing complains but these tests.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.resources import files
from pathlib import Path, PurePosixPath

import pytest
from packaging.requirements import Requirement

from ntagen.version import VERSION

ROOT = Path(__file__).parents[1]
TEMPLATES = ROOT / "templates"


def digests(folder: Path) -> dict[str, str]:
    """The files below a folder by relative name, with a digest of their bytes."""
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_the_package_holds_the_templates() -> None:
    package = Path(str(files("ntagen"))) / "templates"
    assert package.is_dir(), "ntagen/templates is no folder: was the link lost?"
    assert digests(package) == digests(TEMPLATES)
    assert "model.xml.jinja" in digests(package)


def test_the_lock_file_pins_all_that_is_asked_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lock = (ROOT / "requirements-dev.lock").read_text()
    pins = re.findall(r"^([\w.-]+)==([\w.]+)(.*) \\$", lock, re.MULTILINE)
    for text in [*project["dependencies"], *project["optional-dependencies"]["dev"]]:
        requirement = Requirement(text)
        found = [version for name, version, _ in pins if name == requirement.name]
        assert found, text
        assert all(requirement.specifier.contains(version) for version in found), text
    # Each line that is no pin is a hash or a comment: no address is in it.
    others = [line for line in lock.splitlines() if not re.match(r"[\w.-]+==\S+( ; .*)? \\$", line)]
    assert all(re.match(r"#|    --hash=sha256:[0-9a-f]{64}( \\)?$", line) for line in others)
    assert len(pins) == len(re.findall(r"^[\w.-]+==", lock, re.MULTILINE))


def test_the_version_is_that_of_the_wheel() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["dynamic"] == ["version"]  # so that it is the engine's
    assert (
        tomllib.loads((ROOT / "checker" / "Cargo.toml").read_text())["package"]["version"]
        == VERSION
    )


@pytest.mark.slow
def test_the_wheel_holds_the_templates_and_the_data_files(tmp_path: Path) -> None:
    # Without isolation the build takes maturin from here and not from the network.
    options = ["--quiet", "--no-deps", "--no-build-isolation", "-w", str(tmp_path)]
    tools = str(Path(sys.executable).parent)
    run = subprocess.run(
        [sys.executable, "-m", "pip", "wheel", *options, "."],
        cwd=ROOT,
        env={**os.environ, "PATH": tools + os.pathsep + os.environ.get("PATH", "")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    (wheel,) = tmp_path.glob("ntagen-*.whl")
    with zipfile.ZipFile(wheel) as archive:
        held = {
            name: hashlib.sha256(archive.read(name)).hexdigest()
            for name in archive.namelist()
            if not name.endswith("/")
        }
    prefix = "ntagen/templates/"
    templates = {
        name.removeprefix(prefix): value for name, value in held.items() if name.startswith(prefix)
    }
    assert templates == digests(TEMPLATES)
    others = {
        f"ntagen/{path.relative_to(ROOT / 'ntagen').as_posix()}"
        for pattern in ("*.py", "*.pyi", "*.lark", "*.md", "*.html", "py.typed")
        for path in (ROOT / "ntagen").rglob(pattern)
    }
    assert others <= set(held)
    assert any(PurePosixPath(name).match("ntagen/_checker*.so") for name in held)
    assert {name.partition("/")[0].partition("-")[0] for name in held} == {"ntagen"}
