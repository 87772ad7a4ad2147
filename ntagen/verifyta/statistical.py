"""The options of verifyta for random runs, as options of a query."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
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


_RANGES: Final = {"seed": (-1, math.inf), "runs": (0, math.inf), "discretisation": (0, math.inf)}
"""Between which numbers values lie, without the ends; those of other fields between 0 and 1."""


def of_model(options: Mapping[str, str], given: Collection[str] = ()) -> dict[str, Any]:
    """The fields of `ntagen.checker.Options` that a model file says for a query.

    Args:
        options: The options of the file; what is not for random runs, or has a value without
            meaning, is left out.
        given: The fields that the command line says itself.
    """
    usable = {}
    for name, value in options.items():
        field, read = _FIELDS.get(name, ("", float))
        low, high = _RANGES.get(field, (0, 1))
        try:
            number = read(value)
        except ValueError:
            continue
        if field and field not in given and low < number < high:
            usable[field] = number
    return usable


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
