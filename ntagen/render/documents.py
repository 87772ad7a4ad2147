"""Puts the documents of models together from the templates.

The automata depend on few properties of a scene, and they are most of a document. So each kind of
them is written once a process; a driver writes a document for each question.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from html import escape

from markupsafe import Markup

from ntagen.render.queries import Query
from ntagen.render.templates import filled
from ntagen.render.values import Features, ModelValues


def model_document(values: ModelValues, source: str | None, queries: Sequence[Query]) -> str:
    """The document of the timed game.

    Args:
        values: The values of the scene.
        source: The file of the scene, in one line.
        queries: What the document asks.
    """
    declaration, automata = _declaration(values, source), _automata(values.features)
    return filled("model.xml.jinja", declaration=declaration, automata=automata, queries=queries)


def plan_document(values: ModelValues, queries: Sequence[Query]) -> str:
    """The document of one plan in a tissue with chance; see `model_document`."""
    return filled("plan.xml.jinja", declaration=_declaration(values, None), queries=queries)


def _declaration(values: ModelValues, source: str | None) -> Markup:
    """The declaration of a model; quotes need no escape between two tags."""
    text = filled("uppaal/declarations.c.jinja", model=values, source=source)
    return Markup(escape(text, quote=False))


@functools.cache
def _automata(features: Features) -> Markup:
    return Markup(filled("uppaal/automata.xml.jinja", model=features))
