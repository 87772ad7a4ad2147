"""Simulations of the server: one process each, which may end at any time without any loss."""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ntagen.serve import simulations
from ntagen.serve.processes import Limits, ended
from ntagen.serve.server import Server
from tests.simulated import CROSSING, LAMP, MATCHES

SIMULATOR = Path(simulations.__file__).parent / "simulator"

ENDLESS = """
int n = 0;
void forever() { while (n < 3) { n = n > 1 ? 0 : n + 1; } }
process P() { state A, B, C; init A; trans A -> B { }, B -> C { assign forever(); }; }
system P;
"""


@contextlib.contextmanager
def running(**limits: Any) -> Iterator[Server]:  # noqa: ANN401
    server = Server(Limits(timeout_s=20, upload_bytes=200_000, **limits))
    thread = threading.Thread(target=server.serve)
    thread.start()
    try:
        yield server
    finally:
        server.close()
        thread.join(10)


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with running(simulations=3) as server:
        yield server


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


def begun(server: Server, text: str) -> str:
    """The path of a new simulation of a model."""
    _, told, _ = request(server, "POST", "/api/files?name=model.xta", text.encode())
    status, found = call(server, "POST", f"/api/files/{json.loads(told)['file']}/simulations")
    assert status == 201
    return f"/api/simulations/{found['simulation']}"


def asked(server: Server, path: str, do: str, **more: Any) -> Any:  # noqa: ANN401
    status, answer = call(server, "POST", path, {"do": do, **more})
    assert status == 200, answer
    return answer


def worker_of(server: Server, path: str) -> Any:  # noqa: ANN401
    return server.simulations.get(path.rpartition("/")[2]).worker


def test_a_simulation_answers(server: Server) -> None:
    path = begun(server, LAMP)
    status, told = call(server, "GET", path)
    assert (status, told["name"], told["kind"]) == (200, "model.xta", "model")
    opened = asked(server, path, "open")
    assert [one["name"] for one in opened["model"]["processes"]] == ["Lamp", "Hand"]
    # What the server keeps is none of the page's business.
    assert "keep" not in opened["view"]
    assert asked(server, path, "take", move=0)["position"] == 1
    status, answer = call(server, "POST", path, {"do": "take", "move": 9})
    assert (status, answer["error"]) == (400, "there is no move 10 here; there are 2")


def test_a_killed_process_loses_nothing(server: Server) -> None:
    for text, first in (
        (CROSSING, {"do": "mode", "mode": "exact"}),
        (MATCHES, {"do": "play", "query": "control: A<> Keeper.Lit"}),
    ):
        path = begun(server, text)
        asked(server, path, **first)
        for _ in range(6):
            view = asked(server, path, "random", seed=3)
        asked(server, path, "go", position=1)
        old = worker_of(server, path)
        ended(old._process)
        after = asked(server, path, "go", position=99)
        assert after.pop("resumed") is True
        assert worker_of(server, path) is not old
        assert {name: after[name] for name in ("mode", "position", "state", "time", "moves")} == {
            name: view[name] for name in ("mode", "position", "state", "time", "moves")
        }
        assert "resumed" not in asked(server, path, "go", position=0)


def test_the_oldest_idle_process_makes_room(server: Server) -> None:
    paths = [begun(server, LAMP) for _ in range(5)]
    for path in paths:
        asked(server, path, "take", move=0)
    assert [worker_of(server, path) is not None for path in paths] == [False, False, *3 * [True]]
    assert asked(server, paths[0], "take", move=0)["position"] == 2
    assert worker_of(server, paths[2]) is None


def test_a_step_that_takes_too_long_ends_its_process_only(monkeypatch: pytest.MonkeyPatch) -> None:
    with running() as server:
        path = begun(server, ENDLESS)
        asked(server, path, "open")
        monkeypatch.setattr(worker_of(server, path), "_wait_s", 0.7)
        status, answer = call(server, "POST", path, {"do": "take", "move": 0})
        assert status == 503
        assert "it did not answer within 0.7 s\nhint: the way until here is kept" in answer["error"]
        assert worker_of(server, path) is None
        # What the page shows is still there.
        assert asked(server, path, "open")["view"]["position"] == 0


