"""A run in the browser while it goes on: what its page is told, who gets in, and its stop."""

from __future__ import annotations

import http.client
import json
import threading
import time
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from ntagen.drive.log import Log, metadata_of
from ntagen.drive.reading import read_log
from ntagen.drive.records import (
    Ended,
    Forgotten,
    Journals,
    Learned,
    Measured,
    Record,
    Transition,
)
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.errors import InputError
from ntagen.plan.synthesise import Synthesis
from ntagen.plot.run import picture_of_run
from ntagen.plot.viewer import data_of
from ntagen.scene import Scene
from ntagen.watch.feed import Feed
from ntagen.watch.pace import Pace
from ntagen.watch.server import watched
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN, PAPER

SETTINGS = Settings()
END = Ended(2.0, "target reached", "the tip is in it", 1.0, 1, 0, 1.0, 1.0)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Feed]:
    """A run that learns of a region, as a log and as a feed."""
    path = tmp_path_factory.mktemp("watch") / "run.mcap"
    feed = Feed(HIDDEN, SETTINGS)
    with Log(path, metadata_of({"settings": SETTINGS.to_json(), "seed": 1}), {}) as log:
        simulate(HIDDEN, oracle_synthesis, SETTINGS, Journals(log, feed), known="C1")
    return path, feed


def test_a_run_is_shown_as_its_log_is(run: tuple[Path, Feed]) -> None:
    path, feed = run
    logged, live = data_of(picture_of_run(read_log(path), 0)), feed.since(0)
    for part in ("moments", "log", "plans"):
        assert live[part] == logged[part], part
    assert live["ended"]
    kept = {region["name"]: region for region in live["regions"]}
    learned = {one["name"]: one for one in logged["regions"] if one["note"].endswith("learned")}
    assert set(kept) == set(learned) != set()
    assert all(kept[name]["points"] == learned[name]["points"] for name in learned)


class Asking:
    """A journal that asks a feed after each few events."""

    def __init__(self, feed: Feed) -> None:
        self._feed = feed
        self._next = 0
        self._heard = 0
        self.parts: list[dict[str, Any]] = []

    def record(self, record: Record) -> None:
        self._heard += 1
        if self._heard % 3 == 0 or isinstance(record, Ended):
            self.parts.append(self._feed.since(self._next))
            self._next = self.parts[-1]["next"]

    def started(self, scene: Scene) -> None:
        pass

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        pass


def test_parts_of_a_run_are_the_whole() -> None:
    feed = Feed(HIDDEN, SETTINGS)
    asking = Asking(feed)
    simulate(HIDDEN, oracle_synthesis, SETTINGS, Journals(feed, asking), known="C1")
    whole, moments = feed.since(0), dict[float, dict[str, Any]]()
    for part in asking.parts:
        for moment in part["moments"]:
            moments[moment["t"]] = moments.get(moment["t"], {}) | moment
    assert list(moments.values()) == whole["moments"]
    for name in ("log", "plans", "tubes"):
        assert [one for part in asking.parts for one in part[name]] == whole[name]
    ends = [part["ended"] for part in asking.parts]
    assert ends == sorted(ends)
    assert (ends[0], ends[-1]) == (False, True)
    assert feed.since(whole["next"])["moments"] == []


def test_a_learned_region_is_a_ball_until_its_shape_is_known_and_may_go() -> None:
    feed = Feed(PAPER, SETTINGS)
    feed.record(Learned(1.0, "learned 1", "critical", (1.0, 2.0, 3.0), 2.0))
    region = feed.since(0)["regions"][0]
    assert (region["name"], region["note"], region["from"]) == (
        "learned 1",
        "critical, learned",
        1.0,
    )
    feed.record(Forgotten(2.0, "learned 1", "critical"))
    assert feed.since(0)["regions"] == []
    assert feed.since(1)["forgotten"] == ["learned 1"]


def test_what_is_no_number_is_left_out() -> None:
    feed = Feed(PAPER, SETTINGS)
    feed.record(Measured(0.0, 1.0, (0.0, 0.0, 0.0), float("nan"), (), ()))
    (moment,) = feed.since(0)["moments"]
    assert "f" not in moment
    assert moment["d"] == 1.0


def test_a_simulation_keeps_the_time_of_the_run() -> None:
    must_end = threading.Event()
    pace = Pace(must_end.is_set)
    start_s = time.monotonic()
    pace.record(Transition(50.0, "arm", "armed", "estimate"))
    pace.record(Transition(50.2, "arm", "armed", "estimate"))
    assert time.monotonic() - start_s >= 0.2
    threading.Timer(0.1, must_end.set).start()
    pace.record(Transition(3600.0, "arm", "armed", "estimate"))
    assert must_end.is_set()


