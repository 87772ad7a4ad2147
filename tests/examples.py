"""How many examples a property is tried with."""

from __future__ import annotations

from hypothesis import settings


def examples(usual: int) -> int:
    """Of so many examples, the share that the profile asks for: 100 % usually, 25 % in `quick`.

    Read when a test module is imported; Hypothesis has loaded the profile then.
    """
    return max(1, usual * settings().max_examples // 100)
