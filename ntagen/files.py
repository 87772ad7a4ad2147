"""Writing files whole or not at all."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from ntagen.errors import InputError


def write_files(texts: Mapping[Path, str]) -> None:
    """Writes text files, each of them completely or not at all; the folder is made if need be.

    A file is written beside its place under a temporary name, brought to the disk, and then
    renamed. Nothing is renamed before everything is written, so that an error (a full disk, say)
    leaves all files as they were.

    Args:
        texts: What to write, by path. Existing files are replaced.

    Raises:
        InputError: A file cannot be written there.
    """
    temporary = {path: path.with_name(f".{path.name}.{os.getpid()}.part") for path in texts}
    try:
        for path, text in texts.items():
            with _naming(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                if path.is_dir():
                    raise InputError(f"cannot write {path}: it is a folder")
                with temporary[path].open("w", encoding="utf-8", newline="\n") as file:
                    file.write(text)
                    file.flush()
                    os.fsync(file.fileno())
        for path in texts:
            with _naming(path):
                temporary[path].replace(path)
    finally:
        for part in temporary.values():
            with contextlib.suppress(OSError):
                part.unlink(missing_ok=True)


@contextlib.contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Turns an error of the operating system into one that names the file that was wanted."""
    try:
        yield
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(
            f"cannot write {path}: {reason}\nhint: choose another place for it"
        ) from error
