"""The server of `ntagen serve`: who gets in, what it answers, its limits, and what it refuses."""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from ntagen.errors import InputError
from ntagen.serve import jobs
from ntagen.serve.jobs import File, Workshop, arguments_for
from ntagen.serve.loopback import Refusal
from ntagen.serve.processes import Limits
from ntagen.serve.server import Server

ROOT = Path(__file__).parents[3]
GAME = (ROOT / "examples" / "models" / "four_states.xta").read_bytes()
PAPER = (ROOT / "examples" / "paper.nsl").read_bytes()

ENDLESS = b"""
int[0, 90] a, b, c, d, e;
process P(int[0, 90] &n) { state A; init A;
  trans A -> A { guard n < 90; assign n++; }, A -> A { guard n == 90; assign n = 0; }; }
P1 = P(a); P2 = P(b); P3 = P(c); P4 = P(d); P5 = P(e);
system P1, P2, P3, P4, P5;
"""


@contextlib.contextmanager
def running(limits: Limits) -> Iterator[Server]:
    server = Server(limits)
    thread = threading.Thread(target=server.serve)
    thread.start()
    try:
        yield server
    finally:
        server.close()
        thread.join(10)
    assert not thread.is_alive()


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    with running(Limits(timeout_s=20, upload_bytes=100_000, jobs=2)) as server:
        yield server


def request(
    server: Server,
    method: str,
    path: str,
    body: bytes | None = None,
    headers: dict[str, str] | None = None,
) -> tuple[int, bytes, http.client.HTTPMessage]:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    try:
        connection.request(method, path, body, {"X-Ntagen-Token": server.token, **(headers or {})})
        answer = connection.getresponse()
        return answer.status, answer.read(), answer.headers
    finally:
        connection.close()


def call(server: Server, method: str, path: str, body: bytes | None = None) -> tuple[int, Any]:
    status, data, _ = request(server, method, path, body)
    return status, json.loads(data)


def dropped(server: Server, name: str, data: bytes) -> str:
    status, told = call(server, "POST", f"/api/files?name={name}", data)
    assert status == 201, told
    return str(told["file"])


def started(server: Server, number: str, **wish: str) -> str:
    status, told = call(server, "POST", f"/api/files/{number}/jobs", json.dumps(wish).encode())
    assert status == 201, told
    return str(told["job"])


def ended(server: Server, job: str) -> dict[str, Any]:
    for _ in range(600):
        report: dict[str, Any] = call(server, "GET", f"/api/jobs/{job}")[1]
        if report["state"] != "running":
            return report
        time.sleep(0.05)
    raise AssertionError("the job does not end")


def test_only_who_has_the_address_gets_the_page(server: Server) -> None:
    path = server.address.removeprefix(f"http://127.0.0.1:{server.port}")
    assert request(server, "GET", path, headers={"X-Ntagen-Token": ""})[0] == 200
    for given in ("", "x", server.token[:-1], server.token + "x", "\u00e9"):
        status, text, _ = request(
            server, "GET", "/", headers={"X-Ntagen-Token": given.encode().decode("latin-1")}
        )
        assert status == 403
        assert b"the token is missing or wrong\nhint: open the address" in text
    assert request(server, "GET", "/?token=wrong", headers={"X-Ntagen-Token": ""})[0] == 403


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1", "evil.example:{port}", "[::1]:{port}"]
)
def test_another_name_is_refused(server: Server, host: str) -> None:
    name = {"Host": host.format(port=server.port)}
    status, text, _ = request(server, "GET", f"/?token={server.token}", headers=name)
    assert status == 421
    assert b"asked for by another name" in text
    own = {"Host": f"localhost:{server.port}"}
    assert request(server, "GET", "/", headers=own)[0] == 200


def test_another_site_is_refused(server: Server) -> None:
    for origin, expected in (
        ("http://evil.example", 403),
        ("null", 403),
        (f"https://127.0.0.1:{server.port}", 403),
        (f"http://127.0.0.1:{server.port}", 200),
    ):
        assert request(server, "GET", "/", headers={"Origin": origin})[0] == expected


def test_the_server_listens_on_this_computer_only(server: Server) -> None:
    assert server.address.startswith("http://127.0.0.1:")
    assert len(server.token) >= 32
    others = {one[4][0] for one in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)}
    for address in others - {"127.0.0.1"}:
        if not address.startswith("127."):
            with pytest.raises(OSError, match="refused"):
                socket.create_connection((address, server.port), 2)


