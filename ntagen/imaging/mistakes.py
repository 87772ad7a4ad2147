"""What can be wrong with a file of anatomy: one error each, with its kind, cause and hint."""

from __future__ import annotations

from typing import Literal

from ntagen.errors import InputError

Defect = Literal[
    "file-missing",
    "file-unreadable",
    "file-too-large",
    "file-empty",
    "package-missing",
    "image-malformed",
    "image-too-large",
    "mesh-not-closed",
    "mesh-inverted",
    "space-unknown",
    "unit-unknown",
    "part-missing",
    "matrix-degenerate",
    "matrix-ambiguous",
]
"""The kinds of defects, by the names that the environment language has for them."""


class ImageError(InputError):
    """A file of anatomy that cannot be used.

    Attributes:
        defect: The kind of the defect.
        message: What is wrong, in one line.
        hint: What to do.
    """

    def __init__(self, defect: Defect, message: str, hint: str) -> None:
        super().__init__(f"{message}\nhint: {hint}")
        self.defect = defect
        self.message = message
        self.hint = hint


def malformed(message: str, hint: str = "save it once more") -> ImageError:
    """The error of a file that is not what its name says."""
    return ImageError("image-malformed", message, hint)
