"""The report of a run in a real browser: nothing is loaded, no texts overlap, it can be printed."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from tests.browsers import NEEDS_BROWSER

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "examples" / "paper.nsl"

pytestmark = NEEDS_BROWSER


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    log, path = folder / "run.mcap", folder / "run.html"
    options = ["--needle", "phantom", "--known", "none", "--seed", "1", "--quiet"]
    assert main(["drive", str(PAPER), *options, "--log", str(log)]) == 0
    assert main(["report", str(log), "--verify", "-o", str(path)]) == 0
    return path


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [400, 1200])
def test_a_report_is_readable(browser: Any, report: Path, scheme: str, width: int) -> None:  # noqa: ANN401
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    asked: list[str] = []
    said: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.goto(report.as_uri())
    assert (asked, said) == ([report.as_uri()], [])
    # No part is wider than the page, but for tables that scroll by themselves.
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    boxes = page.evaluate(
        """[...document.querySelectorAll(".chart svg")].map((svg) =>
             [...svg.querySelectorAll("text")].map((text) => {
               const box = text.getBoundingClientRect();
               return [text.textContent, box.left, box.top, box.right, box.bottom];
             }))"""
    )
    assert len(boxes) == 3
    for texts in boxes:
        for one, other in combinations(texts, 2):
            is_apart = one[3] <= other[1] or other[3] <= one[1]
            assert is_apart or one[4] <= other[2] or other[4] <= one[2], (one, other)
    colours = page.evaluate(
        "[getComputedStyle(document.body).color, getComputedStyle(document.body).backgroundColor]"
    )
    dark = "rgb(22, 24, 28)"
    assert (dark in colours) == (scheme == "dark")
    page.close()


def test_a_report_can_be_printed(browser: Any, report: Path) -> None:  # noqa: ANN401
    page = browser.new_page(color_scheme="dark")
    page.goto(report.as_uri())
    page.emulate_media(media="print")
    paper = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert paper == "rgb(255, 255, 255)"
    assert page.pdf(format="A4").startswith(b"%PDF")
    page.close()
