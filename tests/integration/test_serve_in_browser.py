"""`ntagen serve` in a real browser: a file is dropped, and verdicts, traces and pictures appear."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ntagen.serve.processes import Limits
from ntagen.serve.server import Server
from tests.browsers import NEEDS_BROWSER

ROOT = Path(__file__).parents[2]
MODELS = ROOT / "examples" / "models"

pytestmark = NEEDS_BROWSER


ENDLESS = """
int[0, 90] a, b, c, d, e;
process P(int[0, 90] &n) { state A; init A;
  trans A -> A { guard n < 90; assign n++; }, A -> A { guard n == 90; assign n = 0; }; }
P1 = P(a); P2 = P(b); P3 = P(c); P4 = P(d); P5 = P(e);
system P1, P2, P3, P4, P5;
"""


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    server = Server(Limits(timeout_s=40, upload_bytes=200_000))
    thread = threading.Thread(target=server.serve)
    thread.start()
    yield server
    server.close()
    thread.join(10)


@pytest.fixture
def page(server: Server, browser: Any) -> Iterator[Any]:  # noqa: ANN401
    # The whole page is seen: while a page scrolls, a click may go to where the frame was.
    page = browser.new_page(viewport={"width": 1200, "height": 1400})
    page.set_default_timeout(30_000)
    asked: list[str] = []
    said: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(server.address)
    yield page
    page.close()
    own = f"http://127.0.0.1:{server.port}/"
    assert [one for one in asked if not one.startswith((own, "about:"))] == []
    # A refused request is told by the browser, too; nothing else may be.
    assert [one for one in said if "Failed to load resource" not in one] == []


def drop(page: Any, name: str, text: str) -> None:  # noqa: ANN401
    """Drops a file on the page, as a mouse does."""
    handle = page.evaluate_handle(
        """([name, text]) => {
          const data = new DataTransfer();
          data.items.add(new File([text], name));
          return data;
        }""",
        [name, text],
    )
    page.dispatch_event("#drop", "drop", {"dataTransfer": handle})


def wait_until_done(page: Any) -> None:  # noqa: ANN401
    page.wait_for_selector("#work:not([hidden])")
    page.wait_for_selector("#busy", state="hidden")


def wait_for_picture(page: Any, text: str) -> None:  # noqa: ANN401
    """Waits until the frame shows a picture with this text."""
    for _ in range(300):
        # The frame is another one with each picture: it has no origin, so it changes its process.
        with contextlib.suppress(Exception):
            if text in page.frames[-1].content():
                return
        page.wait_for_timeout(100)
    raise AssertionError(f"no picture with {text}: {page.inner_text('#error')}")


def ask(page: Any, query: str, selector: str) -> None:  # noqa: ANN401
    page.fill("#query", query)
    page.click("#add")
    page.wait_for_selector(selector)
    wait_until_done(page)


def test_a_dropped_model_is_checked_and_drawn(page: Any) -> None:  # noqa: ANN401
    drop(page, "gate.xta", (MODELS / "train_gate.xta").read_text("utf-8"))
    wait_until_done(page)
    assert page.inner_text("#name") == "gate.xta"
    ask(page, "E<> Train(0).Crossing", ".satisfied")
    page.click("text=Trace")
    page.wait_for_selector("#text:not([hidden])")
    assert "Train(0).Approaching -> Crossing" in page.inner_text("#text")
    for kind, text in (("Gantt", "Approaching"), ("Sequence", "approach[id]!")):
        wait_until_done(page)
        page.click(f"button:text-is('{kind}')")
        wait_for_picture(page, text)
    wait_until_done(page)
    page.click("text=States without clocks")
    wait_for_picture(page, "discrete states")


def test_a_game_shows_its_strategy_and_zones(page: Any) -> None:  # noqa: ANN401
    drop(page, "game.xta", (MODELS / "four_states.xta").read_text("utf-8"))
    wait_until_done(page)
    ask(page, "control: A<> Main.Won", ".satisfied")
    page.click("text=Strategy")
    page.wait_for_selector("#text:not([hidden])")
    assert "When you are in (x<=2)" in page.inner_text("#text")
    wait_until_done(page)
    page.fill("#at", "Main.Middle")
    page.click("text=Zones")
    wait_for_picture(page, "What the controller does in ( Main.Middle )")


def test_an_environment_is_a_page_to_turn(page: Any) -> None:  # noqa: ANN401
    drop(page, "paper.nsl", (ROOT / "examples" / "paper.nsl").read_text("utf-8"))
    page.wait_for_selector(".satisfied")
    wait_until_done(page)
    assert page.locator(".satisfied").count() == 2
    page.click("text=Scene")
    wait_for_picture(page, '<h1 id="title">paper</h1>')
    page.frames[-1].click("text=above")


def test_mistakes_are_said(page: Any) -> None:  # noqa: ANN401
    for name, text, says in (
        ("a.png", "x", "is of no kind that is known"),
        ("a.xta", "hello", "error"),
        ("a.xml", "x" * 200_001, "the file is larger than"),
    ):
        drop(page, name, text)
        page.wait_for_selector(f"#error:has-text('{says}')")
    drop(page, "game.xta", (MODELS / "four_states.xta").read_text("utf-8"))
    wait_until_done(page)
    ask(page, "E<> Nowhere", ".other")
    assert "'Nowhere' is not declared" in page.inner_text("#queries")
    ask(page, "A[] not Main.Lost || true", ".satisfied")
    page.locator("tr", has_text="|| true").locator("text=Gantt").click()
    page.wait_for_selector("#error:has-text('has no trace')")


def test_a_check_is_cancelled(page: Any, server: Server) -> None:  # noqa: ANN401
    drop(page, "endless.xta", ENDLESS)
    wait_until_done(page)
    page.fill("#query", "A[] a <= 90")
    page.click("#add")
    page.wait_for_selector("#doing:has-text('checking')")
    page.click("#cancel")
    page.wait_for_selector("#error:has-text('cancelled')")
    assert not any(job.is_running for job in server.shop._jobs.values())


def test_the_address_without_its_token_shows_what_to_do(server: Server, browser: Any) -> None:  # noqa: ANN401
    page = browser.new_page()
    page.goto(f"http://127.0.0.1:{server.port}/")
    assert "open the address that was printed" in page.inner_text("body")
    page.close()
