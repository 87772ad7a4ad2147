"""Writes the templates of a model for Graphviz, each as a cluster."""

from __future__ import annotations

from collections.abc import Iterator

from ntagen.build import Edge, Location, Model, Template


def written_dot(model: Model, name: str) -> str:
    """The templates of a model as one graph in the language of ``dot``."""
    return "".join(f"{line}\n" for line in _lines(model, name))


def _lines(model: Model, name: str) -> Iterator[str]:
    yield f"digraph {_quoted(name)} {{"
    yield '  graph [fontname="Helvetica", labeljust=l, compound=true];'
    yield '  node [fontname="Helvetica", shape=circle, margin=0.05];'
    yield '  edge [fontname="Helvetica", fontsize=10];'
    for number, template in enumerate(model.templates):
        yield f"  subgraph cluster_{number} {{"
        parameters = f"({template.parameters.strip()})" if template.parameters.strip() else ""
        yield f"    label={_quoted(template.name + parameters)};"
        ids = {id(one): f"t{number}_{i}" for i, one in enumerate(template.nodes)}
        for location in template.locations:
            yield f"    {ids[id(location)]} [{_location(location, template)}];"
        for point in template.branch_points:
            yield f'    {ids[id(point)]} [shape=point, label=""];'
        for edge in template.edges:
            ends = f"{ids[id(edge.source)]} -> {ids[id(edge.target)]}"
            yield f"    {ends} [{_edge(edge)}];"
        yield "  }"
    yield "}"


def _location(location: Location, template: Template) -> str:
    mark = "C" if location.committed else "U" if location.urgent else ""
    lines = [mark, location.shown_name, location.invariant.strip()]
    if location.rate.strip():
        lines.append(f"rate {location.rate.strip()}")
    found = f"label={_quoted(*lines)}"
    # As in UPPAAL's editor, the first location has two lines around it.
    return f"{found}, shape=doublecircle" if location is template.initial else found


def _edge(edge: Edge) -> str:
    texts = (edge.select, edge.guard, edge.sync, edge.update, edge.weight)
    found = f"label={_quoted(*(one.strip() for one in texts))}"
    return found if edge.controllable else f"{found}, style=dashed"


def _quoted(*lines: str) -> str:
    """A text in quotes; empty lines are left out."""
    escaped = (one.replace("\\", "\\\\").replace('"', '\\"') for one in lines if one)
    return '"' + "\\n".join(one.replace("\n", "\\n") for one in escaped) + '"'
