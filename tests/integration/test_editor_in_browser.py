"""The editor of `ntagen serve` in a real browser, by mouse and by keyboard."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from ntagen import build
from ntagen.serve.processes import Limits
from ntagen.serve.server import Server
from tests.browsers import NEEDS_BROWSER
from tests.edited import GATE, hunks

pytestmark = NEEDS_BROWSER

Page = Any
"""A page of playwright, which is not installed everywhere."""

EVIL = "<img src=x onerror=alert(1)>"


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    server = Server(Limits(timeout_s=60))
    thread = threading.Thread(target=server.serve)
    thread.start()
    yield server
    server.close()
    thread.join(10)


@pytest.fixture
def page(server: Server, browser: Any) -> Iterator[Page]:  # noqa: ANN401
    page = browser.new_page(viewport={"width": 1300, "height": 950})
    page.set_default_timeout(60_000)
    said: list[str] = []
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("dialog", lambda dialog: said.append(dialog.message))
    yield page
    page.close()
    own = (f"http://127.0.0.1:{server.port}/", f"blob:http://127.0.0.1:{server.port}/")
    assert [one for one in asked if not one.startswith((*own, "about:"))] == []
    assert [one for one in said if "Failed to load resource" not in one] == []


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "gate.xml"
    path.write_text(GATE, "utf-8")
    return path


@pytest.fixture
def edit(server: Server, page: Page, file: Path) -> Callable[[], None]:
    """Opens the editor of the file from the page of queries, as a user does."""

    def opened() -> None:
        number = server.shop.add(file.name, file.read_bytes(), file)
        page.goto(f"{server.address}#{number}")
        page.click("button:text-is('Edit')")
        page.wait_for_url("**/editor?*")
        page.wait_for_selector("#work:not([hidden])")

    return opened


def field(page: Page, address: str) -> Any:  # noqa: ANN401
    return page.locator(f"[data-address='{address}'] .cm-content")


def wait_for_text(page: Page, address: str, text: str) -> None:
    page.wait_for_function(
        "([address, text]) => document.querySelector(`[data-address='${address}'] .cm-content`)"
        "?.innerText.trim() === text",
        arg=[address, text],
    )


def save(page: Page, file: Path) -> bytes:
    page.keyboard.press("Control+s")
    page.wait_for_selector("#note:text-is('saved')")
    return file.read_bytes()


def test_a_guard_is_put_right_by_keyboard(page: Page, edit: Callable[[], None], file: Path) -> None:
    edit()
    guard = "templates/0/edges/0/guard"
    page.get_by_role("button", name="Template Gate").focus()
    page.keyboard.press("Enter")
    page.wait_for_selector("#drawing svg .edge")
    page.locator("#edges button").first.focus()
    page.keyboard.press("Enter")
    field(page, guard).focus()
    page.keyboard.press("Control+End")
    page.keyboard.type(" && LIMT > 0")
    page.wait_for_selector(".cm-lintRange-error:text-is('LIMT')")
    page.wait_for_selector("#mistakes button:has-text(\"'LIMT' is not declared\")")
    assert file.read_text("utf-8") == GATE
    # Undo is the server's: it takes back what was typed.
    page.keyboard.press("Control+z")
    wait_for_text(page, guard, "count < 9 && since >= 1")
    page.wait_for_selector("#wrong-title:text-is('No mistakes')")
    page.keyboard.type(" && LIM")
    page.wait_for_selector(".cm-tooltip-autocomplete li:has-text('LIMIT')")
    page.wait_for_timeout(100)  # for so long, the list takes no key
    page.keyboard.press("Enter")
    wait_for_text(page, guard, "count < 9 && since >= 1 && LIMIT")
    page.keyboard.type(" > 0")
    wait_for_text(page, guard, "count < 9 && since >= 1 && LIMIT > 0")
    # F12 leads to the declaration.
    page.keyboard.press("ArrowLeft")
    for _ in range(5):
        page.keyboard.press("ArrowLeft")
    page.keyboard.press("F12")
    page.wait_for_selector("[data-address='declaration'] .cm-focused")
    after = save(page, file)
    assert after == GATE.encode().replace(b"= 1</label>", b"= 1 &amp;&amp; LIMIT &gt; 0</label>")
    assert hunks(GATE.encode(), after) == 1


def test_parts_are_added_and_a_reload_loses_nothing(
    page: Page, edit: Callable[[], None], file: Path
) -> None:
    edit()
    page.click("#outline button:has-text('Gate')")
    page.click("button:text-is('New location')")
    page.fill("#dialog [name=name]", "Ajar")
    page.click("#dialog-yes")
    page.wait_for_selector("#locations button:text-is('Ajar')")
    page.click("button:text-is('New edge')")
    page.select_option("#dialog [name=source]", label="Ajar")
    page.select_option("#dialog [name=target]", label="Shut")
    page.fill("#dialog [name=guard]", "since > 4")
    page.click("#dialog-yes")
    page.wait_for_selector("#edges button:has-text('Ajar → Shut: since > 4')")
    page.reload()
    page.wait_for_selector("#edges button:has-text('Ajar → Shut: since > 4')")
    # A location is dragged.
    page.wait_for_selector("#drawing .location")
    box = page.locator("#drawing .location").nth(2).locator("circle").first.bounding_box()
    page.mouse.move(box["x"] + 8, box["y"] + 8)
    page.mouse.down()
    page.mouse.move(box["x"] + 40, box["y"] + 68, steps=4)
    page.mouse.up()
    page.wait_for_selector("#chosen h2:text-is('Location Ajar')")
    page.wait_for_function("() => document.querySelectorAll('#drawing .location').length === 3")
    page.wait_for_selector("#undo:not([disabled])")
    model = build.parse(save(page, file).decode())
    ajar = model.templates[0].locations[2]
    assert ajar.name == "Ajar"
    assert ajar.position == (340 + 32, 60)
    assert hunks(GATE.encode(), file.read_bytes()) == 2
    # Who else has changed the file is asked for.
    file.write_bytes(b"mine")
    page.click("#outline button:has-text('System')")
    page.click("#undo")
    page.click("#save")
    page.wait_for_selector("#error:has-text('changed by another program')")
    assert file.read_bytes() == b"mine"
    page.click("#anyway")
    page.wait_for_selector("#note:text-is('saved')")
    assert file.read_bytes().startswith(b"<?xml")


def test_all_of_a_model_is_text(page: Page, edit: Callable[[], None], file: Path) -> None:
    evil = EVIL.replace("<", "&lt;")
    text = GATE.replace(">Shut<", f">{evil}<").replace(">Gate<", f">{evil}<")
    text = text.replace("// Both", f"// {evil}").replace("It opens.", evil).replace("open?", evil)
    file.write_text(text, "utf-8")
    edit()
    page.wait_for_selector("#mistakes button")
    page.locator("#outline button").nth(1).click()
    page.wait_for_selector("#drawing svg .edge")
    page.locator("#edges button").first.click()
    field(page, "templates/0/edges/0/synchronisation").click()
    page.keyboard.press("Control+Space")
    page.locator("#locations button").first.click()
    page.click("#chosen button:text-is('Remove')")
    page.wait_for_selector(f"#dialog-title:has-text('{EVIL}')")
    page.keyboard.press("Escape")
    page.click("#outline button:has-text('Queries')")
    wait_for_text(page, "queries/0/comment", EVIL)
    assert page.locator("img").count() == 0


def test_light_and_dark_and_the_check_of_what_was_edited(
    page: Page, edit: Callable[[], None]
) -> None:
    edit()
    colors = []
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        found = page.locator(".cm-editor").first.evaluate(
            "(one) => [getComputedStyle(one).color, getComputedStyle(one).backgroundColor]"
        )
        colors.append(tuple(found))
    assert colors == [
        ("rgb(28, 34, 42)", "rgb(255, 255, 255)"),
        ("rgb(230, 234, 240)", "rgb(16, 20, 26)"),
    ]
    page.click("#outline button:has-text('Queries')")
    field(page, "queries/0/formula").click()
    page.keyboard.press("Control+a")
    page.keyboard.type("A[] count < 9")
    page.click("#check")
    page.wait_for_selector("td.query:has-text('A[] count < 9')")
    page.wait_for_selector("td:has-text('not satisfied')")
