"""Runs what documents tell readers to type, and compares what they say comes out.

A document has these kinds of steps:

* "Save this as `NAME`:" before a block of code makes a file;
* a block `console` has commands after `$ `, each with the expected output below it. `…` in a line
  stands for any text, a line with only `…` for any number of lines. Every command ends with 0;
* an indented line that begins with `ntagen` or `cp` is a command too, which may say anything, but
  for those that `NOT_HERE` names: what a reader has and a test has not;
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
NOT_HERE = {
    "hardware, or a server": r"/dev/|localhost:|tcp://|mystage:|mytracker:",
    "a file of the reader": (
        r"\b(?:model\.xml|gate\.xml|task\.nsl|FILE\.toml|[Tt]rial\*|paper\.nsl run\.mcap)"
    ),
    "what another page made": r"demo/\{",
    "runs until Ctrl-C": r"device simulate",
    "ROS 2": r"\bntagen ros\b|rosbag2_",
    "takes minutes": r"--runs 200|real\.toml",
}
"""Why a command cannot be run by a test, with a pattern of such commands."""

_BLOCK = re.compile(
    r"(?:[Ss]ave (?:this|it) as `(?P<name>[\w.-]+)`:\n\n)?"
    r"^```(?P<kind>\w+)\n(?P<text>.*?)^```$"
    r"|^ {4}(?P<line>(?:\w+=\S+ )?(?:ntagen|cp) (?:[^\n]*\\\n)*[^\n]*)$",
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
            for command, expected in commands_of(block["text"]):
                yield Step("command", command, expected=expected)
        elif block["line"] and not any(re.search(one, block["line"]) for one in NOT_HERE.values()):
            yield Step("command", block["line"], expected=ANY)
        elif block["kind"] == "python":
            program += block["text"]
    if program:
        yield Step("python", program)


def commands_of(console: str) -> Iterator[tuple[str, str]]:
    """The commands of a block `console`, each with what it prints."""
    for part in re.split(r"^\$ ", console, flags=re.MULTILINE)[1:]:
        command, _, printed = part.partition("\n")
        yield command, printed


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
    for name in ("examples", "tests"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "demo").mkdir()
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
            stdin=subprocess.DEVNULL,
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
