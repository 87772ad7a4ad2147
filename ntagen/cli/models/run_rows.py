"""How the values of random runs are distributed, for people: on one line."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from ntagen.checker import Distribution

_HEIGHTS: Final = "▁▂▃▄▅▆▇█"
_MOST_BARS: Final = 30


def distribution_line(found: Distribution) -> str | None:
    """When runs reach what is asked, or what they are worth; ``None`` if none of them has a value.

    For example ``reached at 1.83 to 9.97, mean 6.41 ▁▁▂▃▅▆█▇▆▅▃``.
    """
    if found.min is None or found.max is None or found.mean is None:
        return None
    if found.of == "value":
        said = "values"
    else:
        verb = "broken" if found.broken else "reached"
        said = f"{verb} after" if found.of == "moves" else f"{verb} at"
        said += f" {found.label.removeprefix('value of the clock ')} =" * (found.of == "clock")
    unit = " moves" if found.of == "moves" else ""
    if found.min == found.max:
        return f"{said} {found.min:.6g}{unit} in {found.count:,} of {found.runs:,} runs"
    line = f"{said} {found.min:.6g} to {found.max:.6g}{unit}, mean {found.mean:.6g}"
    shown = bars(found.to_json()["histogram"]["counts"])
    return f"{line}  {shown}" if _is_printable(shown) else line


def bars(counts: list[int]) -> str:
    """Counts as bars of different heights; many neighbours become one bar."""
    together = -(-len(counts) // _MOST_BARS)
    sums = [sum(counts[i : i + together]) for i in range(0, len(counts), together)]
    # The last bar may stand for fewer buckets than the others.
    sums[-1] = sums[-1] * together // (len(counts) - (len(sums) - 1) * together)
    most = max(sums)
    heights = [-(-one * len(_HEIGHTS) // most) for one in sums]
    return "".join(_HEIGHTS[one - 1] if one else " " for one in heights).rstrip()


def _is_printable(text: str) -> bool:
    """Whether standard output has these characters."""
    try:
        text.encode(sys.stdout.encoding or "ascii")
    except (LookupError, UnicodeEncodeError):
        return False
    return True
