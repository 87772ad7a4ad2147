"""Whether there is a browser for the tests of pages; `tests/integration/conftest.py` opens it."""

from __future__ import annotations

import shutil
from typing import Final

import pytest

_NAMES: Final = ("chromium", "chromium-browser", "google-chrome")
BROWSER: Final = next((path for name in _NAMES if (path := shutil.which(name))), None)

NEEDS_BROWSER: Final = [
    pytest.mark.slow,
    pytest.mark.skipif(BROWSER is None, reason=f"needs a browser: {', '.join(_NAMES)}"),
]
"""The marks of a file with such tests."""
