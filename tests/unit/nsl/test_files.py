"""Files that cannot be read, and what is said of them."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import ntagen
from ntagen import nsl
from ntagen.cli import main
from ntagen.nsl.source import MAX_SOURCE_BYTES

SMALLEST = """environment e {
  needle { radius 30 mm  speed 1 mm/s }
  target T1 sphere (0, -50, 0) mm radius 10 mm
}
"""


def check_refused(path: Path, code: str, message: str) -> nsl.Diagnostic:
    """A file is refused as a whole, with one diagnostic."""
    with pytest.raises(nsl.SourceError) as caught:
        nsl.load(path)
    (diagnostic,) = caught.value.diagnostics
    assert (diagnostic.code, diagnostic.line) == (code, 0)
    assert message in diagnostic.message
    assert str(caught.value).startswith(f"{path}: error[{code}]: ")
    return diagnostic


def test_missing_file_is_refused(tmp_path: Path) -> None:
    check_refused(tmp_path / "env.nsl", "N001", "no such file")


def test_missing_file_with_a_neighbour_of_similar_name_gets_a_hint(tmp_path: Path) -> None:
    (tmp_path / "paper.nsl").write_text(SMALLEST)
    diagnostic = check_refused(tmp_path / "papr.nsl", "N001", "no such file")
    assert diagnostic.hint == "did you mean `paper.nsl`?"


def test_folder_is_refused(tmp_path: Path) -> None:
    check_refused(tmp_path, "N002", "it is a folder")


def test_path_through_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "env.nsl").write_text(SMALLEST)
    check_refused(tmp_path / "env.nsl" / "more.nsl", "N002", "cannot be read")


def test_path_with_a_null_byte_is_refused() -> None:
    check_refused(Path("a\0b.nsl"), "N002", "cannot be read")


@pytest.mark.skipif(os.geteuid() == 0, reason="everything may be read by root")
def test_unreadable_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "env.nsl"
    path.write_text(SMALLEST)
    path.chmod(0)
    check_refused(path, "N002", "permission denied")


def test_empty_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "env.nsl"
    path.write_bytes(b"")
    check_refused(path, "N005", "describes nothing")


def test_binary_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "env.nsl"
    path.write_bytes(bytes(range(256)))
    check_refused(path, "N003", "not text")


def test_file_in_another_encoding_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "env.nsl"
    path.write_bytes(SMALLEST.encode("utf-16"))
    check_refused(path, "N003", "not text")


def test_huge_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "env.nsl"
    path.write_bytes(b" " * (MAX_SOURCE_BYTES + 1))
    check_refused(path, "N006", "1 MiB")


def test_byte_order_mark_is_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "env.nsl"
    path.write_text(SMALLEST, encoding="utf-8-sig")
    assert nsl.load(path) == nsl.loads(SMALLEST)


def test_path_may_be_a_string(tmp_path: Path) -> None:
    path = tmp_path / "env.nsl"
    path.write_text(SMALLEST)
    assert nsl.load(str(path)) == nsl.load(path)


def test_long_chain_of_includes_is_refused(tmp_path: Path) -> None:
    for number in range(100):
        (tmp_path / f"{number}.nsl").write_text(f'include "{number + 1}.nsl"\n')
    with pytest.raises(nsl.SourceError) as caught:
        nsl.load(tmp_path / "0.nsl")
    assert [d.code for d in caught.value.diagnostics] == ["N050", "N019"]


def test_tables_of_the_grammar_are_not_needed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ntagen.nsl.grammar import grammar

    (tmp_path / "ntagen").write_text("a file where the folder would be")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    grammar.cache_clear()
    nsl.loads(SMALLEST)


def test_broken_tables_of_the_grammar_are_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from ntagen.nsl.grammar import grammar

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for _ in range(2):
        grammar.cache_clear()
        nsl.loads(SMALLEST)
    (tables,) = (tmp_path / "ntagen").iterdir()
    good = tables.read_bytes()
    for bad in (b"", b"nothing like it", good[:1000], good[: len(good) // 2]):
        tables.write_bytes(bad)
        grammar.cache_clear()
        nsl.loads(SMALLEST)
        assert tables.stat().st_size > 0.9 * len(good)


def test_countless_mistakes_are_cut_short() -> None:
    with pytest.raises(nsl.SourceError) as caught:
        nsl.loads("environment e {\n" + "tissue rubber;\n" * 2000)
    codes = [diagnostic.code for diagnostic in caught.value.diagnostics]
    assert len(codes) == 1001
    assert codes[0] == "N007"


@pytest.mark.parametrize("name", ["a\0b", "\ud800"])
def test_a_name_that_no_file_has_is_reported(name: str) -> None:
    with pytest.raises(nsl.SourceError) as caught:
        nsl.loads(f'include "{name}"\n{SMALLEST}')
    assert caught.value.diagnostics[0].code in ("N001", "N002")


def test_includes_lie_below_the_first_file_or_where_it_is_allowed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "shared").mkdir()
    (tmp_path / "task").mkdir()
    (tmp_path / "shared" / "lets.nsl").write_text("let depth = 50 mm\n")
    (tmp_path / "task" / "link.nsl").symlink_to(tmp_path / "shared" / "lets.nsl")
    text = SMALLEST.replace("(0, -50, 0) mm", "-depth * y")
    for path in ("../shared/lets.nsl", "link.nsl", str(tmp_path / "shared" / "lets.nsl")):
        env = tmp_path / "task" / "env.nsl"
        env.write_text(f'include "{path}"\n{text}\n')
        with pytest.raises(nsl.SourceError) as caught:
            nsl.load(env)
        assert [d.code for d in caught.value.diagnostics] == ["N044", "N020"]
        assert f"--include {tmp_path / 'shared'}" in str(caught.value)
        scene = nsl.load(env, include=[tmp_path / "shared"])
        assert scene == nsl.loads(env.read_text(), str(env), include=[str(tmp_path)])
    monkeypatch.chdir(tmp_path)
    allowed = ["--include", "other", "--include", "shared"]
    for command in (
        ["check"],
        ["compile", "-o", "."],
        ["info"],
        ["plot", "--plans", "0", "-o", "a.png"],
        ["drive", "--quiet"],
    ):
        assert main([*command, "task/env.nsl"]) == 2
        assert "N044" in capsys.readouterr().err
        assert main([*command, "task/env.nsl", *allowed]) == 0
    assert ntagen.load("task/env.nsl", include=["shared"]).processes
