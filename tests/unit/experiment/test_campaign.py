"""Campaigns in this process: the table, going on, and what a folder is refused for."""

from __future__ import annotations

import json
import math
import resource
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from ntagen.cluster import workers
from ntagen.drive.reading import read_log
from ntagen.drive.replay import replay
from ntagen.drive.simulate import synthesiser_for
from ntagen.errors import InputError
from ntagen.experiment import making, store
from ntagen.experiment.campaign import Progress, carry_out
from ntagen.experiment.crew import Done, Here
from ntagen.experiment.making import Block, make_block
from ntagen.experiment.reading import read_experiment
from ntagen.experiment.report import report_of
from ntagen.experiment.table import timeless
from tests.unit.experiment.files import QUICK, written


class Backwards(Here[Block]):
    """Takes all blocks, and makes the last one first; counts the runs."""

    has_room = True
    size = 5

    def __init__(self) -> None:
        super().__init__()
        self.seeds: list[tuple[str, int]] = []

    def wait(self) -> list[Done[Block]]:
        block = self._jobs.pop()
        self.seeds += [(block.row.id, seed) for seed in block.seeds]
        return [Done(block, make_block(block))]


def made(tmp_path: Path, folder: str = "x", **options: Any) -> Mapping[str, Any]:  # noqa: ANN401
    """The table of the quick experiment."""
    experiment = read_experiment(written(tmp_path))
    return carry_out(experiment, tmp_path / folder, options.pop("crew", Here), **options).document


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Mapping[str, Any]]:
    """A folder with the quick experiment, and its table."""
    place = tmp_path_factory.mktemp("whole")
    return place / "x", made(place)


def test_the_table_has_rates_and_spreads(whole: tuple[Path, Mapping[str, Any]]) -> None:
    folder, document = whole
    blocked, free = document["rows"]
    assert (blocked["runs"], blocked["reached"], blocked["hits"]) == (3, 0, 0)
    assert (free["runs"], free["reached"], free["reach_rate"]) == (2, 2, 1.0)
    assert free["reach_low"] == pytest.approx(0.158114, abs=1e-5)
    assert blocked["outcomes"] == {"no strategy": 3}
    assert free["clearance_mm"] is None
    assert blocked["clearance_mm"]["min"] > 0.0
    assert free["adjustments"] == {"min": 0, "avg": 0.0, "max": 0}
    assert json.loads((folder / "table.json").read_bytes()) == json.loads(json.dumps(document))
    lines = (folder / "table.csv").read_text("utf-8").splitlines()
    assert lines[0].startswith("id,scenario,known,needle,speed,settings.noise,")
    assert len(lines) == 3


@pytest.mark.slow
def test_sections_drawn_beside_the_runs_are_those_of_the_whole_table(tmp_path: Path) -> None:
    experiment = read_experiment(written(tmp_path))
    made = carry_out(experiment, tmp_path / "x", Backwards)
    assert set(made.sections) == {"blocked", "free"}
    text = (tmp_path / "x" / "report.html").read_text("utf-8")
    assert text == report_of(made.document, made.scenes)


def test_each_run_says_each_synthesis_and_has_its_log(
    whole: tuple[Path, Mapping[str, Any]],
) -> None:
    folder, document = whole
    runs = document["runs"]
    assert [(run["row"], run["seed"]) for run in runs] == [
        ("blocked", 1),
        ("blocked", 2),
        ("blocked", 3),
        ("free", 4),
        ("free", 7),
    ]
    for run in runs:
        assert set(run["syntheses"][0]) == {"found", "hold", "engine_s", "loop_s"}
        log = read_log(folder / run["log"])
        assert log.metadata["seed"] == str(run["seed"])
        assert replay(log, synthesiser_for(log.settings)).is_same
    assert not list((folder / "runs").glob(".*"))


def test_the_order_of_blocks_changes_nothing(
    whole: tuple[Path, Mapping[str, Any]], tmp_path: Path
) -> None:
    assert timeless(made(tmp_path, crew=Backwards)) == timeless(whole[1])


