"""The report of a run: its facts, its page, and what is checked again."""

from __future__ import annotations

import gzip
import hashlib
import json
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from ntagen.drive.log import Log, metadata_of
from ntagen.drive.reading import RunLog, read_log
from ntagen.drive.records import Advised, Foreseen, Measured, Synthesised, Truth
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.errors import DeviceError, InputError
from ntagen.needle.virtual import VirtualNeedle
from ntagen.report.charts import BOTTOM, LEFT, RIGHT, TOP, Curve, chart_of, thinned, ticks
from ntagen.report.checking import Check, checks_of
from ntagen.report.facts import facts_of, verdict_of
from ntagen.report.page import page_of
from ntagen.report.told import chance_text, events_of
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN

PAPER = Path(__file__).parents[3] / "examples" / "paper.nsl"


def driven(path: Path, *options: str) -> RunLog:
    assert main(["drive", *options, "--quiet", "--log", str(path)]) == 0
    return read_log(path)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> RunLog:
    """A run of the virtual needle, with all regions known."""
    return driven(tmp_path_factory.mktemp("plain") / "run.mcap", str(PAPER))


@pytest.fixture(scope="module")
def hidden(tmp_path_factory: pytest.TempPathFactory) -> RunLog:
    """A run of the phantom needle, which feels what it was not told."""
    path = tmp_path_factory.mktemp("hidden") / "run.mcap"
    return driven(path, str(PAPER), "--needle", "phantom", "--known", "none", "--seed", "1")


@pytest.fixture(scope="module")
def facts(hidden: RunLog) -> dict[str, Any]:
    return facts_of(hidden)


@pytest.fixture(scope="module")
def page(hidden: RunLog, facts: dict[str, Any]) -> str:
    return page_of(hidden, facts)


