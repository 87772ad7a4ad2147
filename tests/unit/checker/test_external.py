"""Functions of libraries: allowed in Python, on the command line and in place of verifyta."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest

import ntagen
from ntagen import checker
from ntagen.cli import main

pytestmark = pytest.mark.skipif(
    os.name != "posix" or shutil.which("cc") is None, reason="there is no C compiler"
)

MODEL = """
import "libshare.so" { double share(int n); };
double found;
process P() {
    state A { ; 100 }, B;
    init A;
    trans A -> B { assign found = share(4); };
}
system P;
"""
QUERY = "E[<=1; 20](max: found)"


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("library")
    source = folder / "share.c"
    source.write_text("double share(int n) { return 1.0 / n; }\n", "utf-8")
    library = folder / "libshare.so"
    subprocess.run(["cc", "-shared", "-fPIC", "-o", library, source], check=True)
    return library


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "model.xta"
    path.write_text(MODEL, "utf-8")
    return path


def test_a_library_is_loaded_if_it_is_allowed(path: Path, library: Path) -> None:
    for allowed in (library, library.parent):
        for model in (
            ntagen.load(path, allow_external=[allowed]),
            checker.load(MODEL, allow_external=[str(allowed)]),
        ):
            assert model.check(QUERY).value == pytest.approx(0.25)


def test_nothing_is_loaded_by_default(path: Path) -> None:
    model = ntagen.load(path)
    with pytest.raises(checker.RejectedError, match="--allow-external"):
        model.check(QUERY)


def test_the_command_line_allows_libraries(
    path: Path, library: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["check", str(path), "--query", QUERY]
    assert main(words) == 2
    assert "--allow-external" in capsys.readouterr().err
    assert main([*words, "--allow-external", str(library)]) == 0
    assert "0.25" in capsys.readouterr().out


def test_verifyta_allows_libraries(
    path: Path, library: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    queries = tmp_path / "model.q"
    queries.write_text(QUERY, "utf-8")
    words = [str(path), str(queries)]
    assert main(["verifyta", "--allow-external", f"elsewhere{os.pathsep}{library}", *words]) == 0
    assert "0.25" in capsys.readouterr().out
    assert main(["verifyta", *words]) == 1
    assert "a library that is not allowed" in capsys.readouterr().err
