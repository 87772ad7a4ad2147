"""Reads files as text: the only module of the language that touches the disk."""

from __future__ import annotations

import errno
import os
from collections.abc import Sequence

from ntagen.files import read_file
from ntagen.nsl.diagnostics import Reporter, did_you_mean
from ntagen.nsl.source import MAX_SOURCE_BYTES, Source, Span
from ntagen.values import dataclass


def read_source(path: str, reporter: Reporter, included_at: Span | None = None) -> Source | None:
    """The text of a file.

    Args:
        path: The file.
        reporter: Collects the reasons why a file cannot be read.
        included_at: The path in the include statement, which is the place of the diagnostic.

    Returns:
        The text, or None after a mistake.
    """
    report = _Report(path, reporter, included_at)
    try:
        data = read_file(path, MAX_SOURCE_BYTES)
    except FileNotFoundError:
        report("file-missing", "there is no such file", _nearby(path))
        return None
    except IsADirectoryError:
        report("file-unreadable", "it is a folder", "name a file in it")
        return None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        if isinstance(error, OSError) and error.errno == errno.EFBIG:
            report("file-too-large", reason)
        else:
            report("file-unreadable", f"the file cannot be read: {reason.lower()}")
        return None
    return _decoded(path, data, report)


def decode_source(path: str, data: bytes, reporter: Reporter) -> Source | None:
    """The text of a file that was read already; `path` is its name."""
    return _decoded(path, data, _Report(path, reporter, None))


@dataclass(frozen=True, slots=True)
class _Report:
    """Reports why a file cannot be read, at the include statement if there is one."""

    path: str
    reporter: Reporter
    included_at: Span | None

    def __call__(self, name: str, message: str, hint: str | None = None) -> None:
        """Reports one defect."""
        if self.included_at is None:
            self.reporter.report_file(name, self.path, message, hint=hint)
        else:
            message = f"cannot include `{self.path}`: {message}"
            self.reporter.report(name, self.included_at, message, hint=hint)


def _decoded(path: str, data: bytes, report: _Report) -> Source | None:
    """The text in some bytes, if they are text."""
    if len(data) > MAX_SOURCE_BYTES:
        report("file-too-large", f"the file has more than {MAX_SOURCE_BYTES // 2**20} MiB")
        return None
    if b"\0" in data:
        report("file-not-text", "the file is not text", "an environment is a text file in UTF-8")
        return None
    try:
        return Source(path, data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        report(
            "file-not-utf-8",
            f"byte 0x{data[error.start]:02x} in line {line} is not UTF-8",
            "save the file in the encoding UTF-8",
        )
        return None


def _nearby(path: str) -> str | None:
    """A hint with the most similar file name in the folder."""
    parent, name = os.path.split(path)
    try:
        names = sorted(entry for entry in os.listdir(parent or ".") if entry.endswith(".nsl"))
    except (OSError, ValueError):
        return None
    return did_you_mean(name, names, cutoff=0.75)


def located(
    named: str, span: Span, folders: Sequence[str], reporter: Reporter, does: str
) -> tuple[str, str] | None:
    """The path of a file that is named at a place, and where its links lead.

    Args:
        named: The path as it is written; it begins at the folder of the text.
        span: Where it is written.
        folders: Folders below which the file may lie.
        reporter: Collects the mistakes.
        does: What is done with the file, for messages.

    Returns:
        Both paths, or None after a mistake.
    """
    path = os.path.join(os.path.dirname(span.source.path), named)
    try:
        key = os.path.realpath(path)
    except ValueError as error:
        # No file can have such a name, but a text that is not from a file may contain it.
        reporter.report("file-unreadable", span, f"cannot {does} `{path}`: {error}")
        return None
    if any(_is_below(key, folder) for folder in folders):
        return path, key
    reporter.report(
        "include-outside",
        span,
        f"`{path}` is not below the folder of the first file",
        hint=f"allow it with `--include {os.path.dirname(key)}`",
    )
    return None


def _is_below(path: str, folder: str) -> bool:
    """Whether a file lies below a folder; links have been followed in both paths."""
    return path.startswith(folder if folder.endswith(os.sep) else folder + os.sep)
