"""Mistakes as verifyta reports them: file, place, ``[error]`` and a sentence.

The place is the path of an element for XML (``/nta/template[1]/transition[2]/label[1]``) and the
line for other files. The engine gives line and column; the element is found by reading the file.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final
from xml.etree import ElementTree
from xml.parsers import expat

from ntagen.errors import NtagenError
from ntagen.files import MODEL_BYTES, read_file

_DIAGNOSTIC: Final = re.compile(
    r"^(?P<file>.*?):(?P<line>\d+):(?P<column>\d+): (?P<severity>error|warning)"
    r"(?:\[(?P<code>[A-Z]\d+)\])?: (?P<text>.*)$",
    re.MULTILINE,
)
_FAILURE: Final = re.compile(
    r"^(?P<text>.*), at (?P<file>.*?):(?P<line>\d+):(?P<column>\d+)\b[^:]*: (?P<at>.*)$",
    re.MULTILINE,
)
"""A run-time error of the model."""

_SYNTAX: Final = "E01"
"""The codes of syntax errors begin so."""

_NUMBERED: Final = frozenset(
    {"template", "location", "branchpoint", "transition", "label", "nail", "query", "instantiation"}
)
"""Elements of which there may be several beside each other."""


def reported(message: str, path: Path) -> list[str]:
    """The lines that report a mistake.

    Args:
        message: The engine's message: diagnostics with their places, or any text.
        path: The file that is named where the message names none.
    """
    found = list(_DIAGNOSTIC.finditer(message))
    failure = _FAILURE.match(message.removeprefix("error: "))
    if failure is not None and not found:
        file = Path(failure["file"])
        place = _place(file, int(failure["line"]), int(failure["column"]))
        return [f"{file}:{place}: [error] {_sentence(failure['text'])[:-1]}: {failure['at']}."]
    if not found:
        first = message.strip().partition("\n")[0].removeprefix("error: ")
        return [f"{path}: [error] {_sentence(first)}"]
    lines = []
    for one in found:
        file = Path(one["file"]) if one["file"] else path
        place = _place(file, int(one["line"]), int(one["column"]))
        kind = "syntax error: " if (one["code"] or "").startswith(_SYNTAX) else ""
        lines.append(f"{file}:{place}: [{one['severity']}] {kind}{_sentence(one['text'])}")
    return lines


def _sentence(text: str) -> str:
    return f"{text.strip().rstrip('.')}."


def _place(file: Path, line: int, column: int) -> str:
    """The element at a line and column of an XML file, or else the line."""
    data = _xml(file)
    return (data and element_at(data, line, column)) or str(line)


def _xml(file: Path) -> bytes | None:
    """An XML file; ``None`` if it is none, or cannot be read."""
    try:
        data = read_file(file, MODEL_BYTES)
    except (NtagenError, OSError):
        return None
    return data if data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<") else None


def places_of_queries(texts: Sequence[str], path: Path, *, in_model: bool) -> list[str]:
    """Where queries stand, in the words of "Verifying formula".

    Args:
        texts: The queries.
        path: Their file: the model, or a file of queries.
        in_model: Whether it is the model.
    """
    if in_model and (data := _xml(path)) is not None:
        formulas = [one.text or "" for one in ElementTree.fromstring(data).iter("formula")]
        filled = [number for number, text in enumerate(formulas, start=1) if text.strip()]
        # A query of another kind of element has no number of its own.
        numbers = filled if len(filled) == len(texts) else range(1, len(texts) + 1)
        return [f"/nta/queries/query[{number}]/formula" for number in numbers]
    content = read_file(path, MODEL_BYTES).decode("utf-8", "replace")
    places, position = [], 0
    for text in texts:
        found = content.find(text.strip().partition("\n")[0], position)
        position = position if found < 0 else found
        places.append(f"{path}:{content.count(chr(10), 0, position) + 1}")
        position += 0 if found < 0 else 1
    return places


def element_at(data: bytes, line: int, column: int) -> str | None:
    """The path of the innermost element that holds a place of an XML file.

    Args:
        data: The file.
        line: The line, from 1.
        column: The column, from 1, in characters.

    Returns:
        The path, or ``None`` if the file is not well-formed up to there.
    """
    parser = expat.ParserCreate()
    wanted = (line, column - 1)
    path: list[str] = []
    counts: list[dict[str, int]] = [{}]
    found: list[str] = []

    def here() -> tuple[int, int]:
        return parser.CurrentLineNumber, parser.CurrentColumnNumber

    def start(name: str, _attributes: dict[str, str]) -> None:
        if not found and here() > wanted:
            found.append("/" + "/".join(path))
        number = counts[-1].get(name, 0) + 1
        counts[-1][name] = number
        path.append(f"{name}[{number}]" if name in _NUMBERED else name)
        counts.append({})

    def end(_name: str) -> None:
        # What is missing at the end of a text is reported where the closing tag begins.
        if not found and here() >= wanted:
            found.append("/" + "/".join(path))
        path.pop()
        counts.pop()

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    try:
        parser.Parse(data, True)
    except expat.ExpatError:
        return None
    return found[0] if found else None