def test_the_page_loads_nothing(server: Server) -> None:
    _, page, headers = request(server, "GET", "/")
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "connect-src 'self'" in policy
    nonce = re.search(r"script-src 'nonce-([^']+)'", policy)
    assert nonce is not None
    assert f'<script nonce="{nonce[1]}">'.encode() in page
    assert re.findall(rb"https?:|\bsrc=|\bhref=|@import|url\(", page) == []
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cache-Control"] == "no-store"
    assert request(server, "GET", "/")[1] != page


def test_a_model_is_checked(server: Server) -> None:
    number = dropped(server, "game.xta", GAME)
    report = ended(server, started(server, number, action="info"))
    assert report["answers"][0]["processes"][0]["name"] == "Main"
    query = "E<> Main.Won"
    report = ended(server, started(server, number, action="check", query=query))
    assert (report["exit"], report["answers"][0]["verdict"]) == (0, "satisfied")
    assert "Main.Start -> Middle" in report["trace"]
    query = "control: A<> Main.Won"
    report = ended(server, started(server, number, action="check", query=query))
    assert "When you are in" in report["strategy"]


@pytest.mark.slow
def test_pictures_are_drawn(server: Server) -> None:
    number = dropped(server, "game.xta", GAME)
    for wish, says in (
        ({"picture": "gantt", "query": "E<> Main.Won"}, b"Main.Middle from"),
        ({"picture": "zones", "query": "control: A<> Main.Won", "at": "Main.Middle"}, b"x >= 1"),
        ({"picture": "states"}, b"4 symbolic states"),
        ({"picture": "templates"}, b"<title>Main</title>"),
    ):
        job = started(server, number, action="plot", **wish)
        assert ended(server, job)["picture"], wish
        status, page, headers = request(server, "GET", f"/api/jobs/{job}/picture")
        assert (status, headers["Content-Type"]) == (200, "text/html; charset=utf-8")
        assert "script-src" not in headers["Content-Security-Policy"]
        status, svg, headers = request(server, "GET", f"/api/jobs/{job}/picture?file=1")
        assert (status, headers["Content-Type"]) == (200, "image/svg+xml")
        assert page.endswith(svg)
        assert says in svg.replace(b"&gt;", b">")
        assert "script-src" not in headers["Content-Security-Policy"]


@pytest.mark.slow
def test_an_environment_is_checked_and_drawn(server: Server) -> None:
    number = dropped(server, "paper.nsl", PAPER)
    report = ended(server, started(server, number, action="check"))
    assert [one["verdict"] for one in report["answers"]] == ["satisfied", "satisfied"]
    job = started(server, number, action="plot", picture="scene")
    assert ended(server, job)["picture"]
    _, page, headers = request(server, "GET", f"/api/jobs/{job}/picture")
    assert b'"name":"C1"' in page
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "connect-src" not in headers["Content-Security-Policy"]


@pytest.mark.parametrize(
    ("name", "data", "status", "says"),
    [
        (
            "picture.png",
            b"x",
            415,
            "picture.png is of no kind that is known\nhint: drop a file that",
        ),
        ("", b"x", 415, "a file without a name is of no kind"),
        ("a.xml", b"", 400, "a.xml is empty"),
        ("a.xml", b"x" * 100_001, 413, "larger than 0.0953674 MiB\nhint: start the server with"),
    ],
)
def test_wrong_files_are_refused(
    server: Server, name: str, data: bytes, status: int, says: str
) -> None:
    found, told = call(server, "POST", f"/api/files?name={name}", data)
    assert found == status
    assert says in told["error"]


def test_a_very_large_file_is_refused_in_words(server: Server) -> None:
    status, told = call(server, "POST", "/api/files?name=a.xml", bytes(30_000_000))
    assert status == 413
    assert "the file is larger than" in told["error"]


def test_a_browser_that_goes_away_leaves_no_words(
    server: Server, capsys: pytest.CaptureFixture[str]
) -> None:
    connection = socket.create_connection(("127.0.0.1", server.port), 10)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    connection.sendall(
        f"POST /api/files?name=a.xml HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n"
        f"X-Ntagen-Token: {server.token}\r\nContent-Length: 100\r\n\r\nabc".encode()
    )
    time.sleep(0.2)
    connection.close()
    time.sleep(0.2)
    assert request(server, "GET", "/")[0] == 200
    assert capsys.readouterr().err == ""


