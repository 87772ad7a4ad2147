"""Fills in the templates of ``templates/``, which have the text of the model.

Jinja compiles each template once a process, and keeps the result in the user's cache for later
ones. All names must be known: a misspelt one is an error, not an empty text. Values in XML are
escaped.
"""

from __future__ import annotations

import functools
import pickle
from contextlib import suppress
from pathlib import Path
from typing import Final

from jinja2 import Environment, FileSystemBytecodeCache, FileSystemLoader, StrictUndefined
from jinja2.bccache import Bucket

from ntagen.cache import cache_folder

FOLDER: Final = Path(__file__).parents[1] / "templates"
"""Where the templates are."""


def filled(template: str, **values: object) -> str:
    """The text that a template gives with these values.

    Args:
        template: Its path in `FOLDER`; the text is XML if it ends with ``.xml.jinja``.
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
        autoescape=lambda name: name is not None and name.endswith(".xml.jinja"),
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
