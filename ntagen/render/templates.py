"""The Jinja environment of the templates: strict about names, escaping by kind of file."""

from __future__ import annotations

import functools

import jinja2


@functools.cache
def environment() -> jinja2.Environment:
    """The environment with the package's templates.

    An unknown name is an error. What is put into ``*.xml.jinja`` is escaped for XML, so that guards
    may be written as they are (``a < b && c``); the C declaration is escaped as a whole where the
    XML takes it in.
    """
    return jinja2.Environment(
        loader=jinja2.PackageLoader("ntagen"),
        undefined=jinja2.StrictUndefined,
        autoescape=lambda name: name is not None and name.endswith(".xml.jinja"),
        keep_trailing_newline=True,
    )