@pytest.mark.slow
def test_what_is_no_model_is_said(server: Server) -> None:
    for name, data, says in (
        ("a.xml", b"hello", "this text is not a UPPAAL model"),
        ("a.nsl", b"environment {", "error"),
        ("a.xta", b"process P( {", "error"),
        ("a.mcap", b"hello", "error"),
    ):
        action = (
            {"action": "plot", "picture": "scene"} if name.endswith("mcap") else {"action": "info"}
        )
        report = ended(server, started(server, dropped(server, name, data), **action))
        assert report["exit"] == 2
        assert says in report["message"]
        assert "Traceback" not in report["message"]


def test_a_wrong_query_is_an_answer(server: Server) -> None:
    number = dropped(server, "game.xta", GAME)
    for query, verdict in (("E<> Main.Nowhere", "refused"), ("--help", "refused")):
        report = ended(server, started(server, number, action="check", query=query))
        assert report["answers"][0]["verdict"] == verdict
        assert "error" in report["answers"][0]["message"]


@pytest.mark.parametrize(
    ("wish", "says"),
    [
        (b"[]", "no object of JSON"),
        (b"{", "no object of JSON"),
        (b'{"action": "drive"}', "has no such answer or picture"),
        (b'{"action": "plot", "picture": "../x"}', "has no such answer or picture"),
        (b'{"action": "plot", "picture": "scene"}', "has no such answer or picture"),
        (b'{"action": "check", "query": 3}', "the query is no text"),
        (b'{"action": "check", "query": " "}', "the query is no text"),
    ],
)
def test_wrong_wishes_are_refused(server: Server, wish: bytes, says: str) -> None:
    number = dropped(server, "game.xta", GAME)
    status, told = call(server, "POST", f"/api/files/{number}/jobs", wish)
    assert status == 400
    assert says in told["error"]


def test_what_is_not_there_is_said(server: Server) -> None:
    for method, path in (
        ("GET", "/api/jobs/1"),
        ("DELETE", "/api/jobs/1"),
        ("POST", "/api/files/1/jobs"),
        ("GET", "/../../etc/passwd"),
        ("GET", "/page.html"),
        ("POST", "/"),
    ):
        body = b'{"action": "info"}' if method == "POST" else None
        assert request(server, method, path, body)[0] == 404


@pytest.mark.parametrize("path", ["/", "/api/files", "/other", "/api/jobs/1"])
def test_head_is_get_without_its_content(server: Server, path: str) -> None:
    def fixed(headers: http.client.HTTPMessage) -> dict[str, str]:
        # The page has another nonce each time.
        changing = {"Date", "Content-Security-Policy"}
        return {name: value for name, value in headers.items() if name not in changing}

    expected, data, headers = request(server, "GET", path)
    status, nothing, told = request(server, "HEAD", path)
    assert (status, nothing) == (expected, b"")
    assert fixed(told) == fixed(headers)
    assert int(told["Content-Length"]) == len(data) > 0


def test_head_needs_the_token_too(server: Server) -> None:
    status, data, _ = request(server, "HEAD", "/", headers={"X-Ntagen-Token": "other"})
    assert (status, data) == (403, b"")


def test_a_connection_goes_on_after_head(server: Server) -> None:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=20)
    with contextlib.closing(connection):
        for method in ("HEAD", "GET"):
            connection.request(method, "/", headers={"X-Ntagen-Token": server.token})
            answer = connection.getresponse()
            assert (answer.status, bool(answer.read())) == (200, method == "GET")


def test_a_request_without_a_length_is_refused(server: Server) -> None:
    with socket.create_connection(("127.0.0.1", server.port), 10) as connection:
        connection.sendall(
            f"POST /api/files?name=a.xml HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n"
            f"X-Ntagen-Token: {server.token}\r\nTransfer-Encoding: chunked\r\n\r\n".encode()
        )
        assert connection.recv(100).startswith(b"HTTP/1.1 411 ")


def test_a_check_is_cancelled_and_too_many_are_refused(server: Server) -> None:
    number = dropped(server, "endless.xta", ENDLESS)
    both = [started(server, number, action="check", query="A[] a <= 90") for _ in range(2)]
    wish = json.dumps({"action": "info"}).encode()
    status, told = call(server, "POST", f"/api/files/{number}/jobs", wish)
    assert status == 429
    assert told["error"] == "2 checks run already\nhint: wait for one, or cancel it"
    workers = [server.shop.job(job)._process for job in both]
    for job in both:
        assert call(server, "GET", f"/api/jobs/{job}")[1]["state"] == "running"
        assert call(server, "DELETE", f"/api/jobs/{job}")[1]["state"] == "cancelled"
    assert all(worker.poll() is not None for worker in workers)


