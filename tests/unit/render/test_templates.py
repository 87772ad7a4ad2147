"""The template environment: strict, escaping, and none the worse for a broken cache."""

from __future__ import annotations

from pathlib import Path

import jinja2
import pytest

from ntagen.render.templates import environment

fresh = environment.__wrapped__


def check_macro(monkeypatch: pytest.MonkeyPatch, cache_home: Path) -> None:
    """A template is read and escapes what is put in, with the user's cache at some place."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(cache_home))
    macros = fresh().get_template("uppaal/macros.xml.jinja").module
    edge = macros.transition("a", "b", [("guard", 0, 0, "x < 1 && y")])  # type: ignore[attr-defined]
    assert '<label kind="guard" x="0" y="0">x &lt; 1 &amp;&amp; y</label>' in edge


def test_guards_are_escaped(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    check_macro(monkeypatch, tmp_path)


def test_a_cache_that_is_no_folder_does_no_harm(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "ntagen").write_text("not a folder")
    check_macro(monkeypatch, tmp_path)


def test_a_cache_that_vanishes_does_no_harm(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    templates = fresh()
    (tmp_path / "ntagen").rmdir()
    assert templates.get_template("model.xml.jinja") is not None


@pytest.mark.parametrize("damage", [b"", b"j2", b"\x00" * 500, None])
def test_a_damaged_cache_is_worked_out_anew(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, damage: bytes | None
) -> None:
    check_macro(monkeypatch, tmp_path)
    kept = list((tmp_path / "ntagen").iterdir())
    assert kept != []
    for file in kept:
        whole = file.read_bytes()
        file.write_bytes(whole[: len(whole) // 2] if damage is None else damage)
    check_macro(monkeypatch, tmp_path)


def test_unknown_names_are_errors() -> None:
    with pytest.raises(jinja2.UndefinedError):
        fresh().from_string("{{ model.nothing }}").render(model=object())
