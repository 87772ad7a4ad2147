"""Which ntagen this is: runs of another one do not belong into the same table."""

from __future__ import annotations

import functools
import hashlib
from pathlib import Path

from ntagen.version import VERSION

_PACKAGE = Path(__file__).resolve().parents[1]


@functools.cache
def identity() -> str:
    """The version of the package, and a digest of its files: those of the engine are included."""
    digest = hashlib.sha256()
    for path in sorted([*_PACKAGE.rglob("*.py"), *_PACKAGE.glob("_checker*.so")]):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return f"{VERSION} {digest.hexdigest()[:12]}"