def test_a_step_is_cancelled() -> None:
    with running() as server:
        path = begun(server, ENDLESS)
        asked(server, path, "open")
        answers: list[Any] = []

        def ask() -> None:
            answers.append(call(server, "POST", path, {"do": "take", "move": 0}))

        thread = threading.Thread(target=ask)
        thread.start()
        simulation = server.simulations.get(path.rpartition("/")[2])
        while not simulation.lock.locked():
            time.sleep(0.01)
        assert call(server, "DELETE", path)[0] == 200
        thread.join(20)
        status, answer = answers[0]
        assert (status, "it was cancelled" in answer["error"]) == (503, True)


def test_a_broken_model_is_said_in_words(server: Server) -> None:
    path = begun(server, "process P( {")
    status, answer = call(server, "POST", path, {"do": "open"})
    assert status == 400
    assert "model.xta:1:12: error" in answer["error"]
    assert "Traceback" not in answer["error"]


def test_what_is_not_there_is_said(server: Server) -> None:
    for method, path in (
        ("GET", "/api/simulations/1"),
        ("POST", "/api/simulations/1"),
        ("DELETE", "/api/simulations/1"),
        ("POST", "/api/files/1/simulations"),
        ("GET", "/simulator/page.html"),
        ("GET", "/simulator/../server.py"),
        ("GET", "/simulator/..%2fserver.py"),
        ("GET", "/simulator/main.js/x"),
    ):
        status, answer, _ = request(server, method, path, b'{"do": "open"}')
        assert status == 404, path
        assert b"Traceback" not in answer
    path = begun(server, LAMP)
    for body in (b"[]", b"{", b"[" * 100_000, b"\xff"):
        assert request(server, "POST", path, body)[0] == 400
    _, told, _ = request(server, "POST", "/api/files?name=run.mcap", b"x")
    status, answer = call(server, "POST", f"/api/files/{json.loads(told)['file']}/simulations")
    assert (status, "only models are simulated" in answer["error"]) == (400, True)


@pytest.mark.parametrize("path", ["/simulator", "/simulator/main.js", "/simulator/style.css"])
def test_the_simulator_needs_the_token_and_loads_nothing_from_elsewhere(
    server: Server, path: str
) -> None:
    assert request(server, "GET", path, **{"X-Ntagen-Token": "other"})[0] == 403
    assert request(server, "GET", path, Origin="http://evil.example")[0] == 403
    assert request(server, "GET", path, Host="evil.example")[0] == 421
    status, data, headers = request(server, "GET", path)
    assert status == 200
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'")
    assert "unsafe" not in policy
    text = data.decode().replace("http://www.w3.org/2000/svg", "")
    assert re.findall(r"https?:|@import|url\(|//[a-z]+\.", text) == []
    status, nothing, told = request(server, "HEAD", path)
    assert (status, nothing) == (200, b"")
    assert told["Content-Type"] == headers["Content-Type"]


@pytest.mark.parametrize("method", ["OPTIONS", "PUT", "PATCH", "TRACE"])
@pytest.mark.parametrize("path", ["/", "/simulator", "/api/files", "/api/simulations/1"])
def test_other_methods_are_refused(server: Server, method: str, path: str) -> None:
    status, _, headers = request(server, method, path)
    assert status == 405
    # No other site is allowed anything.
    assert [name for name in headers if name.lower().startswith("access-control")] == []
    assert request(server, method, path, **{"X-Ntagen-Token": "other"})[0] == 403
    assert request(server, method, path, Origin="http://evil.example")[0] == 403


def test_programs_are_all_sent_and_make_no_markup(server: Server) -> None:
    _, page, _ = request(server, "GET", "/simulator")
    for part in SIMULATOR.glob("*.js"):
        assert f'"{part.name}": "/simulator/{part.name}?token={server.token}"'.encode() in page
        text = part.read_text("utf-8")
        # Texts of models become text nodes; there is no other way than these.
        assert not re.search(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|eval\(", text)
        assert len(text.splitlines()) < 300


def test_fifty_tabs_are_served_at_once(server: Server) -> None:
    found: list[int] = []

    def open_tab() -> None:
        found.append(request(server, "GET", "/simulator")[0])

    tabs = [threading.Thread(target=open_tab) for _ in range(50)]
    for tab in tabs:
        tab.start()
    for tab in tabs:
        tab.join(30)
    assert found == [200] * 50
