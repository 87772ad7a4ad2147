"""The essays of `docs/algorithms`: their models give the states, counts and outputs that they show.

What they and the glossary name in the source is there.

An essay has fenced blocks; the second word behind the opening fence names the model.

* ``xta NAME``: the model.
* ``answers NAME``: a query on a line, and below it, indented, what `ntagen check --json` says: the
  verdict, and what else the essay speaks about. Options of the command may stand before it.
* ``states NAME``: the reachable symbolic states as `Model.states` gives them, a state a line.
* ``decisions NAME``: a game query, and below it the decisions of its strategy, each once, with its
  rank.
* ``console NAME``: commands, each behind ``$``, and lines that they print, in this order.
* ``json NAME``: a file NAME.json that commands read.
"""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import dataclass
from pathlib import Path

import pytest

import ntagen
from ntagen.cli import main
from tests.tutorials import commands_of

ROOT = Path(__file__).resolve().parents[2]
ESSAYS = sorted((ROOT / "docs" / "algorithms").glob("*.md"))
GLOSSARY = ROOT / "docs" / "glossary.md"
PAGES = [*ESSAYS, GLOSSARY]
SOURCES = (ROOT, ROOT / "checker" / "src")

FENCED = re.compile(r"^```(\w+) (\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE_NAME = re.compile(r"`([\w./-]+\.(?:rs|py|md))`")
LINK = re.compile(r"\]\(([^)#:]+)(?:#[^)]*)?\)")


@dataclass(frozen=True)
class Block:
    """A fenced block about a model."""

    kind: str
    model: str
    lines: tuple[str, ...]


def blocks(essay: Path) -> list[Block]:
    """The fenced blocks of an essay that are about a model."""
    found = FENCED.findall(essay.read_text())
    return [Block(kind, model, tuple(text.splitlines())) for kind, model, text in found]


def name_of(page: Path) -> str:
    return page.stem


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_files(essay: Path, folder: Path) -> None:
    for block in blocks(essay):
        if block.kind in {"xta", "json"}:
            (folder / f"{block.model}.{block.kind}").write_text("\n".join(block.lines) + "\n")


@pytest.mark.parametrize("essay", ESSAYS, ids=name_of)
def test_queries_have_the_answers_of_the_essay(
    essay: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_files(essay, folder)
    for block in blocks(essay):
        if block.kind == "answers":
            check_answers(block, capsys)


def check_answers(block: Block, capsys: pytest.CaptureFixture[str]) -> None:
    query = ""
    for line in filter(None, block.lines):
        if not line.startswith(" "):
            query = line
            continue
        *options, expected = line.strip().split(": ", 1)
        arguments = [*shlex.split(" ".join(options)), "--query", query, "--json"]
        main(["check", f"{block.model}.xta", *arguments])
        captured = capsys.readouterr()
        assert captured.out, captured.err
        answer = json.loads(captured.out)
        said = {
            answer["verdict"],
            f"{answer['explored']} explored",
            f"{answer['stored']} stored",
            f"value {answer['value']}",
        }
        missing = set(expected.split(", ")) - said
        assert not missing, f"{block.model}: {query} {options}: {missing}, but {said}"


@pytest.mark.parametrize("essay", ESSAYS, ids=name_of)
def test_models_have_the_states_of_the_essay(essay: Path, folder: Path) -> None:
    write_files(essay, folder)
    for block in blocks(essay):
        if block.kind == "states":
            shown = [tuple(re.split(r" {2,}", line.strip())) for line in block.lines[1:]]
            assert shown == reachable_states(folder / f"{block.model}.xta"), block.model


def reachable_states(path: Path) -> list[tuple[str, ...]]:
    """Of each state: its number, locations with variables, zone, and the state that it is from."""
    rows: list[tuple[str, ...]] = []
    for state in ntagen.load(path).states():
        locations = [f"{process}.{location}" for process, location in state.locations.items()]
        variables = [f"{variable}={value}" for variable, value in state.variables.items()]
        zone = " && ".join(state.zone) or "true"
        source = "-" if state.predecessor is None else str(state.predecessor)
        rows.append((str(state.index), " ".join(locations + variables), zone, source))
    return rows


@pytest.mark.parametrize("essay", ESSAYS, ids=name_of)
def test_strategies_decide_as_the_essay_shows(essay: Path, folder: Path) -> None:
    write_files(essay, folder)
    for block in blocks(essay):
        if block.kind == "decisions":
            query, *rows = block.lines
            shown = [tuple(re.split(r" {2,}", row.strip())) for row in rows]
            assert shown == decisions(folder / f"{block.model}.xta", query), query


def decisions(path: Path, query: str) -> list[tuple[str, ...]]:
    """Of each decision of the winner's strategy, once: its locations, what it does, its rank."""
    rows: list[tuple[str, ...]] = []
    for state in ntagen.load(path).synthesize(query):
        places = " ".join(f"{process}.{place}" for process, place in state.locations.items())
        rows += [(places, str(one), str(one.rank)) for one in state.decisions]
    return list(dict.fromkeys(rows))


@pytest.mark.parametrize("essay", ESSAYS, ids=name_of)
def test_commands_print_what_the_essay_shows(
    essay: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_files(essay, folder)
    for block in blocks(essay):
        if block.kind == "console":
            check_console(block, capsys)


def check_console(block: Block, capsys: pytest.CaptureFixture[str]) -> None:
    for command, shown in commands_of("\n".join(block.lines)):
        main(shlex.split(command.removeprefix("ntagen ")))
        captured = capsys.readouterr()
        printed = iter(without_times(captured.out + captured.err))
        for line in without_times(shown):
            assert line in printed, f"{command}: {line!r} is not printed, or not there"


def without_times(text: str) -> list[str]:
    """The lines with single spaces, without times and sizes, which differ from run to run."""
    lines = (" ".join(line.split()) for line in text.splitlines())
    return [re.sub(r", [\d.]+ (s|ms), [\d.]+ \w+$", "", line) for line in lines if line]


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_files_that_a_page_names_are_there(page: Path) -> None:
    text = page.read_text()
    missing = [name for name in FILE_NAME.findall(text) if not places(name)]
    missing += [link for link in LINK.findall(text) if not (page.parent / link).exists()]
    assert not missing


def places(name: str) -> list[Path]:
    """The files, or the files below the folders, that a page means by a name."""
    found = [source / name for source in SOURCES if (source / name).exists()]
    return [file for one in found for file in (files_below(one) if one.is_dir() else [one])]


def files_below(folder: Path) -> list[Path]:
    """The sources of both languages in a folder and in those below it."""
    return [file for file in folder.rglob("*") if file.suffix in {".rs", ".py"}]


def test_types_of_the_glossary_are_where_it_says() -> None:
    rows = [line.split("|") for line in GLOSSARY.read_text().splitlines() if line.count("|") > 3]
    for _, term, _, where, _ in rows:
        names = re.findall(r"`([^`]+)`", where)
        types = {name for name in names if name[0].isupper()}
        files = [file for name in names if name not in types for file in places(name)]
        text = "".join(file.read_text() for file in files)
        defined = set(re.findall(r"\b(?:struct|enum|trait|class|type) (\w+)", text))
        assert types <= defined, f"{term}: {types - defined} not in {names}"
        assert bool(files) == bool(names), f"{term}: {names}"
