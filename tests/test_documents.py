"""What documents link to and name is there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = [
    path
    for path in [
        ROOT / "README.md",
        ROOT / "CONTRIBUTING.md",
        ROOT / "checker" / "ARCHITECTURE.md",
        ROOT / "tests" / "README.md",
        *sorted((ROOT / "docs").glob("**/*.md")),
    ]
    if path.is_file()
]
BASES = ["", "checker", "checker/src", "checker/tests", "ntagen", "tests", "tests/corpus"]
"""The folders from which documents name files, beside their own."""

SUFFIXES = {".css", ".lock", ".md", ".nsl", ".py", ".pyi", ".q", ".rs", ".toml", ".xml", ".xta"}
"""What ends like this, written as code, is the name of a file."""

MADE = {"demo", "target", "build", "dist"}
"""Folders that commands make."""

FENCED = re.compile(r"^( *)(```|~~~).*?^\1\2", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\(([^()\s]+)\)")
CODE = re.compile(r"`([^`\n]+)`")
PATH = re.compile(r"[\w.-]+(/[\w.-]+)*/?")
SAVED = re.compile(r"[Ss]ave (?:this|it) as `([^`]+)`:")
"""Files that a reader makes."""

HEADING = re.compile(r"^#+ +(.+?) *$", re.MULTILINE)


def prose(document: Path) -> str:
    """The text without its blocks of code."""
    return FENCED.sub("", document.read_text("utf-8"))


def anchors(document: Path) -> set[str]:
    """The names by which links lead to headings, as GitHub makes them."""
    titles = [re.sub(r"[`*]", "", title).lower() for title in HEADING.findall(prose(document))]
    return {re.sub(r"[^\w\- ]", "", title).replace(" ", "-") for title in titles}


def broken_links(document: Path) -> Iterator[str]:
    for link in LINK.findall(prose(document)):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = document.parent / name if name else document
        is_markdown = target.suffix == ".md"
        if not target.exists() or (anchor and is_markdown and anchor not in anchors(target)):
            yield link


def names(document: Path) -> set[str]:
    """What is written as code and may be a path."""
    words = {word for span in CODE.findall(prose(document)) for word in span.split()}
    made = set(SAVED.findall(document.read_text("utf-8")))
    return {word for word in words - made if PATH.fullmatch(word)}


@pytest.fixture(scope="module")
def files() -> set[str]:
    """The names of all files, without their folders."""
    deep = (
        "checker/src",
        "checker/tests",
        "checker/benches",
        "docs",
        "examples",
        "ntagen",
        "tests",
    )
    paths = [path for folder in deep for path in (ROOT / folder).rglob("*")]
    return {path.name for path in [*paths, *ROOT.iterdir(), *(ROOT / "checker").iterdir()]}


def missing_names(document: Path, files: set[str]) -> Iterator[str]:
    bases = [document.parent, *(ROOT / base for base in BASES)]
    for name in sorted(names(document)):
        first, slash, _ = name.partition("/")
        if not slash:
            is_missing = Path(name).suffix in SUFFIXES and name not in files
        else:
            # Units have strokes too, but begin with the name of no folder.
            is_here = any((base / first).is_dir() for base in bases)
            is_path = first not in MADE and (is_here or Path(name).suffix in SUFFIXES)
            is_missing = is_path and not any((base / name).exists() for base in bases)
        if is_missing:
            yield name


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_links_lead_somewhere(document: Path) -> None:
    assert list(broken_links(document)) == []


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_and_folders_that_are_named_are_there(document: Path, files: set[str]) -> None:
    assert list(missing_names(document, files)) == []


@pytest.mark.parametrize("name", ["match.txt", "virtual.md", "real.md"])
def test_tables_in_the_readme_are_those_that_commands_wrote(name: str) -> None:
    text = (ROOT / "examples" / "experiments" / "tables" / name).read_text("utf-8")
    lines = [line.rstrip() for line in text.splitlines()]
    if name.endswith(".md"):
        lines = [line for line in lines if line.startswith("|")]
    lines = [line for line in lines if line and not line.startswith("wrote ")]
    assert len(lines) > 5
    assert "\n".join(lines) in (ROOT / "README.md").read_text("utf-8")
