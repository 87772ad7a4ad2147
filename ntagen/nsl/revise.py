"""Writes other values into the text of an environment file, and leaves all else as it is.

Comments, layout and other statements stay byte for byte. A value that is written with constants or
as an expression is replaced whole.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Final

from ntagen.errors import InputError
from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter, SourceError
from ntagen.nsl.lexer import tokenise
from ntagen.nsl.parser import parse
from ntagen.nsl.source import Source
from ntagen.nsl.tokens import Token

_INDENT: Final = "  "
_MARK: Final = "\ufeff"


def revised(text: str, path: str, needle: Mapping[str, str], drive: Mapping[str, str]) -> str:
    """The text with other values.

    Args:
        text: The text of the file.
        path: The file, for messages.
        needle: Values of properties in `needle { … }`, by their words; the file must have such
            braces. A property that is not there is added behind the first one.
        drive: Values of settings in `drive { … }`, by their words. Braces that are not there are
            added behind those of the needle.

    Raises:
        SourceError: The text has mistakes.
        InputError: The needle is not described in this file.
    """
    mark = _MARK if text.startswith(_MARK) else ""
    source, reporter = Source(path, text.removeprefix(_MARK)), Reporter()
    reporter.enter(path)
    file = parse(source, reporter)
    if reporter.diagnostics:
        raise SourceError(reporter.diagnostics)
    sections: dict[str, tree.Section] = {one.keyword: one for one in _sections(file.statements)}
    if "needle" not in sections:
        raise InputError(
            f"{path}: there is no needle {{ … }} in this file\n"
            "hint: name the file in which the needle is described"
        )
    changes = list(_needle_changes(sections["needle"], needle))
    if drive:
        changes += _drive_changes(source, sections, drive)
    return mark + _with(source.text, changes)


_Change = tuple[int, int, str]
"""The characters from an offset up to another one become this text."""


def _with(text: str, changes: list[_Change]) -> str:
    for start, end, new in sorted(changes, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def _sections(statements: tuple[tree.Statement, ...]) -> Iterator[tree.Section]:
    """The sections of a file, those of its environment too."""
    for one in statements:
        if isinstance(one, tree.Section):
            yield one
        elif isinstance(one, tree.Environment):
            yield from _sections(one.body)


def _needle_changes(section: tree.Section, values: Mapping[str, str]) -> Iterator[_Change]:
    found = {one.keyword: one for one in section.body if isinstance(one, tree.Setting)}
    for keyword, value in values.items():
        if keyword in found:
            span = found[keyword].value.span
            yield span.start, span.end, value
        elif found:
            # The order of properties says nothing.
            end = next(iter(found.values())).span.end
            yield end, end, f"  {keyword} {value}"


def _drive_changes(
    source: Source, sections: Mapping[str, tree.Section], values: Mapping[str, str]
) -> list[_Change]:
    text = source.text
    newline = "\r\n" if "\r\n" in text else "\n"
    indent = _indent_of(text, sections["needle"].span.start)
    if "drive" not in sections:
        end = _braces(source, sections["needle"])[1] + 1
        said = "".join(f"{newline}{indent}{_INDENT}{words} {one}" for words, one in values.items())
        return [(end, end, f"{newline}{newline}{indent}drive {{{said}{newline}{indent}}}")]
    section = sections["drive"]
    found = {one.keyword: one for one in section.body if isinstance(one, tree.Parameter)}
    changes: list[_Change] = []
    for words, value in values.items():
        if words in found:
            start, end = found[words].values[0].span.start, found[words].values[-1].span.end
            changes.append((start, end, value))
        else:
            at, end = (offset + 1 for offset in _braces(source, section))
            new = f" {words} {value} "
            if "\n" in text[at:end]:
                indent = _indent_of(text, section.span.start) + _INDENT
                new = f"{newline}{indent}{words} {value}"
            changes.append((at, at, new))
    return changes


def _indent_of(text: str, at: int) -> str:
    """The white space at the beginning of the line of a statement; none if it is not the first."""
    before = text[text.rfind("\n", 0, at) + 1 : at]
    return "" if before.strip() else before


def _braces(source: Source, section: tree.Section) -> tuple[int, int]:
    """The offsets of the braces of a section; there are no others in it."""
    found = [
        item.span.start
        for item in tokenise(source, "file")
        if isinstance(item, Token) and item.type == "BRACE" and item.span.start >= section.span.end
    ]
    return found[0], found[1]