class Page(HTMLParser):
    """The addresses that a page names, its open elements, and its text without styles."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.tags: list[str] = []
        self.text = ""
        self._in_style = False
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self._in_style = tag == "style"
        names = ("src", "href", "xlink:href", "data", "action")
        self.addresses += [value or "" for name, value in attrs if name in names]

    def handle_endtag(self, tag: str) -> None:
        self._in_style = False

    def handle_data(self, data: str) -> None:
        if not self._in_style:
            self.text += data


def test_the_facts_have_a_format_and_are_plain_json(facts: dict[str, Any]) -> None:
    assert (facts["format"], facts["version"]) == ("ntagen-report", 1)
    assert json.loads(json.dumps(facts, allow_nan=False)) == facts
    assert facts["checks"] is facts["holds"] is None


def test_the_facts_name_the_task_and_its_regions(facts: dict[str, Any]) -> None:
    task = facts["task"]
    assert (task["name"], task["file"], task["known"]) == ("paper", "paper.nsl", "none")
    assert task["text"] == PAPER.read_text()
    assert task["limits"]["roll_angles_deg"] == [90.0, 180.0, 270.0]
    known = {one["name"]: one["known"] for one in task["regions"]}
    assert known["T1"] == "told"
    assert known["C1"] == "not told"
    assert known["learned 1"] == "learned"
    target = task["regions"][0]
    assert (target["low_mm"], target["high_mm"]) == ([-10, -60, -10], [10, -40, 10])


def test_the_facts_say_how_the_needle_was_measured(facts: dict[str, Any]) -> None:
    assert facts["needle"]["is_simulated"]
    assert facts["needle"]["phantom"]["sensing.noise_mm"] == 0.08
    rows = {one["name"]: one for one in facts["measuring"]}
    assert rows["tracker"]["value"] == "the needle measures itself"
    assert rows["noise of a position"]["origin"] == "follows from the scene and the needle"
    settings = {one["words"]: one for one in facts["settings"]}
    assert (settings["pull"]["shown"], settings["pull"]["origin"]) == ("10 mm", "default")
    assert settings["force"]["origin"] == "follows from the scene and the needle"


def test_the_facts_have_each_synthesis(hidden: RunLog, facts: dict[str, Any]) -> None:
    records = [record for record in hidden.records if isinstance(record, Synthesised)]
    rows = facts["syntheses"]
    assert [row["number"] for row in rows] == [record.number for record in records]
    first = rows[0]
    assert first["plan"] == records[0].plan
    assert first["clearance_mm"] is None  # no critical region was known then
    assert first["margins"]["depth_mm"] == 0.3
    assert first["target_depth_mm"] > 0.3
    assert 0.0 < first["engine_s"] < first["whole_s"]
    seen = next(record for record in hidden.records if isinstance(record, Foreseen))
    assert first["confidence"] == seen.confidence
    none = next(row for row in rows if row["plan"] is None)
    assert (none["found"], none["clearance_mm"], none["confidence"]) == (0, None, None)


def test_the_events_are_in_time_order_and_say_why(facts: dict[str, Any]) -> None:
    events = facts["events"]
    times = [event["time_s"] for event in events]
    assert times == sorted(times)
    kinds = {event["kind"] for event in events}
    assert {"relied on", "synthesis", "learned", "stop", "pull back", "roll", "end"} <= kinds
    stop = next(event for event in events if event["kind"] == "stop")
    assert re.fullmatch(r"the force rises: stop \(the last reading is [\d.]+ N\)", stop["text"])
    assert events[0]["kind"] == "relied on"
    assert events[-1]["text"].startswith("target reached: ")


def test_all_advice_of_a_policy_is_told(plain: RunLog) -> None:
    advice = Advised(1.0, 2.0, "push", "policy", "as planned")
    events = events_of(replace(plain, records=(advice,)))
    assert events[0]["kind"] == "advice"
    assert events[0]["text"] == "2.00 mm deep: the policy says push: as planned"


def test_the_end_has_errors_and_margins(facts: dict[str, Any]) -> None:
    assert facts["end"]["outcome"] == "target reached"
    errors = {one["tip"]: one for one in facts["errors"]}
    assert set(errors) == {"true", "measured", "estimated"}
    assert errors["true"]["outside_mm"] == pytest.approx(errors["true"]["to_middle_mm"] - 10.0)
    margins = {one["region"]: one for one in facts["margins"]}
    assert margins["learned 1"]["learned"]
    assert margins["C1"]["by"] == "true"
    # Between two looks the needle may be nearer, by less than the way between them.
    assert 0.0 <= margins["C1"]["margin_mm"] - facts["true_clearance_mm"] < 0.25
    assert facts["deviation"]["greatest_mm"] == max(facts["series"]["deviation"]["deviation_mm"])


def test_the_digests_are_those_of_the_files(hidden: RunLog, facts: dict[str, Any]) -> None:
    data = hidden.path.read_bytes()
    assert facts["log"]["sha256"] == hashlib.sha256(data).hexdigest()
    assert facts["log"]["bytes"] == len(data)
    found = {one["name"]: one["sha256"] for one in facts["inputs"] if one["in_log"]}
    assert found == {
        name: hashlib.sha256(part).hexdigest() for name, part in hidden.attachments.items()
    }
    assert {"scene.nsl", "scene.json", "rebuild-0001/plans.json"} <= found.keys()


def test_the_page_loads_nothing_and_shows_all(page: str, facts: dict[str, Any]) -> None:
    read = Page(page)
    assert [one for one in read.addresses if not one.startswith("#")] == []
    assert not {"script", "link", "img", "iframe", "object"} & set(read.tags)
    assert "default-src 'none'" in page
    assert re.search(r"url\((?!#)|@import", page) is None
    assert read.tags.count("svg") == 4
    for said in ("depth [mm]", "force [N]", "deviation [mm]", "time [s]", "learned 1", "--verify"):
        assert said in read.text
    assert all(one["sha256"] in read.text for one in facts["inputs"])
    assert all(one["text"] in read.text for one in facts["events"])
    assert "cut off" not in read.text


def test_names_from_a_log_are_text_on_the_page(plain: RunLog) -> None:
    metadata = plain.metadata | {"environment": "<script>alert(1)</script>.nsl"}
    log = replace(plain, metadata=metadata)
    page = page_of(log, facts_of(log))
    assert page_of(log, facts_of(log)) == page
    assert "<script" not in page
    assert "&lt;script&gt;" in page


def test_a_torn_log_is_reported_as_torn(hidden: RunLog, tmp_path: Path) -> None:
    data = hidden.path.read_bytes()
    path = tmp_path / "torn.mcap"
    # A third of a log, and more up to a reading that comes after an estimate.
    for share in range(33, 60):
        path.write_bytes(data[: len(data) * share // 100])
        if isinstance(read_log(path).records[-1], Measured | Truth):
            break
    log = read_log(path)
    facts = facts_of(log, list(checks_of(log)))
    assert not facts["log"]["is_whole"]
    assert facts["end"] is None
    assert facts["holds"]
    times_s = {one["tip"]: one["time_s"] for one in facts["errors"]}
    assert times_s["estimated"] < times_s["measured"] == facts["log"]["last_s"]
    assert "all logged" in facts["checks"][0]["about"]
    page = Page(page_of(log, facts))
    assert page.text.index("The log is cut off") < page.text.index("The run in short")
    assert f"byte {log.torn_at_byte} of {path.stat().st_size}" in page.text


def test_a_run_that_ends_in_a_fault_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Broken(VirtualNeedle):
        """A needle whose cable is pulled."""

        def push(self, length_mm: float) -> None:
            if self.now_s() > 12.0:
                raise DeviceError("the cable <is> pulled")
            super().push(length_mm)

    monkeypatch.setattr("ntagen.drive.simulate.VirtualNeedle", Broken)
    path = tmp_path / "run.mcap"
    with Log(path, metadata_of({"settings": Settings().to_json()}), {}) as log:
        simulate(HIDDEN, oracle_synthesis, Settings(), log, known="C1")
    run = read_log(path)
    facts = facts_of(run)
    assert facts["end"]["outcome"] == "device fault"
    abort = next(event for event in facts["events"] if event["kind"] == "abort")
    assert abort["text"].startswith("device fault in the state '")
    page = Page(page_of(run, facts))
    assert "paper: device fault" in page.text
    assert "the cable <is> pulled" in page.text
    assert "The log does not have the text of the task" in page.text


def test_a_log_without_a_scene_is_refused(plain: RunLog) -> None:
    with pytest.raises(InputError, match=r"scene\.json"):
        facts_of(replace(plain, attachments={}))


def test_plans_that_are_none_are_refused(plain: RunLog) -> None:
    attachments = plain.attachments | {"rebuild-0001/plans.json": b'{"plans": 3}'}
    with pytest.raises(InputError, match=r"rebuild-0001/plans\.json cannot be read"):
        facts_of(replace(plain, attachments=attachments))


def test_an_unchanged_run_holds(hidden: RunLog) -> None:
    checks = list(checks_of(hidden))
    assert verdict_of(checks) is True
    assert checks[0].what == "decisions"
    results = {check.what: check.result for check in checks}
    assert results["synthesis 1: model"] == "holds"
    assert results["synthesis 1: strategy"] == "holds"
    assert results["synthesis 1: plans"] == "holds"
    # The fourth synthesis found no plan, so there is no strategy.
    assert results["synthesis 4: strategy"] == "not in the log"


def faulty(log: RunLog) -> Iterator[Check]:
    return (check for check in checks_of(log) if check.result == "does not hold")


def changed(log: RunLog, name: str, old: bytes, new: bytes) -> RunLog:
    data = log.attachments[name]
    assert old in data
    return replace(log, attachments=log.attachments | {name: data.replace(old, new, 1)})


def test_a_changed_plan_does_not_hold(plain: RunLog) -> None:
    log = changed(plain, "rebuild-0001/plans.json", b'"push_mm": 16.0', b'"push_mm": 17.0')
    (check,) = faulty(log)
    assert check.what == "synthesis 1: plans"
    assert "another certificate" in check.about
    assert "the record has 'push 16 mm, roll 180 deg" in check.about


def test_a_plan_that_pierces_a_region_does_not_hold(plain: RunLog) -> None:
    text = plain.attachments["rebuild-0002/plans.json"]
    document = json.loads(text)
    document["plans"][0]["actions"] = [{"push_mm": 20.0}]
    attachments = plain.attachments | {"rebuild-0002/plans.json": json.dumps(document).encode()}
    (check,) = faulty(replace(plain, attachments=attachments))
    assert "plan 1 does not hold in exact kinematics" in check.about


def test_a_changed_model_does_not_hold(plain: RunLog) -> None:
    log = changed(plain, "rebuild-0001/model.xml", b"const int", b"const  int")
    (check,) = faulty(log)
    assert check.what == "synthesis 1: model"


def test_a_changed_strategy_does_not_hold(plain: RunLog) -> None:
    name = "rebuild-0001/strategy.json.gz"
    document = json.loads(gzip.decompress(plain.attachments[name]))
    text = json.dumps(document | {"query": "control: A<> false"})
    packed = plain.attachments | {name: gzip.compress(text.encode())}
    (check,) = faulty(replace(plain, attachments=packed))
    assert check.what == "synthesis 1: strategy"
    (check,) = faulty(replace(plain, attachments=plain.attachments | {name: b"no gzip"}))
    assert check.about == "it is damaged"


def test_a_changed_measurement_does_not_hold(plain: RunLog) -> None:
    place = next(
        i for i, r in enumerate(plain.records) if isinstance(r, Measured) and r.time_s > 4.0
    )
    measured = plain.records[place]
    assert isinstance(measured, Measured)
    x, y, z = measured.position_mm
    moved = replace(measured, position_mm=(x + 0.5, y, z))
    records = (*plain.records[:place], moved, *plain.records[place + 1 :])
    (check,) = faulty(replace(plain, records=records))
    assert check.what == "decisions"
    assert "a different decision" in check.about


def test_a_verdict_needs_every_check() -> None:
    good, lost = Check("a", "holds", ""), Check("b", "not in the log", "")
    bad, open_ = Check("c", "does not hold", ""), Check("d", "not covered", "")
    assert verdict_of([good, lost]) is True
    assert verdict_of([good, open_]) is None
    assert verdict_of([good, open_, bad]) is False


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.0, "1"),
        (0.99999999, "more than 0.9999"),
        (0.98765432, "0.9877"),
        (1e-9, "less than 0.0001"),
        (0.0, "0"),
    ],
)
def test_a_probability_is_not_rounded_to_certainty(value: float, text: str) -> None:
    assert chance_text(value) == text


@pytest.mark.parametrize("high", [1e-6, 0.3, 1.5, 7.0, 99.0, 120.0, 12345.0])
def test_ticks_are_few_and_cover_the_values(high: float) -> None:
    found = ticks(0.0, high, 5)
    assert 2 <= len(found) <= 7
    assert found[0] == 0.0
    assert found[-1] >= high


def test_a_chart_stays_in_its_frame_and_its_numbers_apart() -> None:
    curve = Curve("force", "N", [0.0, 1.0, 2.0, 9.0, 10.0], [0.5, -2.0, 0.7, 0.9, 3.3], limit=4.0)
    chart = chart_of(curve, 10.0, [5.0, 5.0])
    places = [tuple(map(float, one[1:].split())) for one in re.findall(r"[ML][^ML]+", chart.path)]
    assert all(LEFT <= x <= RIGHT and TOP <= y <= BOTTOM for x, y in places)
    # Nothing was measured from 2 s to 9 s.
    assert chart.path.count("M") == 2
    assert len(chart.marks) == 1
    for ticks_, least in ((chart.times, 40.0), (chart.levels, 14.0)):
        ats = sorted(one.at for one in ticks_)
        assert all(b - a >= least for a, b in pairwise(ats))


def test_a_curve_may_have_no_gaps() -> None:
    chart = chart_of(Curve("depth", "mm", [0.0, 99.0], [0.0, 9.0], longest_s=math.inf), 99.0, [])
    assert re.fullmatch(r"M[\d. ]+ L[\d. ]+", chart.path)


def test_a_long_curve_keeps_its_peaks() -> None:
    points = [(float(i), 100.0 if i == 7777 else float(i % 3)) for i in range(20_000)]
    kept = thinned(points, 1200)
    assert len(kept) <= 1300
    assert (7777.0, 100.0) in kept
    assert kept == sorted(kept)
