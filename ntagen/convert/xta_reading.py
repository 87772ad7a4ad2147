"""Reads XTA into the parts of a model (`ntagen.build`).

Declarations and labels are kept as texts, comments included: only brackets, commas and semicolons
are looked at. The engine has accepted the text before, so what stands where is known. The rules
are those of `checker/src/syntax/processes.rs`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from ntagen.build import BranchPoint, Location, Model, Template
from ntagen.values import dataclass

_TOKEN: Final = re.compile(
    r"(?P<blank>\s+|//[^\n]*|/\*.*?\*/)|(?P<text>\"[^\"]*\")|(?P<word>[A-Za-z_]\w*|\d[\w.]*)|"
    r"(?P<sign>-u->|->|:=|.)",
    re.DOTALL,
)
_OPEN: Final = ("{", "(", "[")
_CLOSED: Final = ("}", ")", "]")
_LABELS: Final = {
    "select": "select",
    "guard": "guard",
    "sync": "sync",
    "assign": "update",
    "probability": "weight",
}
_BLOCKS: Final = ("before_update", "after_update", "progress", "gantt", "IO", "query", "process")


@dataclass(frozen=True, slots=True)
class _Token:
    """A word or sign with its place in the text."""

    word: str
    start: int
    end: int


@dataclass(frozen=True, slots=True)
class _Statement:
    """A statement outside processes: its tokens, and where its text begins, comments included."""

    tokens: list[_Token]
    start: int

    @property
    def word(self) -> str:
        return self.tokens[0].word

    @property
    def is_instantiation(self) -> bool:
        """Whether it is ``P = …`` or ``P(…) = …``."""
        signs = [one.word for one in self.tokens[1:]]
        return signs[:1] in (["="], [":="], ["("]) and self.word.isidentifier()


def parse_xta(text: str) -> Model:
    """The model of an XTA text that the engine has accepted; queries in it come along."""
    text = text.removeprefix("\ufeff")
    tokens = [
        _Token(match[0], match.start(), match.end())
        for match in _TOKEN.finditer(text)
        if match.lastgroup != "blank"
    ]
    statements = list(_statements(tokens))
    model = Model()
    last_process = max((i for i, one in enumerate(statements) if one.word == "process"), default=-1)
    has_instances = False
    kept: dict[str, list[str]] = {"declarations": [], "system": []}
    for number, one in enumerate(statements):
        source = text[one.start : one.tokens[-1].end]
        if one.word == "process":
            head = one.tokens[0].start
            if comment := text[one.start : head].strip():
                kept["declarations"].append(f"\n{comment}")
            model.templates.append(_template(text, one.tokens))
        elif one.word == "query":
            model.query(" ".join(text[one.tokens[1].end : one.tokens[-1].start].split()))
        else:
            has_instances = has_instances or one.is_instantiation or one.word == "system"
            is_late = has_instances and (number > last_process or one.is_instantiation)
            kept["system" if is_late else "declarations"].append(source)
    if rest := text[statements[-1].tokens[-1].end :].strip():
        kept["system"].append(f"\n{rest}")
    model.declarations, model.system = ("".join(one).strip() for one in kept.values())
    return model


def _statements(tokens: list[_Token]) -> Iterator[_Statement]:
    """The declarations, processes and other statements outside processes."""
    first, start = 0, 0
    while first < len(tokens):
        last = _end_of_statement(tokens, first)
        yield _Statement(tokens[first : last + 1], start)
        start, first = tokens[last].end, last + 1


def _end_of_statement(tokens: list[_Token], first: int) -> int:
    depth, is_block = 0, tokens[first].word in _BLOCKS
    for place in range(first, len(tokens)):
        word = tokens[place].word
        if word == "{" and depth == 0 and tokens[place - 1].word == ")":
            is_block = True  # the body of a function
        depth += (word in _OPEN) - (word in _CLOSED)
        if depth == 0 and (word == ";" or (word == "}" and is_block)):
            return place
    return len(tokens) - 1


def _template(text: str, tokens: list[_Token]) -> Template:
    """The template of a process definition."""
    opening = next(i for i, one in enumerate(tokens) if one.word == "{")
    template = Template(tokens[1].word)
    if tokens[2].word == "(":
        template.parameters = text[tokens[2].end : tokens[opening - 1].start].strip()
    body = tokens[opening + 1 : -1]
    parts = list(_statements(body))
    structure = next(i for i, one in enumerate(parts) if one.word == "state")
    if structure:
        end = parts[structure - 1].tokens[-1].end
        template.declarations = text[tokens[opening].end : end].strip("\n")
    nodes: dict[str, Location | BranchPoint] = {}
    for part in parts[structure:]:
        inner = part.tokens[1:-1] if part.tokens[-1].word == ";" else part.tokens[1:]
        items = _split(inner, ",")
        if part.word == "state":
            nodes |= {item[0].word: _location(text, template, item) for item in items}
        elif part.word == "branchpoint":
            for item in items:
                point = template.branch_point()
                point.id = item[0].word
                nodes[point.id] = point
        elif part.word == "trans":
            _edges(text, template, nodes, items)
        elif part.word == "init":
            template.initial = template[inner[0].word]
        else:
            for item in items:
                setattr(
                    nodes[item[0].word], "committed" if part.word == "commit" else "urgent", True
                )
    return template


def _location(text: str, template: Template, item: list[_Token]) -> Location:
    location = template.location(item[0].word)
    if len(item) > 1:
        parts = _split(item[2:-1], ";")
        location.invariant = _text(text, parts[0])
        location.rate = _text(text, parts[1]) if len(parts) > 1 else ""
    return location


def _edges(
    text: str,
    template: Template,
    nodes: dict[str, Location | BranchPoint],
    items: list[list[_Token]],
) -> None:
    """The edges of one list; one that begins with an arrow leaves where the edge before it does."""
    source = ""
    for item in items:
        words = [one.word for one in item[:3]]
        if words[0] in ("->", "-u->"):
            item = [item[0], *item]
            words = [source, *words]
        source = words[0]
        edge = template.edge(nodes[source], nodes[item[2].word])
        edge.controllable = item[1].word == "->"
        for label in _split(item[4:-1], ";"):
            if label:
                setattr(edge, _LABELS[label[0].word], _text(text, label[1:]))


def _split(tokens: list[_Token], sign: str) -> list[list[_Token]]:
    """The tokens between the signs outside brackets."""
    found: list[list[_Token]] = [[]]
    depth = 0
    for one in tokens:
        depth += (one.word in _OPEN) - (one.word in _CLOSED)
        if one.word == sign and depth == 0:
            found.append([])
        else:
            found[-1].append(one)
    return found


def _text(text: str, tokens: list[_Token]) -> str:
    return text[tokens[0].start : tokens[-1].end] if tokens else ""
