"""Fixtures of the tests of campaigns on the command line."""

from __future__ import annotations

import pytest

from ntagen.experiment import local
from ntagen.experiment.crew import Here


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """No processes."""

    def crew(_: int) -> Here:
        return Here()

    monkeypatch.setattr(local, "LocalCrew", crew)
