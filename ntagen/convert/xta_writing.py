"""Writes the parts of a model as XTA.

XTA has no room for where things are drawn, nor for settings of other tools; comments of locations
and edges become comments of the text. A location without a name gets one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from ntagen.build import BranchPoint, Edge, Location, Model, Template
from ntagen.convert.names import Names

_LABELS: Final = {
    "select": "select",
    "guard": "guard",
    "sync": "sync",
    "update": "assign",
    "weight": "probability",
}


def written_xta(model: Model) -> str:
    """The text of a model in XTA; its queries are not in it."""
    pieces = [model.declarations.strip()]
    pieces += ["\n".join(_template(one)) for one in model.templates]
    pieces += [model.instantiations.strip(), model.system.strip()]
    return "\n\n".join(one for one in pieces if one) + "\n"


def left_out(model: Model) -> list[str]:
    """What of a model XTA cannot hold and no engine reads: settings of other tools, a line each."""
    found = []
    for template in model.templates:
        held: list[Location | BranchPoint | Edge] = [*template.nodes, *template.edges]
        for part in held:
            extra = [one for one in part.extra if not one.startswith("<!--")]
            if extra:
                place = f"template {template.name}, {part.shown_name}"
                found.append(f"{place}: {' '.join(extra[0].split())[:60]}")
    return found


def _template(template: Template) -> Iterator[str]:
    names = _node_names(template)
    yield f"process {template.name}({template.parameters.strip()}) {{"
    if template.declarations.strip():
        yield template.declarations.strip("\n")
    yield "state"
    yield from _listed(_location(one, names[id(one)]) for one in template.locations)
    for word, attribute in (("commit", "committed"), ("urgent", "urgent")):
        marked = [names[id(one)] for one in template.locations if getattr(one, attribute)]
        if marked:
            yield f"{word} {', '.join(marked)};"
    if template.branch_points:
        yield f"branchpoint {', '.join(names[id(one)] for one in template.branch_points)};"
    yield f"init {names[id(template.initial)]};"
    if template.edges:
        yield "trans"
        yield from _listed(_edge(one, names) for one in template.edges)
    yield "}"


def _node_names(template: Template) -> dict[int, str]:
    """The names of locations and branch points, by their identity."""
    given = [one.name for one in template.locations if one.name]
    words = re.findall(r"[A-Za-z_]\w*", f"{template.declarations} {template.parameters}")
    fresh = Names([*given, *words])
    found = {id(one): one.name for one in template.locations if one.name}
    for node in template.nodes:
        if id(node) not in found:
            found[id(node)] = fresh.fresh(node.id)
    return found


def _listed(items: Iterator[str]) -> Iterator[str]:
    """A list with commas and a semicolon, an item a line."""
    held = list(items)
    for number, one in enumerate(held, 1):
        yield f"    {one}{',' if number < len(held) else ';'}"


def _location(location: Location, name: str) -> str:
    parts = [location.invariant.strip()]
    if location.rate.strip():
        parts.append(location.rate.strip())
    inner = "; ".join(parts)
    return f"{_comment(location)}{name}{f' {{ {inner} }}' if inner else ''}"


def _edge(edge: Edge, names: dict[int, str]) -> str:
    arrow = "->" if edge.controllable else "-u->"
    labels = [
        f"{word} {text};"
        for attribute, word in _LABELS.items()
        if (text := getattr(edge, attribute).strip())
    ]
    ends = f"{names[id(edge.source)]} {arrow} {names[id(edge.target)]}"
    return f"{_comment(edge)}{ends} {{ {' '.join(labels)}{' ' if labels else ''}}}"


def _comment(part: Location | Edge | BranchPoint) -> str:
    """What stands before a part that has a comment in the editor."""
    comment = getattr(part, "comment", "").strip().replace("*/", "* /")
    return f"/* {comment} */ " if comment else ""
