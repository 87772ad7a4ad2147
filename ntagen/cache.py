"""The cache on disk: results that stay valid until the program changes.

Everything in it can be deleted at any time; it is computed again.
"""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path | None:
    """The folder of ntagen in the user's cache, made if necessary. None if that is impossible.

    A folder that all users share is not safe: whoever can write to it could run code here.
    """
    root = Path(os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
    if not root.is_absolute():
        return None
    folder = root / "ntagen"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        return None
    return folder
