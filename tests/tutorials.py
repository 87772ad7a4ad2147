"""Runs what documents tell readers to type, and compares what they say comes out.

A document has three kinds of steps:

* "Save this as `NAME`:" before a block of code makes a file;
* a block `console` has commands after `$ `, each with the expected output below it. `…` in a line
  stands for any text, a line with only `…` for any number of lines. Every command ends with 0;
* the blocks `python` are one program.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
ANY = "…"
_BLOCK = re.compile(
    r"(?:[Ss]ave (?:this|it) as `(?P<name>[\w.-]+)`:\n\n)?"
    r"^```(?P<kind>\w+)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Step:
    """Something that a reader does.

    Attributes:
        kind: `file`, `command` or `python`.
        text: The contents, the command or the program.
        name: The name of the file.
        expected: The output of the command.
    """

    kind: str
    text: str
    name: str = ""
    expected: str = ""


def steps_of(document: str) -> Iterator[Step]:
    """The steps of a document in Markdown, in its order."""
    program = ""
    for block in _BLOCK.finditer(document):
        if block["name"]:
            yield Step("file", block["text"], block["name"])
        elif block["kind"] == "console":
            for part in re.split(r"^\$ ", block["text"], flags=re.MULTILINE)[1:]:
                command, _, expected = part.partition("\n")
                yield Step("command", command, expected=expected)
        elif block["kind"] == "python":
            program += block["text"]
    if program:
        yield Step("python", program)


def agrees(expected: str, said: str) -> bool:
    """Whether an output is what a document says, with `…` for anything."""
    pattern = ""
    for line in expected.rstrip().splitlines():
        if line.strip() == ANY:
            pattern += r"(?:.*\n)*"
        else:
            pattern += ".*".join(re.escape(part) for part in line.rstrip().split(ANY)) + r"[ ]*\n"
    return re.fullmatch(pattern, said.rstrip() + "\n") is not None


def follow(document: str, folder: Path) -> Iterator[str]:
    """Does what a document says in a folder.

    Yields:
        What differs from what the document says.
    """
    (folder / "examples").symlink_to(ROOT / "examples")
    for step in steps_of(document):
        if step.kind == "file":
            (folder / step.name).write_text(step.text, "utf-8")
            continue
        command = [sys.executable, "-c", step.text]
        if step.kind == "command":
            command = [
                "bash",
                "-c",
                f'ntagen() {{ "{sys.executable}" -m ntagen "$@"; }}; {step.text}',
            ]
        ended = subprocess.run(
            command,
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1", "COLUMNS": "120"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=300.0,
            check=False,
        )
        if ended.returncode != 0:
            yield f"$ {step.text}\nended with {ended.returncode}:\n{ended.stdout}"
        elif step.kind == "command" and not agrees(step.expected, ended.stdout):
            yield f"$ {step.text}\nexpected:\n{step.expected}\nsaid:\n{ended.stdout}"
