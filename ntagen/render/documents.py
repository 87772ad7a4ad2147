"""Puts the documents of models together from the templates.

Jinja compiles each template of ``templates/`` once a process, and keeps the result in the user's
cache for later ones. All names must be known: a misspelt one is an error, not an empty text. Values
in XML are escaped.

The automata depend on few properties of a scene, and they are most of a document. So each kind of
them is written once a process; a driver writes a document for each question.
"""

from __future__ import annotations

import functools
import pickle
from collections.abc import Sequence
from contextlib import suppress
from html import escape
from pathlib import Path
from typing import Final

from jinja2 import Environment, FileSystemBytecodeCache, FileSystemLoader, StrictUndefined
from jinja2.bccache import Bucket
from markupsafe import Markup

from ntagen.cache import cache_folder
from ntagen.render.queries import Query
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


def policy_document(values: ModelValues) -> str:
    """The document in which a policy is learned; see `model_document`."""
    return filled("policy.xml.jinja", declaration=_declaration(values, None))


def _declaration(values: ModelValues, source: str | None) -> Markup:
    """The declaration of a model; quotes need no escape between two tags."""
    text = filled("uppaal/declarations.c.jinja", model=values, source=source)
    return Markup(escape(text, quote=False))


@functools.cache
def _automata(features: Features) -> Markup:
    return Markup(filled("uppaal/automata.xml.jinja", model=features))


FOLDER: Final = Path(__file__).parents[1] / "templates"
"""Where the templates are."""

_ESCAPED: Final = (".xml.jinja", ".html.jinja")


def filled(template: str, **values: object) -> str:
    """The text that a template gives with these values.

    Args:
        template: Its path in `FOLDER`; the text is XML if it ends with ``.xml.jinja``, and HTML if
            it ends with ``.html.jinja``.
        values: What it is given, by name.

    Raises:
        jinja2.UndefinedError: The template uses a name or an attribute that is not there.
    """
    return _environment().get_template(template).render(values)


@functools.cache
def _environment() -> Environment:
    folder = cache_folder()
    return Environment(
        loader=FileSystemLoader(FOLDER),
        undefined=StrictUndefined,
        autoescape=lambda name: name is not None and name.endswith(_ESCAPED),
        keep_trailing_newline=True,
        # The templates of an installed program do not change while it runs.
        auto_reload=False,
        bytecode_cache=None if folder is None else _Compiled(str(folder)),
    )


class _Compiled(FileSystemBytecodeCache):
    """Compiled templates on disk. Where nothing can be read or written, there are none."""

    def load_bytecode(self, bucket: Bucket) -> None:
        try:
            super().load_bytecode(bucket)
        except (OSError, pickle.UnpicklingError):
            bucket.reset()

    def dump_bytecode(self, bucket: Bucket) -> None:
        with suppress(OSError):
            super().dump_bytecode(bucket)
