"""How the values of random runs are distributed, as verifyta prints it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ntagen.checker import Answer


def histogram(answer: Answer) -> list[str]:
    """The line with the histogram of a statistical query; none for other queries.

    Its number of buckets is the square root of the number of values, rounded up, as in a published
    log of UPPAAL 5; buckets for whole numbers are whole numbers wide.
    """
    found = answer.distribution
    if found is None or found.min is None or found.max is None or found.mean is None:
        return []
    known = found.to_json()["histogram"]
    counts = " ".join(str(count) for count in known["counts"])
    between = f"Values in [{found.min:g},{found.max:g}]"
    return [f"{between} mean={found.mean:g} steps={known['width']:g}: {counts}"]