def test_a_search_has_limits() -> None:
    with running(Limits(timeout_s=2.0)) as server:
        number = dropped(server, "endless.xta", ENDLESS)
        report = ended(server, started(server, number, action="check", query="A[] a <= 90"))
    assert (report["exit"], report["answers"][0]["stop"]) == (3, "time")


@pytest.mark.slow
def test_a_worker_that_does_not_end_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs, "_LATE_S", -18.0)
    monkeypatch.setattr(jobs, "_LATE", -1.0)
    with running(Limits(timeout_s=20.0)) as server:
        number = dropped(server, "endless.xta", ENDLESS)
        report = ended(server, started(server, number, action="check", query="A[] a <= 90"))
    assert report["message"] == "the worker did not end within its time, and was killed"


def test_names_lead_nowhere_else(tmp_path: Path) -> None:
    shop = Workshop(Limits(files=4))
    try:
        for name in (
            "../../a.xml",
            "C:\\x\\a.xml",
            "/etc/a.xml",
            "..xml.xta",
            "-o.xml",
            "a\nb.xta",
        ):
            path = shop.file(shop.add(name, b"x")).path
            assert path.parent.parent == Path(shop._folder.name)
            assert not path.name.startswith((".", "-"))
            assert path.is_file()
        # The oldest go.
        assert len(shop._files) == 4
        with pytest.raises(Refusal, match="not kept any more"):
            shop.file("1")
    finally:
        shop.close()
    assert not Path(shop._folder.name).exists()


def test_a_query_is_never_an_option() -> None:
    file = File("a.xml", Path("a.xml"))
    arguments = arguments_for(file, {"action": "check", "query": "--help"}, Limits())
    assert "--query=--help" in arguments
    wish = {"action": "plot", "picture": "zones", "query": "q", "at": "--help"}
    assert "--at=--help" in arguments_for(file, wish, Limits())


def test_a_port_that_is_in_use_is_said(server: Server, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["serve", "--port", str(server.port)]) == 2
    said = capsys.readouterr().err
    assert f"port {server.port} is in use\nhint: choose another one with --port" in said


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nowhere.xml"], "nowhere.xml: no such file"),
        (["--port", "70000"], "70000 is not in the range"),
        (["--timeout", "soon"], "is not a time"),
        (["--memory", "4"], "4GiB"),
        ([str(ROOT / "README.md")], "README.md is of no kind that is known"),
        ([str(ROOT / "examples" / "paper.nsl"), "--upload", "64KiB"], ""),
    ],
)
def test_wrong_starts_are_refused(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    says: str,
) -> None:
    if not says:
        monkeypatch.setattr(Server, "serve", lambda _: None)
        assert main(["serve", *arguments]) == 0
        assert "open http://127.0.0.1:" in capsys.readouterr().out
        return
    assert main(["serve", *arguments]) == 2
    assert says in capsys.readouterr().err


def test_a_large_first_file_is_refused() -> None:
    server = Server(Limits(upload_bytes=10))
    try:
        with pytest.raises(InputError, match="larger than"):
            server.open("a.xml", b"x" * 11)
    finally:
        server.end()


@pytest.mark.skipif(sys.platform == "win32", reason="sends a signal of POSIX")
def test_the_command_shows_a_file_and_leaves_nothing(tmp_path: Path) -> None:
    model = tmp_path / "game.xta"
    model.write_bytes(GAME)
    process = subprocess.Popen(
        [sys.executable, "-m", "ntagen", "serve", str(model)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path)},
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    found = re.fullmatch(r"open http://127\.0\.0\.1:(\d+)/\?token=(\S+)\n", line)
    assert found is not None, line
    connection = http.client.HTTPConnection("127.0.0.1", int(found[1]), timeout=10)
    connection.request("GET", f"/api/files?token={found[2]}")
    files = json.loads(connection.getresponse().read())["files"]
    connection.close()
    assert [(one["name"], one["kind"]) for one in files] == [("game.xta", "model")]
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=20)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert list(tmp_path.glob("ntagen-serve-*")) == []
