"""The files of tests that `ntagen test` writes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from ntagen.errors import InputError
from ntagen.files import MODEL_BYTES, read_file

if TYPE_CHECKING:
    from ntagen.suites import Harness, Suite


def code_files(suite: Suite, harness: Harness) -> dict[str, str]:
    """The files that the test code of the model makes, by name.

    Raises:
        InputError: The code asks for an unknown value, or the model names files elsewhere.
    """
    files = harness.files(suite.tests)
    for name in files:
        require_plain(name, "the model's TEST_FILENAME and TEST_FILEEXT make")
    return files


def template_files(
    suite: Suite, harness: Harness, template: Path, name: str | None
) -> dict[str, str]:
    """The files that a template makes, by name.

    Raises:
        InputError: The template or the name is wrong.
        OSError: The template cannot be read.
    """
    from ntagen.suites import rendered

    if name is None:
        name = template.name.removesuffix(".jinja")
        if name == template.name:
            raise InputError(
                f"{template} does not end in .jinja, so the tests have no name\n"
                "hint: give one with --name"
            )
    require_plain(name, "--name is")
    try:
        text = read_file(template, MODEL_BYTES).decode()
    except UnicodeDecodeError as error:
        raise InputError(f"{template} is no text in UTF-8: {error}") from error
    return rendered(suite, harness, text, str(template), name)


def require_plain(name: str, what: str) -> None:
    """Raises an `InputError` if a name of a file leads to another folder."""
    if name in ("", ".", "..") or any(sign in name for sign in "/\\\0"):
        raise InputError(
            f"{what} {name!r}, which is no plain name of a file\n"
            "hint: --folder says where the files are written"
        )
