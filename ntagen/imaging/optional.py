"""The package that reads headers of NIfTI; who reads no such file does not need it."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import Final

from ntagen.imaging.mistakes import ImageError

PACKAGES: Final = {"nibabel": "nibabel"}
"""By module: the package that has it."""


def package(module: str, what: str) -> ModuleType:
    """A module of a package for `what`, such as ``NIfTI files``.

    Raises:
        ImageError: The package is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        name = PACKAGES[module]
        raise ImageError(
            "package-missing",
            f"{what} are read by the package {name}, which is not installed",
            "install it with `python -m pip install 'ntagen[imaging]'`",
        ) from error
