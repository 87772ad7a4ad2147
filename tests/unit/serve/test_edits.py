"""The editor of the server: what it is asked, what it refuses, and that no file is lost."""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ntagen.serve import edits
from ntagen.serve.processes import Limits
from ntagen.serve.server import Server
from tests.edited import GATE, hunks

EDITOR = Path(edits.__file__).parent / "editor"
GUARD = "templates/0/edges/0/guard"


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    server = Server(Limits(timeout_s=20, upload_bytes=50_000))
    thread = threading.Thread(target=server.serve)
    thread.start()
    yield server
    server.close()
    thread.join(10)


def request(
    server: Server, method: str, path: str, body: bytes | None = None, **headers: str
) -> tuple[int, bytes, http.client.HTTPMessage]:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=30)
    with contextlib.closing(connection):
        connection.request(method, path, body, {"X-Ntagen-Token": server.token} | headers)
        answer = connection.getresponse()
        return answer.status, answer.read(), answer.headers


def call(server: Server, method: str, path: str, body: object = None) -> tuple[int, Any]:
    status, data, _ = request(server, method, path, json.dumps(body).encode())
    return status, json.loads(data)


class Editor:
    """A model that is edited, as a page does it."""

    def __init__(self, server: Server, number: str) -> None:
        self.server = server
        status, made = call(server, "POST", f"/api/files/{number}/edits")
        assert status == 201, made
        self.path = f"/api/edits/{made['edit']}"
        self.version = self.ask("open")["version"]

    def send(self, do: str, **more: Any) -> tuple[int, Any]:  # noqa: ANN401
        return call(self.server, "POST", self.path, {"do": do, "version": self.version, **more})

    def ask(self, do: str, **more: Any) -> Any:  # noqa: ANN401
        self.version = 0 if do == "open" else self.version
        status, answer = self.send(do, **more)
        assert status == 200, answer
        self.version = answer.get("version", self.version)
        return answer

    def refused(self, do: str, **more: Any) -> tuple[int, str]:  # noqa: ANN401
        status, answer = self.send(do, **more)
        return status, answer["error"]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "gate.xml"
    path.write_bytes(GATE.encode())
    return path


@pytest.fixture
def editor(server: Server, file: Path) -> Editor:
    return Editor(server, server.shop.add(file.name, file.read_bytes(), file))


def test_a_guard_is_edited_and_saved_in_one_hunk(editor: Editor, file: Path) -> None:
    told = editor.ask("text", address=GUARD, text="cuont < 9")
    assert (told["undo"], told["changed"], "parts" in told) == (1, True, False)
    (mistake,) = editor.ask("mistakes")["mistakes"]
    assert (mistake["at"]["address"], mistake["at"]["to"]) == (GUARD, 5)
    assert file.read_bytes() == GATE.encode()  # only Save writes
    editor.ask("text", address=GUARD, text="count < 8", join=True)
    assert editor.ask("mistakes")["mistakes"] == []
    assert editor.ask("save")["changed"] is False
    assert b"count &lt; 8<" in file.read_bytes()
    assert hunks(GATE.encode(), file.read_bytes()) == 1
    told = editor.ask("undo")
    assert (told["address"], told["changed"], told["redo"]) == (GUARD, True, 1)


def test_names_are_completed_and_lead_to_declarations(editor: Editor) -> None:
    editor.ask("text", address=GUARD, text="LIM")
    found = editor.ask("complete", address=GUARD, at=3)
    assert "LIMIT" in [one["label"] for one in found["options"]]
    found = editor.ask("define", address="templates/0/locations/1/invariant", at=11)
    assert (found["name"], found["at"]["address"]) == ("LIMIT", "declaration")


def test_a_reload_loses_nothing(server: Server, editor: Editor) -> None:
    editor.ask("add-location", address="templates/0", name="Ajar")
    again = Editor(server, editor.ask("open")["file"])
    assert again.path == editor.path
    told = again.ask("open")
    assert (told["undo"], told["name"]) == (1, "gate.xml")
    assert told["parts"]["templates"][0]["locations"][2]["texts"]["name"] == "Ajar"
    assert again.ask("undo")["changed"] is False