class Page:
    """A program that asks as a page does."""

    def __init__(self, address: str) -> None:
        self.host, _, rest = address.removeprefix("http://").partition("/")
        self.token = rest.partition("token=")[2]

    def ask(self, method: str, path: str, headers: dict[str, str] | None = None) -> tuple[int, str]:
        connection = http.client.HTTPConnection(self.host, timeout=10)
        try:
            connection.request(method, path, None, {"X-Ntagen-Token": self.token} | (headers or {}))
            answer = connection.getresponse()
            return answer.status, answer.read().decode()
        finally:
            connection.close()

    def news(self, since: int = 0) -> dict[str, Any]:
        status, text = self.ask("GET", f"/api/run?since={since}")
        assert status == 200
        news: dict[str, Any] = json.loads(text)
        return news


def test_a_page_gets_the_run_and_stops_it() -> None:
    feed, stopped = Feed(PAPER, SETTINGS), threading.Event()
    with watched(feed, stopped.set) as address:
        page = Page(address)
        status, text = page.ask("GET", "/")
        assert status == 200
        assert '"live":true' in text
        assert page.news()["next"] == 0
        feed.record(Transition(0.0, "arm", "armed", "estimate"))
        news = page.news(0)
        assert (news["next"], news["ended"]) == (1, False)
        assert news["moments"] == [{"t": 0.0, "state": "estimate"}]
        assert not stopped.is_set()
        assert page.ask("POST", "/api/stop")[0] == 200
        assert stopped.is_set()
        feed.record(END)
        assert page.news(1)["ended"]
    with pytest.raises(OSError, match="refused"):
        page.ask("GET", "/")


@pytest.mark.parametrize(
    ("method", "path", "headers", "status"),
    [
        ("GET", "/", {"X-Ntagen-Token": "guessed"}, 403),
        ("GET", "/api/run", {"X-Ntagen-Token": ""}, 403),
        ("POST", "/api/stop", {"X-Ntagen-Token": "guessed"}, 403),
        ("POST", "/api/stop", {"Origin": "http://elsewhere.example"}, 403),
        ("POST", "/api/stop", {"Host": "elsewhere.example"}, 421),
        ("GET", "/api/stop", {}, 404),
        ("DELETE", "/api/run", {}, 404),
        ("GET", "/api/files", {}, 404),
        ("GET", "/api/run?since=-1", {}, 400),
        ("GET", "/api/run?since=x", {}, 400),
        ("GET", "/api/run?since=%C2%B2", {}, 400),
        ("GET", "/api/run?since=9999999999999", {}, 400),
    ],
)
def test_others_do_not_get_in(method: str, path: str, headers: dict[str, str], status: int) -> None:
    stopped = threading.Event()
    with watched(Feed(PAPER, SETTINGS), stopped.set) as address:
        assert Page(address).ask(method, path, headers)[0] == status
    assert not stopped.is_set()


def test_the_end_is_waited_for_if_a_page_is_open() -> None:
    feed = Feed(PAPER, SETTINGS)
    with watched(feed, lambda: None) as address:
        page = Page(address)
        page.news()
        feed.record(END)
        later: list[bool] = []
        thread = threading.Timer(0.3, lambda: later.append(page.news()["ended"]))
        thread.start()
    thread.join()
    assert later == [True]


def test_nobody_is_waited_for_who_is_not_there() -> None:
    start_s = time.monotonic()
    with watched(Feed(PAPER, SETTINGS), lambda: None):
        pass
    assert time.monotonic() - start_s < 1.5


def test_a_port_in_use_is_said() -> None:
    with (
        watched(Feed(PAPER, SETTINGS), lambda: None) as address,
        pytest.raises(InputError, match="is in use"),
        watched(Feed(PAPER, SETTINGS), lambda: None, int(address.split(":")[2].split("/")[0])),
    ):
        pass


def test_a_run_that_is_shown_ends_as_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # A run takes more than a minute.
    monkeypatch.setattr(Pace, "record", lambda *_: None)
    task, log = Path(__file__).parents[3] / "examples" / "paper.nsl", tmp_path / "run.mcap"
    assert main(["drive", str(task), "--view", "--json", "--log", str(log)]) == 0
    said = capsys.readouterr()
    assert json.loads(said.out)["outcome"] == "target reached"
    assert "note: the run is shown at http://127.0.0.1:" in said.err
    assert read_log(log).records[-1].time_s > 0.0
