"""The Jinja environment of the templates: unknown names are errors, XML files are escaped."""

from __future__ import annotations

import contextlib
import functools

import jinja2
from jinja2.bccache import Bucket

from ntagen.cache import cache_folder


class _CompiledTemplates(jinja2.FileSystemBytecodeCache):
    """Templates from earlier runs; compiling them takes longer than the rest of rendering.

    Jinja compares a digest of the template's text, and ignores an entry that does not fit.
    """

    def dump_bytecode(self, bucket: Bucket) -> None:
        # A full or read-only disk only makes rendering slower.
        with contextlib.suppress(OSError):
            super().dump_bytecode(bucket)


@functools.cache
def environment() -> jinja2.Environment:
    """The environment with the package's templates.

    An unknown name is an error. Values in ``*.xml.jinja`` are escaped for XML, so that guards can
    be given as they are (``a < b && c``). The C declaration is escaped as a whole when it is put
    into the XML.
    """
    folder = cache_folder()
    return jinja2.Environment(
        loader=jinja2.PackageLoader("ntagen"),
        undefined=jinja2.StrictUndefined,
        autoescape=lambda name: name is not None and name.endswith(".xml.jinja"),
        keep_trailing_newline=True,
        bytecode_cache=None if folder is None else _CompiledTemplates(str(folder)),
    )
