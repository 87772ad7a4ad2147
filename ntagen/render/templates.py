"""The Jinja environment of the templates: strict about names, escaping by kind of file."""

from __future__ import annotations

import contextlib
import functools

import jinja2
from jinja2.bccache import Bucket

from ntagen.cache import cache_folder


class _CompiledTemplates(jinja2.FileSystemBytecodeCache):
    """Templates compiled in earlier runs; compiling takes longer than all else that rendering does.

    Jinja compares a digest of the template's text and drops what does not fit.
    """

    def dump_bytecode(self, bucket: Bucket) -> None:
        # A full or read-only disk costs time, not the result.
        with contextlib.suppress(OSError):
            super().dump_bytecode(bucket)


@functools.cache
def environment() -> jinja2.Environment:
    """The environment with the package's templates.

    An unknown name is an error. What is put into ``*.xml.jinja`` is escaped for XML, so that guards
    may be written as they are (``a < b && c``); the C declaration is escaped as a whole where the
    XML takes it in.
    """
    folder = cache_folder()
    return jinja2.Environment(
        loader=jinja2.PackageLoader("ntagen"),
        undefined=jinja2.StrictUndefined,
        autoescape=lambda name: name is not None and name.endswith(".xml.jinja"),
        keep_trailing_newline=True,
        bytecode_cache=None if folder is None else _CompiledTemplates(str(folder)),
    )
