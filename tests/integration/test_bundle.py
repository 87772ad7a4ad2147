"""The library of the editor is what its packages give, byte for byte."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from ntagen.serve import pages

BUNDLE = Path(__file__).parents[2] / "editors" / "bundle"
COMMITTED = Path(pages.__file__).parent / "editor" / "codemirror.js"

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("npm") is None, reason="needs node and npm"),
]


def test_the_bundle_is_built_again(tmp_path: Path) -> None:
    for name in ("package.json", "package-lock.json", "entry.js", "build.mjs"):
        shutil.copy(BUNDLE / name, tmp_path)
    # Without the registry, as on a machine without a network, there is nothing to compare.
    install = ["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--fetch-retries=0"]
    found = subprocess.run(install, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    if found.returncode != 0:
        pytest.skip(f"the packages cannot be had: {found.stderr[-300:]}")
    built = tmp_path / "built.js"
    subprocess.run(["node", "build.mjs", str(built)], cwd=tmp_path, check=True, timeout=120)
    assert built.read_bytes() == COMMITTED.read_bytes()