def test_a_stale_page_changes_nothing(server: Server, editor: Editor) -> None:
    other = Editor(server, editor.ask("open")["file"])
    editor.ask("text", address="system", text="system Gate;")
    status, error = other.refused("text", address="system", text="system User;")
    assert (status, "changed in another tab" in error) == (409, True)
    assert editor.ask("open")["parts"]["system"] == "system Gate;"


def test_a_file_that_others_changed_is_not_overwritten(editor: Editor, file: Path) -> None:
    editor.ask("text", address="system", text="system Gate;")
    file.write_bytes(b"mine")
    status, error = editor.refused("save")
    assert (status, "changed by another program" in error) == (409, True)
    assert file.read_bytes() == b"mine"
    file.unlink()
    status, error = editor.refused("save")
    assert (status, "moved or deleted" in error) == (409, True)
    assert not file.exists()
    editor.ask("save", anyway=True)
    assert b"<system>system Gate;</system>" in file.read_bytes()
    editor.ask("undo")
    editor.ask("save")
    assert file.read_bytes() == GATE.encode()


def test_a_file_that_cannot_be_written_is_said(editor: Editor, file: Path) -> None:
    editor.ask("text", address="system", text="system Gate;")
    file.unlink()
    file.mkdir()
    status, error = editor.refused("save", anyway=True)
    assert status in (400, 409)
    assert "hint: " in error
    assert editor.ask("open")["changed"]


def test_a_dropped_file_is_downloaded_but_not_saved(server: Server) -> None:
    editor = Editor(server, server.shop.add("dropped.xml", GATE.encode()))
    assert editor.ask("open")["savable"] is False
    editor.ask("text", address="system", text="system Gate;")
    status, error = editor.refused("save")
    assert (status, "hint: download it" in error) == (400, True)
    status, data, headers = request(server, "GET", f"{editor.path}/file")
    assert (status, headers["Content-Type"]) == (200, "application/octet-stream")
    assert data == GATE.encode().replace(b"system Gate, User;", b"system Gate;")
    assert server.edits.unsaved().count("dropped.xml") == 1


def test_the_edited_model_is_checked_as_a_file_of_its_own(server: Server, editor: Editor) -> None:
    editor.ask("text", address="system", text="system User;")
    status, told = call(server, "POST", f"{editor.path}/files", "")
    assert (status, told["name"], told["kind"]) == (201, "gate.xml", "model")
    assert b"system User;" in server.shop.file(told["file"]).path.read_bytes()


def test_the_process_may_end_and_the_edits_stay(server: Server, editor: Editor) -> None:
    editor.ask("text", address=GUARD, text="cuont < 9")
    assert len(editor.ask("mistakes")["mistakes"]) == 1
    assert call(server, "DELETE", editor.path) == (200, {})
    editor.ask("text", address=GUARD, text="nope < 9")
    assert "'nope'" in editor.ask("mistakes")["mistakes"][0]["message"]


def test_only_some_models_have_a_process(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server.edits, "_limits", Limits(simulations=2))
    editors = [Editor(server, server.shop.add(f"g{n}.xml", GATE.encode())) for n in range(4)]
    for _ in range(2):
        for one in editors:
            assert one.ask("mistakes")["mistakes"] == []
            assert sum(found.has_process for found in server.edits._all.values()) <= 2


def test_xta_is_one_text(server: Server) -> None:
    data = b"process P() { state A; init A; }\r\nsystem P;\r\n"
    editor = Editor(server, server.shop.add("p.xta", data))
    assert "parts" not in editor.ask("open")
    told = editor.ask("text", address="text", text="process P() { state A; init B; }\nsystem P;\n")
    assert told["xml"] is False
    (mistake,) = editor.ask("mistakes")["mistakes"]
    assert (mistake["at"]["address"], mistake["at"]["from"]) == ("text", 28)
    _, text, _ = request(server, "GET", f"{editor.path}/text")
    assert text == data.replace(b"init A", b"init B")


