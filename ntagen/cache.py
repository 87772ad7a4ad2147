"""Where things are kept that are worked out once and hold until the program changes.

Everything kept there can be deleted at any time: it is worked out anew.
"""

from __future__ import annotations

import os
from pathlib import Path


def cache_folder() -> Path | None:
    """The folder of ntagen in the user's cache, made if need be; None if there can be none.

    A folder that all users share will not do: whoever can write there could have code run here.
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
