"""A run in a real browser while it goes on: what is seen, its stop, and a driver that is gone."""

from __future__ import annotations

import contextlib
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from ntagen.drive.reading import read_log
from ntagen.drive.records import Ended
from tests.browsers import NEEDS_BROWSER

ROOT = Path(__file__).parents[2]
PAPER = ROOT / "examples" / "paper.nsl"

pytestmark = NEEDS_BROWSER


@contextlib.contextmanager
def driving(*options: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A driver that is shown, and its address."""
    command = [sys.executable, "-m", "ntagen", "drive", str(PAPER), "--view", "--quiet", *options]
    with subprocess.Popen(command, text=True, stdout=subprocess.PIPE, stderr=-1) as driver:
        try:
            assert driver.stderr is not None
            while (found := re.search(r"http://\S+", driver.stderr.readline())) is None:
                assert driver.poll() is None
            yield driver, found[0]
        finally:
            driver.kill()


def opened(browser: Any, address: str, **options: Any) -> tuple[Any, list[str]]:  # noqa: ANN401
    """A page, and what goes wrong on it."""
    page, wrong = browser.new_page(**options), list[str]()
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda message: wrong.append(message.text))
    page.goto(address)
    return page, wrong


def until(page: Any, expression: str) -> None:  # noqa: ANN401
    """Waits until an expression is true on a page, whose policy forbids a function that waits."""
    end_s = time.monotonic() + 30.0
    while not page.evaluate(expression):
        assert time.monotonic() < end_s, expression
        page.wait_for_timeout(50)


def test_a_run_is_seen_and_stopped(browser: Any, tmp_path: Path) -> None:  # noqa: ANN401
    log = tmp_path / "run.mcap"
    options = ["--needle", "phantom", "--seed", "1", "--known", "none", "--log", str(log)]
    with driving(*options) as (driver, address):
        page, wrong = opened(browser, address)
        until(page, "moments.some((one) => one.off !== undefined)")
        assert page.inner_text("#state") in ("State: execute", "State: monitor")
        # Loaded again, the page has the whole run.
        before = page.evaluate("moments.length")
        page.reload()
        until(page, f"moments.length >= {before}")
        assert page.evaluate("moments[0].t") == 0
        assert page.locator("#charts canvas").count() == 2
        # Who looks back stays there.
        page.keyboard.press("ArrowLeft")
        shown = page.evaluate("shown")
        until(page, f"moments.length > {shown} + 4")
        assert page.evaluate("shown") == shown
        page.click("#play")
        assert page.evaluate("shown === moments.length - 1")
        page.click("#stop")
        assert driver.wait(20) == 130
        until(page, "ended")
        assert page.inner_text("#state") == "State: interrupted"
        assert not page.is_visible("#stop")
        assert wrong == []
        page.close()
    (end,) = (record for record in read_log(log).records if isinstance(record, Ended))
    assert end.reason == "stopped on the page of the run"


def test_a_driver_that_is_gone_is_said(browser: Any) -> None:  # noqa: ANN401
    with driving("--seed", "1") as (driver, address):
        page, _ = opened(browser, address)
        until(page, "moments.length > 3")
        driver.send_signal(signal.SIGKILL)
        until(page, "silent")
        assert "Stop does not reach the needle" in page.inner_text("#state")
        page.close()


@pytest.mark.parametrize(
    ("scheme", "width", "more"), [("light", 1200, 0), ("dark", 400, 0), ("dark", 1200, 37)]
)
def test_the_page_of_a_log_is_readable(
    browser: Any,  # noqa: ANN401
    tmp_path: Path,
    scheme: str,
    width: int,
    more: int,
) -> None:
    log, path = tmp_path / "run.mcap", tmp_path / "run.html"
    regions = "\n".join(
        f"  critical N{number}  sphere ({25 + number // 9}, {-5 * (number % 9)}, 20) mm radius 1 mm"
        for number in range(more)
    )
    task = tmp_path / "task.nsl"
    task.write_text(PAPER.read_text().replace("  tissue", f"{regions}\n\n  tissue", 1))
    options = ["--needle", "phantom", "--known", "none", "--seed", "1", "--quiet"]
    assert main(["drive", str(task), *options, "--log", str(log)]) == 0
    assert main(["plot", str(log), "-o", str(path)]) == 0
    viewport = {"width": width, "height": 900}
    page, wrong = opened(browser, path.as_uri(), viewport=viewport, color_scheme=scheme)
    assert wrong == []
    assert page.inner_text("#state") == "State: target reached"
    assert page.locator("#regions label").count() > more
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    heads = page.locator("#charts h2").all_inner_texts()
    assert [re.findall(r"\((\w+)\)", head) for head in heads] == [["N", "s"], ["mm", "s"]]
    # Nothing lies over something else.
    boxes = page.evaluate(
        """[...document.querySelectorAll("h1, h2, p, label, button, #log, canvas")]
             .filter((one) => one.offsetParent)
             .map((one) => { const box = one.getBoundingClientRect();
                             return [box.left, box.top, box.right, box.bottom]; })"""
    )
    for number, one in enumerate(boxes):
        for other in boxes[number + 1 :]:
            across = min(one[2], other[2]) - max(one[0], other[0])
            down = min(one[3], other[3]) - max(one[1], other[1])
            assert across <= 1.0 or down <= 1.0, (one, other)
    page.close()
