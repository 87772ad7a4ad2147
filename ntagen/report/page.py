"""The page of a report: one HTML document that loads nothing, readable and printable anywhere."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any, Final

from ntagen.drive.reading import RunLog
from ntagen.plot.run import picture_of_run
from ntagen.plot.save import svg_of
from ntagen.render.documents import filled
from ntagen.report import charts
from ntagen.report.charts import Chart, Curve, chart_of
from ntagen.report.told import alarm_times_s, chance_text

TEMPLATE: Final = "report.html.jinja"

_PLANS_SHOWN: Final = 10
"""The picture shows at most this many plans of the last synthesis."""

_FRAME: Final = {
    name.lower(): getattr(charts, name)
    for name in ("WIDTH", "HEIGHT", "LEFT", "RIGHT", "TOP", "BOTTOM")
}
"""What the template must know of the places in a chart."""

_HEAD: Final = re.compile(r"\A.*?(?=<svg\b)", re.DOTALL)
_METADATA: Final = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)


def page_of(log: RunLog, facts: dict[str, Any]) -> str:
    """The page.

    Args:
        log: The log.
        facts: Its facts (`ntagen.report.facts`).

    Raises:
        InputError: The log has no scene, or one that cannot be read.
    """
    return filled(
        TEMPLATE,
        facts=facts,
        scene=_inline(svg_of(picture_of_run(log, _PLANS_SHOWN))),
        charts=list(_charts(log, facts)),
        frame=_FRAME,
        chance=chance_text,
    )


def _inline(svg: str) -> str:
    """A document of SVG as an element of a page: as wide as the page, without what names it."""
    element = _METADATA.sub("", _HEAD.sub("", svg, count=1))
    start, end = element.split(">", 1)
    return re.sub(r' (?:width|height)="[^"]*"', "", start) + ">" + end


def _charts(log: RunLog, facts: dict[str, Any]) -> Iterator[Chart]:
    """The depth, the force and the deviation over time, as far as they are in the log."""
    measured, deviation = facts["series"]["measured"], facts["series"]["deviation"]
    settings, end_s = log.settings, facts["log"]["last_s"] or 0.0
    curves = [
        # Between two looks the needle moves at one speed, so the line of its depth has no gaps.
        Curve("depth", "mm", measured["time_s"], measured["depth_mm"], longest_s=math.inf),
        Curve("force", "N", measured["time_s"], measured["force_n"]),
        Curve(
            "deviation",
            "mm",
            deviation["time_s"],
            deviation["deviation_mm"],
            limit=settings.deviation_mm,
            limit_text=f"allowed in the mean of {settings.deviation_count} or more readings: "
            f"{settings.deviation_mm:g} mm",
        ),
    ]
    marks_s = list(alarm_times_s(log))
    return (chart_of(curve, end_s, marks_s) for curve in curves if curve.times_s)