def test_an_experiment_goes_on_without_repeating_or_losing_runs(
    whole: tuple[Path, Mapping[str, Any]], tmp_path: Path
) -> None:
    class Interrupted(Backwards):
        def wait(self) -> list[Done[Block]]:
            if len(self.seeds) >= 3:
                raise KeyboardInterrupt
            return super().wait()

    first, second = Interrupted(), Backwards()
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path, crew=lambda: first)
    document = made(tmp_path, crew=lambda: second, resume=True)
    assert len(first.seeds) == 3
    assert set(first.seeds).isdisjoint(second.seeds)
    assert timeless(document) == timeless(whole[1])


@pytest.mark.slow
def test_torn_lines_and_lost_logs_are_made_again(
    whole: tuple[Path, Mapping[str, Any]], tmp_path: Path
) -> None:
    made(tmp_path)
    file = next((tmp_path / "x" / "results").glob("free-7-*.jsonl"))
    file.write_bytes(file.read_bytes()[:-20])
    (tmp_path / "x" / "runs" / "blocked-2.mcap").unlink()
    (tmp_path / "x" / "runs" / ".blocked-2.0123.part").write_bytes(b"left over")
    crew = Backwards()
    document = made(tmp_path, crew=lambda: crew, resume=True)
    assert sorted(crew.seeds) == [("blocked", 2), ("free", 7)]
    assert timeless(document) == timeless(whole[1])
    assert not list((tmp_path / "x" / "runs").glob(".*"))


def test_more_runs_can_be_added(tmp_path: Path) -> None:
    file = written(tmp_path, '[[row]]\nscenario = "large_mid_cr.nsl"\nseeds = 2\n')
    carry_out(read_experiment(file), tmp_path / "x", Here)
    crew = Backwards()
    document = carry_out(
        read_experiment(file, 3), tmp_path / "x", lambda: crew, resume=True
    ).document
    assert crew.seeds == [("large_mid_cr", 3)]
    assert document["rows"][0]["runs"] == 3


@pytest.mark.slow
def test_a_finished_experiment_needs_nobody(tmp_path: Path) -> None:
    made(tmp_path)

    def nobody() -> Here:
        raise AssertionError

    made(tmp_path, crew=nobody, resume=True)


def test_what_ended_before_its_first_run_leaves_no_claim(tmp_path: Path) -> None:
    def nobody() -> Here:
        raise InputError("nobody is there")

    with pytest.raises(InputError, match="nobody is there"):
        made(tmp_path, crew=nobody)
    assert len(made(tmp_path)["runs"]) == 5


@pytest.mark.slow
def test_a_folder_with_an_experiment_is_refused(tmp_path: Path) -> None:
    made(tmp_path)
    with pytest.raises(InputError, match=r"holds an experiment already\nhint: .*--resume"):
        made(tmp_path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("0.1 mm", "0.2 mm", "row blocked or its scene has changed"),
        ('id = "free"', 'id = "other"', "row other is not in it"),
    ],
)
def test_a_folder_of_another_file_is_refused(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    made(tmp_path)
    changed = read_experiment(written(tmp_path, QUICK.replace(old, new)))
    with pytest.raises(InputError, match=f"holds another experiment: {message}"):
        carry_out(changed, tmp_path / "x", Here, resume=True)


def test_a_folder_of_another_version_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made(tmp_path)
    monkeypatch.setattr(store, "identity", lambda: "9.9.9")
    with pytest.raises(InputError, match=r"made by another version of ntagen(.|\n)*9\.9\.9"):
        made(tmp_path, resume=True)


def test_a_worker_of_another_version_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workers, "identity", lambda: "9.9.9")
    with pytest.raises(InputError, match=r"a worker has another version of ntagen: 9\.9\.9"):
        made(tmp_path)


def test_two_experiments_in_one_folder_are_refused(tmp_path: Path) -> None:
    experiment = read_experiment(written(tmp_path))
    with (
        store.taken(tmp_path / "x", experiment, resume=False),
        pytest.raises(InputError, match="another experiment is running in"),
    ):
        made(tmp_path, resume=True)


