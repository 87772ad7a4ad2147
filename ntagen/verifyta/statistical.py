"""The options of verifyta for random runs, as options of a query."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

_FIELDS: Final[dict[str, tuple[str, Callable[[str], Any]]]] = {
    "--seed": ("seed", int),
    "--runs": ("runs", int),
    "--alpha": ("alpha", float),
    "--beta": ("beta", float),
    "--epsilon": ("epsilon", float),
    "--delta": ("delta", float),
    "--discretization": ("discretisation", float),
}
"""For each option, the field of `ntagen.checker.Options` and the type of its value."""


def statistical(given: Mapping[str, str]) -> dict[str, Any]:
    """The fields of `ntagen.checker.Options` that these options say.

    Args:
        given: The values of options by their long names; others than those for random runs count
            for nothing.
    """
    fields = {field: read(given[name]) for name, (field, read) in _FIELDS.items() if name in given}
    if "--u0" in given or "--u1" in given:
        fields["odds_ratios"] = float(given.get("--u0", "0.9")), float(given.get("--u1", "1.1"))
    return fields
