"""The colours of both pages: light and dark, texts and signs stand out enough.

The ratios are those of WCAG 2.2, level AA: 4.5 for texts (1.4.3), 3 for signs and lines that have a
meaning (1.4.11). https://www.w3.org/TR/WCAG22/#dfn-contrast-ratio
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from ntagen.serve import pages

FOLDER = Path(pages.__file__).parent
STYLE = (FOLDER / "simulator" / "style.css").read_text("utf-8")


def colors_of(style: str) -> list[dict[str, str]]:
    """The colours of a style by name: the light ones, then the dark ones."""
    return [
        dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6});", block))
        for block in re.findall(r":root \{(.*?)\}", style, re.DOTALL)
    ]


LIGHT, DARK = colors_of(STYLE)

TEXTS = [
    *((text, page) for text in ("text", "soft", "accent") for page in ("page", "panel", "field")),
    *((text, page) for text in ("current", "enabled") for page in ("page", "panel")),
    *(
        (text, "page")
        for text in ("name", "invariant", "select", "guard", "sync", "update", "weight")
    ),
    ("guard", "field"),
    ("on-accent", "accent"),
    ("on-current", "current"),
    ("text", "node"),
    ("warning", "warning-page"),
    ("warning", "page"),
    # The editor: words in a field, those that are chosen, and lists beside it.
    *((text, "field") for text in ("update", "sync", "weight", "warning")),
    *((text, "faint") for text in ("text", "soft", "update", "sync", "weight", "guard")),
    ("warning", "panel"),
    ("text", "warning-page"),
]
SIGNS = [
    *((sign, "page") for sign in ("enabled", "taken", "drawn", "current", "accent", "line")),
    *((f"line-{number}", "page") for number in range(1, 7)),
    ("line", "panel"),
    ("line", "field"),
    ("accent", "panel"),
    ("accent", "zone"),
    ("current", "node"),
]


def luminance(color: str) -> float:
    parts = [int(color[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [one / 12.92 if one <= 0.04045 else ((one + 0.055) / 1.055) ** 2.4 for one in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(first: str, second: str) -> float:
    lighter, darker = sorted((luminance(first), luminance(second)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


def test_the_ratio_is_that_of_the_standard() -> None:
    assert contrast("#ffffff", "#000000") == pytest.approx(21)
    # The example that the standard's techniques often use.
    assert contrast("#767676", "#ffffff") == pytest.approx(4.54, abs=0.01)


@pytest.mark.parametrize("colors", [LIGHT, DARK], ids=["light", "dark"])
def test_colours_stand_out(colors: dict[str, str]) -> None:
    wanted = [(pair, 4.5) for pair in TEXTS] + [(pair, 3.0) for pair in SIGNS]
    found = {
        pair: round(contrast(colors[pair[0]], colors[pair[1]]), 2)
        for pair, least in wanted
        if contrast(colors[pair[0]], colors[pair[1]]) < least
    }
    assert found == {}


def test_colours_of_the_page_of_queries_stand_out() -> None:
    found = colors_of((FOLDER / "page.html").read_text("utf-8"))
    assert len(found) == 2
    for colors in found:
        for text in ("text", "soft", "accent", "yes", "no", "other"):
            assert contrast(colors[text], colors["page"]) >= 4.5, text
        for text, page in (("soft", "panel"), ("text", "panel"), ("soft", "over")):
            assert contrast(colors[text], colors[page]) >= 4.5, (text, page)
        assert contrast(colors["line"], colors["page"]) >= 3


def test_each_colour_is_known_in_light_and_dark() -> None:
    assert LIGHT.keys() == DARK.keys()
    used = set(re.findall(r"var\(--([\w-]+)\)", STYLE))
    for path in (Path(pages.__file__).parent / "editor").glob("*[!r].*s"):
        used |= set(re.findall(r"var\(--([\w-]+)\)", path.read_text("utf-8")))
    assert used <= LIGHT.keys()
    checked = {name for pair in TEXTS + SIGNS for name in pair}
    assert used - checked == set()
