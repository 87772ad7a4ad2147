"""What the README and the tutorials tell readers to type works, and gives what they say."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.tutorials import ROOT, agrees, follow, steps_of

PAGES = (
    "adversary",
    "anatomy",
    "building",
    "matching",
    "models",
    "moving",
    "pictures",
    "steering",
    "steppers",
)
TUTORIALS = [
    ROOT / "README.md",
    *(ROOT / "docs" / f"{name}.md" for name in PAGES),
    *sorted((ROOT / "docs" / "tutorials").glob("[!i]*.md")),
]


@pytest.mark.slow
@pytest.mark.parametrize("tutorial", TUTORIALS, ids=lambda path: path.stem)
def test_a_tutorial_works_as_typed(tutorial: Path, tmp_path: Path) -> None:
    assert "\n".join(follow(tutorial.read_text("utf-8"), tmp_path)) == ""


def test_steps_are_files_commands_and_one_program() -> None:
    text = (
        "Save this as `a.txt`:\n\n```text\nhello\n```\n\n"
        "```console\n$ cat a.txt\nhello\n$ true\n```\n"
        "```python\nx = 1\n```\ntext\n```python\nassert x == 1\n```\n"
    )
    found = [(step.kind, step.name, step.text, step.expected) for step in steps_of(text)]
    assert found == [
        ("file", "a.txt", "hello\n", ""),
        ("command", "", "cat a.txt", "hello\n"),
        ("command", "", "true", ""),
        ("python", "", "x = 1\nassert x == 1\n", ""),
    ]


@pytest.mark.parametrize(
    ("expected", "said", "is_equal"),
    [
        ("a … c\n", "a b c\n", True),
        ("a … c\n", "a b d\n", False),
        ("…\nend\n", "1\n2\nend\n", True),
        ("…\nend\n", "1\nend\n2\n", False),
        ("a.c\n", "abc\n", False),
    ],
)
def test_dots_stand_for_any_text(expected: str, said: str, is_equal: bool) -> None:
    assert agrees(expected, said) is is_equal


def test_what_differs_is_told(tmp_path: Path) -> None:
    text = "```console\n$ echo a\nb\n$ false\n```\n```python\nraise SystemExit('no')\n```\n"
    first, second, third = follow(text, tmp_path)
    assert first == "$ echo a\nexpected:\nb\n\nsaid:\na\n"
    assert "ended with 1" in second
    assert "no" in third
