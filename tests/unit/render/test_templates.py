"""How templates are filled in: unknown names, escapes, and what is kept of them on disk."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import jinja2
import pytest

from ntagen.render import documents, render
from tests.steering import PAPER


@pytest.fixture
def anew(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Callable[[], str]]:
    """Renders a model as a new process does, with a cache folder of its own."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def rendered() -> str:
        documents._environment.cache_clear()
        return render(PAPER)

    yield rendered
    documents._environment.cache_clear()


@pytest.mark.parametrize(
    "text", ["{{ nothing }}", "{{ model.nothing }}", "{% if nothing %}{% endif %}"]
)
def test_an_unknown_name_is_an_error(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, anew: Callable[[], str]
) -> None:
    (tmp_path / "one.jinja").write_text(text)
    monkeypatch.setattr(documents, "FOLDER", tmp_path)
    documents._environment.cache_clear()
    with pytest.raises(jinja2.UndefinedError, match="nothing"):
        documents.filled("one.jinja", model=PAPER)


def test_values_are_escaped_in_xml_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, anew: Callable[[], str]
) -> None:
    for name in ("one.xml.jinja", "one.c.jinja"):
        (tmp_path / name).write_text("{{ given }}\n")
    monkeypatch.setattr(documents, "FOLDER", tmp_path)
    documents._environment.cache_clear()
    assert documents.filled("one.c.jinja", given="a < b && c") == "a < b && c\n"
    assert documents.filled("one.xml.jinja", given="a < b && c") == "a &lt; b &amp;&amp; c\n"


def test_later_processes_find_the_compiled_templates(
    anew: Callable[[], str], tmp_path: Path
) -> None:
    first = anew()
    kept = {path.name: path.stat().st_mtime_ns for path in (tmp_path / "ntagen").iterdir()}
    assert kept
    assert anew() == first
    assert {path.name: path.stat().st_mtime_ns for path in (tmp_path / "ntagen").iterdir()} == kept


@pytest.mark.parametrize("damage", [b"", b"j2", b"\0" * 100, None])
def test_damaged_files_are_compiled_again(
    anew: Callable[[], str], tmp_path: Path, damage: bytes | None
) -> None:
    expected = anew()
    paths = list((tmp_path / "ntagen").iterdir())
    for path in paths:
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) // 2] if damage is None else damage)
    assert anew() == expected


def test_without_a_folder_for_them_they_are_compiled_each_time(
    anew: Callable[[], str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = anew()
    shutil.rmtree(tmp_path / "ntagen")
    # A file stands where the folder should be; then the folder is gone after it was made.
    (tmp_path / "ntagen").write_text("")
    assert anew() == expected
    monkeypatch.setattr(documents, "cache_folder", lambda: tmp_path / "gone")
    assert anew() == expected
