"""The simulator of `ntagen serve` in a real browser, on three models, by mouse and by keyboard."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from ntagen import checker
from ntagen.serve.processes import Limits, ended
from ntagen.serve.server import Server
from tests.browsers import NEEDS_BROWSER
from tests.simulated import CROSSING, LAMP, MATCHES

pytestmark = NEEDS_BROWSER

Page = Any
"""A page of playwright, which is not installed everywhere."""

CHANCE = """
int n = 0;
process P() { clock x; state A { x <= 5 }; init A;
  trans A -> A { guard x >= 1; assign n = n + 1, x = 0; }; }
system P;
"""


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    server = Server(Limits(timeout_s=40, simulations=4))
    thread = threading.Thread(target=server.serve)
    thread.start()
    yield server
    server.close()
    thread.join(10)


@pytest.fixture
def said() -> list[str]:
    """What the browser says, of which nothing is expected but refused requests."""
    return []


@pytest.fixture
def page(server: Server, browser: Any, said: list[str]) -> Iterator[Page]:  # noqa: ANN401
    page = browser.new_page(viewport={"width": 1300, "height": 1000})
    page.set_default_timeout(60_000)
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    yield page
    page.close()
    own = (f"http://127.0.0.1:{server.port}/", f"blob:http://127.0.0.1:{server.port}/")
    assert [one for one in asked if not one.startswith((*own, "about:"))] == []
    assert [one for one in said if "Failed to load resource" not in one] == []


@pytest.fixture
def simulate(server: Server, page: Page) -> Callable[[str], None]:
    """Opens the simulator of a model from the page of queries, as a user does."""

    def opened(text: str, name: str = "model.xta") -> None:
        number = server.shop.add(name, text.encode())
        page.goto(f"{server.address}#{number}")
        page.wait_for_selector("button:text-is('Simulate')")
        page.wait_for_selector("#busy", state="hidden")
        page.click("button:text-is('Simulate')")
        page.wait_for_url("**/simulator?*")
        page.wait_for_selector("#work:not([hidden])")

    return opened


def wait_for_step(page: Page, number: int) -> None:
    page.wait_for_selector(f"#position:has-text('step {number} of')")


def take(page: Page, number: int, move: int = 0) -> None:
    """Takes a move, which leads to the step with this number."""
    page.locator("#moves button").nth(move).click()
    wait_for_step(page, number)


def click_on(page: Page, edge: Any) -> None:  # noqa: ANN401
    """Clicks with the mouse on the middle of an edge."""
    x, y = edge.evaluate(
        """(path) => { const at = path.getPointAtLength(path.getTotalLength() / 2)
          .matrixTransform(path.getScreenCTM()); return [at.x, at.y]; }"""
    )
    page.mouse.click(x, y)


def places(page: Page) -> list[str]:
    """The current location of each process, as the cards say it."""
    return page.locator("article .place").all_inner_texts()  # type: ignore[no-any-return]


def test_a_walk_by_mouse(page: Page, simulate: Callable[[str], None]) -> None:
    simulate(CROSSING)
    assert page.locator("article svg").count() == 3
    assert places(page) == ["Away", "Away", "Free"]
    assert page.locator(".location.current").count() == 3
    # The edges of both moves are lit; a click on one that only one move takes makes that move.
    assert page.locator(".edge.enabled").count() == 3
    click_on(page, page.locator("article").nth(1).locator(".edge.enabled path.hit"))
    wait_for_step(page, 1)
    assert places(page) == ["Away", "Near", "Free"]
    assert page.locator(".edge.taken").count() == 2
    take(page, 2)
    page.wait_for_selector("#zone-picture polygon")
    before = page.locator("#zone-picture polygon").get_attribute("points")
    assert page.locator("#constraints li").count() > 1
    page.select_option("#zone-x", "Cart(1).x")
    page.wait_for_selector("#zone-picture p:has-text('two different clocks')")
    page.select_option("#zone-y", "Cart(0).x")
    page.wait_for_selector("#zone-picture polygon")
    assert page.locator("#zone-picture polygon").get_attribute("points") != before
    page.locator("#steps button").nth(1).click()
    wait_for_step(page, 1)
    # A reload shows the same state, way and place, and also what was picked.
    shown = page.inner_text("#steps"), places(page)
    page.reload()
    page.wait_for_selector("#work:not([hidden])")
    wait_for_step(page, 1)
    assert (page.inner_text("#steps"), places(page)) == shown
    assert page.input_value("#zone-x") == "Cart(1).x"
    # Another move from a step in the past drops the steps after it.
    take(page, 2, move=1)
    assert page.inner_text("#position") == "step 2 of 2"


def test_exact_times_and_charts(page: Page, simulate: Callable[[str], None]) -> None:
    simulate(LAMP)
    page.check("[value=exact]")
    page.wait_for_selector("#moves .when:has-text('after 1 or later')")
    page.fill("#delay", "1/2")
    page.wait_for_selector("#moves .not-now")
    page.locator("#moves button").first.click()
    page.wait_for_selector("#error:has-text('after 1/2 this move is not possible')")
    page.click("#close")
    page.fill("#delay", "5/2")
    take(page, 1)
    assert page.inner_text("#position") == "step 1 of 1, time 5/2"
    assert "Hand.rest\t0" in page.inner_text("#clocks")
    take(page, 2)
    page.wait_for_selector("#panel-chart svg text:has-text('Low')")
    page.click("#tab-sequence")
    page.wait_for_selector("#panel-chart svg text:has-text('push!')")
    page.check("[aria-label='draw pushes over time']")
    page.click("#tab-series")
    page.wait_for_selector("#panel-series polyline")
    page.check("[aria-label='draw Hand.rest over time']")
    page.wait_for_selector("#panel-series polyline >> nth=1")
    # The moves stay the same where no times are shown.
    page.check("[value=symbolic]")
    page.wait_for_selector("#constraints:not([hidden])")
    assert page.inner_text("#position") == "step 2 of 2"


def test_a_witness_is_stepped_through_and_saved(
    page: Page, server: Server, tmp_path: Path, simulate: Callable[[str], None]
) -> None:
    number = server.shop.add("carts.xta", CROSSING.encode())
    page.goto(f"{server.address}#{number}")
    page.wait_for_selector(".satisfied")
    page.wait_for_selector("#busy", state="hidden")
    page.locator("tr", has=page.locator(".satisfied")).locator("text=Step through").click()
    page.wait_for_url("**/simulator?*")
    page.wait_for_selector("#work:not([hidden])")
    assert page.inner_text("#name") == "carts.xta"
    count = page.locator("#steps button").count() - 1
    assert count >= 4
    assert page.is_checked("[value=exact]")
    page.keyboard.press("End")
    wait_for_step(page, count)
    assert places(page)[:2] == ["On", "Halted"]
    with page.expect_download() as download:
        page.click("#save")
    path = tmp_path / "trace.json"
    download.value.save_as(path)
    assert checker.load(CROSSING).verify(path.read_bytes(), str(path)).holds is True
    # Another tab loads it.
    simulate(CROSSING)
    page.set_input_files("#load", path)
    page.wait_for_selector(f"#steps li >> nth={count}")
    page.set_input_files("#load", {"name": "x", "mimeType": "x", "buffer": b"[]"})
    page.wait_for_selector("#error:has-text('hint: give a file that')")
    assert page.locator("#steps li").count() == count + 1


def test_a_game_is_played(page: Page, simulate: Callable[[str], None]) -> None:
    simulate(MATCHES)
    page.click("#tab-strategy")
    assert page.input_value("#game-query") == "control: A<> Keeper.Lit"
    page.click("#advise")
    page.wait_for_selector("#moves .allowed:has-text('the strategy takes it now')")
    page.click("#play")
    page.wait_for_selector("#forecast:has-text('You are the environment')")
    take(page, 3)
    # After the wind, the keeper has struck the next match without being asked.
    assert page.locator("#steps li").all_inner_texts()[1:] == [
        "1. strategy: Keeper: Dark → Striking",
        "2. Keeper: Striking → Dark",
        "3. strategy: Keeper: Dark → Striking",
    ]
    page.click("#wait")
    page.wait_for_selector("#end:has-text('the goal holds: the controller has won')")
    page.reload()
    page.wait_for_selector("#end:has-text('the goal holds: the controller has won')")


def test_random_runs_are_drawn_while_they_come_in(
    page: Page, simulate: Callable[[str], None]
) -> None:
    simulate(CHANCE)
    page.click("#tab-runs")
    page.fill("#runs-query", "simulate [<=20; 60] { n, P.x }")
    page.dispatch_event("#runs-query", "change")
    assert page.input_value("#runs-count") == "60"
    page.evaluate(
        """() => { window.seen = []; new MutationObserver(() => window.seen.push(
          document.querySelectorAll('#runs-picture polyline').length)).observe(
          document.getElementById('runs-picture'), { childList: true }); }"""
    )
    page.click("#runs-start")
    page.wait_for_selector("#runs-done:has-text('60 of 60 runs')")
    seen = page.evaluate("window.seen")
    assert seen == sorted(set(seen))
    assert (len(seen) > 3, seen[0], seen[-1]) == (True, 2, 120)
    page.fill("#runs-query", "simulate [<=20] { nobody }")
    page.click("#runs-start")
    page.wait_for_selector("#error:has-text('nobody')")


def test_a_random_walk_has_a_speed_and_ends(page: Page, simulate: Callable[[str], None]) -> None:
    simulate(LAMP)
    page.select_option("#speed", "0")
    page.click("#walk")
    # The hand has nine pushes.
    page.wait_for_selector("#end:has-text('deadlock')")
    page.wait_for_selector("#walk[aria-pressed=false]")
    assert page.inner_text("#position") == "step 9 of 9"
    way = page.inner_text("#steps")
    page.click("#restart")
    wait_for_step(page, 0)
    page.click("#walk")
    page.wait_for_selector("#end:has-text('deadlock')")
    assert page.inner_text("#steps") == way


def test_the_keyboard_is_enough(page: Page, simulate: Callable[[str], None]) -> None:
    simulate(CROSSING)
    press = page.keyboard.press

    def reach(selector: str) -> None:
        for _ in range(80):
            press("Tab")
            if page.evaluate("(one) => document.activeElement.matches(one)", selector):
                return
        raise AssertionError(f"Tab does not lead to {selector}")

    reach(".skip")
    reach("#moves button")
    # What has the focus is seen, and its edges are marked.
    assert page.evaluate("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    assert page.locator(".edge.chosen").count() == 2
    press("ArrowDown")
    press("Enter")
    wait_for_step(page, 1)
    assert places(page) == ["Away", "Near", "Free"]
    assert page.evaluate("document.activeElement.matches('#moves button')")
    assert page.inner_text("#live").startswith("Step 1: Cart(1): Away → Near")
    press("ArrowLeft")
    wait_for_step(page, 0)
    press("ArrowRight")
    wait_for_step(page, 1)
    reach("#walk")
    reach("#find")
    page.keyboard.type("bridge")
    assert page.locator("article:visible").count() == 1
    reach("article:not([hidden]) > button")
    press("Enter")
    assert page.locator("article:visible svg:visible").count() == 0
    reach("[role=tab]")
    press("ArrowRight")
    assert page.get_attribute("#tab-sequence", "aria-selected") == "true"
    # Everything that can be used has a name for those who listen.
    nameless = page.evaluate(
        """() => [...document.querySelectorAll('button, input, select, a, [role=img]')].filter(
          (one) => !(one.getAttribute('aria-label') || one.textContent.trim() ||
            [...(one.labels || [])].some((label) => label.textContent.trim()))
        ).map((one) => one.outerHTML)"""
    )
    assert nameless == []


def large() -> str:
    """A hundred processes with ten locations each, of which one moves after the other."""
    places = ", ".join(f"L{number}" for number in range(10))
    edges = ", ".join(
        f"L{number} -> L{(number + 1) % 10} {{ guard turn == id && x >= 1; "
        "assign x = 0, turn = (turn + 1) % 100; }"
        for number in range(10)
    )
    return (
        "int[0, 99] turn = 0; process Cell(const int[0, 99] id) { clock x; "
        f"state {places}; init L0; trans {edges}; }} system Cell;"
    )


def test_a_large_model_stays_usable(page: Page, simulate: Callable[[str], None]) -> None:
    simulate(large())
    assert page.locator("article").count() == 100
    # All are folded at first.
    assert page.locator("article svg").count() == 0
    take(page, 1)
    page.fill("#find", "Cell(4")
    assert page.locator("article:visible").count() == 11
    page.fill("#find", "L1")
    assert page.locator("article:visible").all_inner_texts() == ["Cell(0) L1"]
    page.fill("#find", "")
    page.check("#moving")
    assert page.locator("article:visible").all_inner_texts() == ["Cell(1) L0 ▸ 1"]
    page.uncheck("#moving")
    page.click("#unfold")
    assert page.locator("article svg").count() == 100
    width = page.locator("article svg").first.bounding_box()["width"]
    page.click("#smaller")
    assert page.locator("article svg").first.bounding_box()["width"] < width
    assert page.inner_text("#zoom") == "80 %"
    # A step changes only what it lights: a few classes and texts of some cards.
    page.evaluate(
        """() => { window.changes = 0; new MutationObserver((all) => { window.changes += all.length;
          }).observe(document.getElementById('processes'),
          { attributes: true, childList: true, subtree: true, characterData: true }); }"""
    )
    take(page, 2)
    assert 0 < page.evaluate("window.changes") < 40
    page.fill("#find-value", "Cell(7).x")
    page.reload()
    page.wait_for_selector("#work:not([hidden])")
    wait_for_step(page, 2)
    assert page.inner_text("#zoom") == "80 %"
    assert page.locator("article svg").count() == 100


def test_what_goes_wrong_is_said_with_a_way_out(
    page: Page, server: Server, simulate: Callable[[str], None]
) -> None:
    simulate(
        "int[0, 1] n = 0; process P() { state A; init A; trans A -> A { assign n++; }; } system P;"
    )
    take(page, 1)
    assert "value out of range, at model.xta:1:71: n++" in page.inner_text("#end")
    assert "hint: step back" in page.inner_text("#end")
    # Its process is killed; the next step is made by another one.
    identity = page.url.rpartition("#")[2]
    worker = server.simulations.get(identity).worker
    assert worker is not None
    ended(worker._process)
    page.click("#back")
    wait_for_step(page, 0)
    page.wait_for_selector("#note:has-text('nothing is lost')")
    simulate("clock x; process P() { state A { x <= 4 }; init A; } system P;")
    page.check("[value=exact]")
    page.wait_for_selector("#end:has-text('time stops after 4 (a timelock)')")
    page.goto(f"http://127.0.0.1:{server.port}/simulator?token={server.token}#nowhere")
    page.wait_for_selector("#error:has-text('hint: open the model, and simulate it again')")
    page.goto("about:blank")
    page.goto(f"http://127.0.0.1:{server.port}/simulator?token={server.token}")
    page.wait_for_selector("#error:has-text('press Simulate')")


EVIL = "<img src=x onerror=hacked=1><script>hacked=1</script>"
ESCAPED = EVIL.replace("<", "&lt;").replace(">", "&gt;")
ATTACK = """<nta><declaration>// EVIL
clock x; int n; chan c;</declaration>
<template><name>P</name><parameter>int[0, 0] /* EVIL */ id</parameter>
<declaration>/* EVIL */</declaration>
<location id="a" x="0" y="0" color="&quot; onload=&quot;hacked=1"><name>A</name>
<label kind="invariant">x &lt;= 9 /* EVIL */</label>
<label kind="comments">EVIL</label></location>
<location id="b" x="200" y="0" color="#&lt;b&gt;"><name>B</name></location><init ref="a"/>
<transition color="&quot;/&gt;&lt;script&gt;hacked=1&lt;/script&gt;">
<source ref="a"/><target ref="b"/>
<label kind="select">i : int[0, 1] /* EVIL */</label>
<label kind="guard">x &gt;= 1 /* EVIL */</label>
<label kind="assignment">n = i /* EVIL */</label>
<label kind="comments">EVIL</label></transition>
</template><system>/* EVIL */ system P;</system>
<queries><query><formula>E&lt;&gt; P(0).B /* EVIL */</formula>
<comment>EVIL</comment></query>
<query><formula>control: A&lt;&gt; P(0).B /* EVIL */</formula>
<comment>EVIL</comment></query>
</queries></nta>""".replace("EVIL", ESCAPED)


def test_texts_of_a_model_are_never_markup(
    page: Page, server: Server, simulate: Callable[..., None]
) -> None:
    def unharmed() -> None:
        assert page.evaluate("window.hacked") is None
        assert page.locator("img, iframe[src^=data], svg script, [onload], [onerror]").count() == 0

    simulate(ATTACK, f"{EVIL}.xml")
    unharmed()
    take(page, 1)
    for tab in ("gantt", "sequence", "series", "strategy", "runs"):
        page.click(f"#tab-{tab}")
        page.wait_for_timeout(150)
        unharmed()
    page.click("#tab-strategy")
    page.click("#advise")
    page.wait_for_selector("#advice:not([hidden])")
    page.fill("#game-query", f"control: A<> {EVIL}")
    page.click("#play")
    page.wait_for_selector("#error:has-text('<img src=x')")
    trace = json.dumps(
        {"format": "ntagen-trace", "query": EVIL, "transitions": [[{"process": EVIL}]]}
    )
    page.set_input_files("#load", {"name": EVIL, "mimeType": EVIL, "buffer": trace.encode()})
    page.wait_for_selector("#error:has-text('no edge as one of <img')")
    unharmed()
    page.click("#queries")
    page.wait_for_selector(".satisfied")
    page.wait_for_selector("#busy", state="hidden")
    unharmed()
    assert "<img src=x onerror" in page.inner_text("#queries")
