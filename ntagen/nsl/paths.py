"""Which files a description may name."""

from __future__ import annotations

import os


def is_below(path: str, folder: str) -> bool:
    """Whether a file lies below a folder; links have been followed in both paths."""
    return path.startswith(folder if folder.endswith(os.sep) else folder + os.sep)