@pytest.mark.slow
def test_a_full_disk_is_told_and_loses_nothing(
    whole: tuple[Path, Mapping[str, Any]], tmp_path: Path
) -> None:
    sizes = {path.name: path.stat().st_size for path in (whole[0] / "runs").iterdir()}
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    # The logs of the row that is blocked are small.
    limit = (max(sizes["blocked-1.mcap"], sizes["blocked-3.mcap"]) + sizes["free-4.mcap"]) // 2
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, old[1]))
    try:
        with pytest.raises(
            InputError, match=r"the log .*mcap: file too large\nhint: make room.*--resume"
        ):
            made(tmp_path)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
    crew = Backwards()
    document = made(tmp_path, crew=lambda: crew, resume=True)
    assert sorted(crew.seeds) == [("free", 4), ("free", 7)]
    assert timeless(document) == timeless(whole[1])


def test_a_driver_that_breaks_is_a_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("by nothing")

    monkeypatch.setattr(making, "simulate", broken)
    document = made(tmp_path)
    assert document["rows"][0]["outcomes"] == {"failed": 3}
    assert document["rows"][1]["reach_rate"] == 0.0
    assert document["runs"][0]["reason"] == "ZeroDivisionError: by nothing"


def test_progress_counts_to_the_end(tmp_path: Path) -> None:
    seen: list[Progress] = []
    made(tmp_path, notify=seen.append, logs=False)
    assert (seen[0].done, seen[-1].done, seen[-1].of, seen[-1].reached) == (0, 5, 5, 2)
    assert not list((tmp_path / "x" / "runs").iterdir())
    made(tmp_path, notify=seen.append, logs=False, resume=True)
    last = seen[-1]
    assert (last.before, last.done, last.reached, last.hits) == (5, 5, 2, 0)


def test_what_is_true_is_computed_from_the_path_of_the_needle(tmp_path: Path) -> None:
    """The tip as the log has it is where the record says, and comes no nearer to a region."""
    text = '[[row]]\nscenario = "small_mid_cr.nsl"\nnoise = 0.5\nseeds = 2\nknown = "none"\n'
    file = written(tmp_path, text)
    document = carry_out(read_experiment(file), tmp_path / "x", Here).document
    for run in document["runs"]:
        log = read_log(tmp_path / "x" / run["log"])
        tips = [r.position_mm for r in log.records if type(r).__name__ == "Truth"]
        nearest_mm = min(math.dist(tip, (0.0, -26.0, 0.0)) for tip in tips) - 3.0
        # Between two measurements, the tip moves by 0.25 mm.
        assert run["clearance_mm"] <= nearest_mm + 1e-9 <= run["clearance_mm"] + 0.13
        end_mm = math.dist(tips[-1], (0.0, -50.0, 0.0)) - 8.0
        assert run["target_mm"] == pytest.approx(end_mm, abs=1e-9)
        assert min(run["profile"]["distance_mm"]) >= run["clearance_mm"] - 1e-3


def test_a_driver_that_neither_knows_nor_feels_a_region_hits_it(tmp_path: Path) -> None:
    text = (
        '[[row]]\nscenario = "large_mid_cr.nsl"\nseeds = 1\nknown = "none"\n'
        'drive = { "force sensing" = "off" }\n'
    )
    file = written(tmp_path, text)
    row, run = (
        made[0]
        for campaign in [carry_out(read_experiment(file), tmp_path / "x", Here, logs=False)]
        for made in (campaign.table, campaign.runs)
    )
    # The driver believes that all is well.
    assert run["outcome"] == "target reached"
    assert (row["reached"], row["hits"], row["hit_rate"]) == (1, 1, 1.0)
    # The path goes through the ball, whose radius is 18 mm.
    assert -18.0 <= run["clearance_mm"] < -3.0
    assert min(run["profile"]["distance_mm"]) == pytest.approx(run["clearance_mm"], abs=0.5)