@pytest.mark.parametrize(
    ("do", "more", "message"),
    [
        ("text", {"address": "nowhere", "text": ""}, "no nowhere"),
        ("text", {"address": "system", "text": ["x"]}, "text is no text"),
        ("fly", {}, "nothing that can be done"),
        ("picture", {"template": 9}, "no templates/9"),
        ("picture", {"template": "0"}, "no whole number"),
        ("complete", {"address": "system", "at": None}, "no whole number"),
        ("define", {"address": "x/y", "at": 0}, "no x"),
        ("text", {"address": "system", "text": "x" * 60_000}, "becomes larger than"),
    ],
)
def test_wrong_requests_are_refused(
    editor: Editor, do: str, more: dict[str, object], message: str
) -> None:
    status, error = editor.refused(do, **more)
    assert (status, message in error) == (400, True), error
    told = editor.ask("open")
    assert (told["changed"], told["undo"], told["redo"]) == (False, 0, 0)


def test_what_is_no_model_is_not_edited(server: Server) -> None:
    number = server.shop.add("task.nsl", b"task x\n")
    status, answer = call(server, "POST", f"/api/files/{number}/edits")
    assert (status, "no model of UPPAAL" in answer["error"]) == (400, True)
    broken = server.shop.add("broken.xml", b"\xff\xfe<")
    status, answer = call(server, "POST", f"/api/files/{broken}/edits")
    assert (status, "is not utf-16-le" in answer["error"]) == (400, True)


def test_unknown_ids_methods_and_sizes_are_refused(server: Server, editor: Editor) -> None:
    unknown = "/api/edits/0123456789abcdef"
    assert call(server, "POST", unknown, {"do": "open"})[0] == 404
    assert call(server, "GET", f"{unknown}/file")[0] == 404
    assert call(server, "DELETE", unknown)[0] == 404
    assert call(server, "POST", "/api/files/none/edits")[0] == 404
    assert call(server, "PUT", editor.path, {})[0] == 405
    assert request(server, "OPTIONS", editor.path)[0] == 405
    assert call(server, "POST", editor.path, [1])[0] == 400
    assert request(server, "POST", editor.path, b"x" * 100_001)[0] == 413
    for path in (editor.path, f"{editor.path}/file", "/editor", "/editor/main.js"):
        assert request(server, "GET", path, **{"X-Ntagen-Token": "wrong"})[0] == 403
        assert request(server, "GET", path, Origin="https://elsewhere.example")[0] == 403
    assert request(server, "GET", "/editor/../jobs.py")[0] == 404
    assert request(server, "GET", "/editor/page.html")[0] == 404


def test_the_page_runs_only_its_own_programs(server: Server) -> None:
    status, page, headers = request(server, "GET", "/editor")
    assert status == 200
    nonce = re.search(rb'script type="module" nonce="([^"]+)"', page)
    assert nonce is not None
    policy = headers["Content-Security-Policy"]
    assert f"script-src 'nonce-{nonce[1].decode()}'" in policy
    assert "unsafe" not in policy
    for found in re.findall(rb'"(/(?:editor|simulator)/[^"]+)"', page):
        status, data, headers = request(server, "GET", found.decode())
        assert (status, headers["X-Content-Type-Options"]) == (200, "nosniff"), found
        assert data
    assert request(server, "HEAD", "/editor")[1] == b""


def test_programs_are_modules_that_make_no_markup() -> None:
    for path in EDITOR.glob("*.js"):
        if path.name != "codemirror.js":
            text = path.read_text("utf-8")
            assert not re.search(
                r"innerHTML|outerHTML|insertAdjacentHTML|eval\(|new Function", text
            )
            assert text.count("\n") <= 300, path.name


def test_the_bundle_names_its_parts_and_is_small() -> None:
    text = (EDITOR / "codemirror.js").read_text("utf-8")
    header = text[: text.index("*/")]
    lock = json.loads((Path(__file__).parents[3] / "editors/bundle/package-lock.json").read_text())
    for name in ("@codemirror/view", "@codemirror/state", "style-mod", "w3c-keyname"):
        assert f"{name} {lock['packages'][f'node_modules/{name}']['version']}\n" in header
    assert "Permission is hereby granted" in header
    assert len(text) < 500_000
