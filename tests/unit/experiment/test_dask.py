"""Campaigns on a Dask cluster on loopback."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ntagen import cli
from ntagen.errors import InputError
from ntagen.experiment.campaign import carry_out
from ntagen.experiment.crew import Done, Here
from ntagen.experiment.dask_crew import DaskCrew
from ntagen.experiment.reading import read_experiment
from ntagen.experiment.scripting import campaign
from ntagen.experiment.table import timeless
from tests.clusters import local_cluster
from tests.unit.experiment.files import written

TEXT = '[[row]]\nscenario = ["large_mid_cr.nsl", "no_cr.nsl"]\nnoise = 0.1\nseeds = 6\n'


@pytest.fixture
def cluster() -> Iterator[Any]:
    """A cluster with two worker processes."""
    with local_cluster() as found:
        yield found


class Losing(DaskCrew):
    """Kills a worker in the middle of its first run."""

    def __init__(self, address: str, runs: Path) -> None:
        super().__init__(address)
        self._runs = runs
        self.killed = 0

    def wait(self) -> list[Done]:
        if not self.killed:
            self.killed = next(iter(self._client.run(os.getpid).values()))
            pause = threading.Event()
            while not any(self._runs.glob(".*.part")):
                pause.wait(0.01)
            os.kill(self.killed, signal.SIGKILL)
        return super().wait()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_lost_worker_changes_nothing(tmp_path: Path, cluster: Any) -> None:  # noqa: ANN401
    experiment = read_experiment(written(tmp_path, TEXT))
    crews: list[Losing] = []

    def crew() -> Losing:
        crews.append(Losing(cluster.scheduler_address, tmp_path / "x" / "runs"))
        return crews[0]

    made = carry_out(experiment, tmp_path / "x", crew)
    assert crews[0].killed
    assert made.document["lost"] == []
    here = carry_out(experiment, tmp_path / "here", Here)
    assert timeless(made.document) == timeless(here.document)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_workers_of_another_version_are_refused(tmp_path: Path, cluster: Any) -> None:  # noqa: ANN401
    file = written(tmp_path, TEXT)
    from distributed import Client

    with Client(cluster, set_as_default=False) as client:
        other = "import ntagen.cluster.workers as m; m.identity = lambda: '9.9.9'"
        client.run(exec, other, workers=[next(iter(client.nthreads()))])
    with pytest.raises(InputError, match=r"has another version of ntagen: 9\.9\.9(.|\n)*hint: "):
        campaign(file, dask=cluster.scheduler_address, folder=tmp_path / "x")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_policies_are_the_same_on_a_cluster(tmp_path: Path, cluster: Any) -> None:  # noqa: ANN401
    address, tables = cluster.scheduler_address, []
    for name, where in (("cluster", ["--dask", address]), ("here", ["--workers", "1"])):
        folder = tmp_path / name
        words = ["policies", "--random", "3", "--runs", "200", *where, "-o", str(folder)]
        assert cli.main(words) == 0
        rows = json.loads((folder / "table.json").read_text("utf-8"))["rows"]
        tables.append([row | {"seconds": 0.0} for row in rows])
        assert (folder / "random_1.policy.json").exists()
    assert tables[0] == tables[1]


@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="needs ntagen[cluster]")
    monkeypatch.setattr("ntagen.cluster.workers.CONNECT_S", 0.2)
    with pytest.raises(InputError, match=r"there is no Dask scheduler at tcp://127\.0\.0\.1:9"):
        campaign(written(tmp_path), dask="tcp://127.0.0.1:9", folder=tmp_path / "x")


def test_what_is_no_address(tmp_path: Path) -> None:
    pytest.importorskip("distributed", reason="needs ntagen[cluster]")
    with pytest.raises(InputError, match="'rubbish' is no address of a Dask scheduler"):
        campaign(written(tmp_path), dask="rubbish", folder=tmp_path / "x")


def test_without_dask_there_is_a_hint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"hint: pip install 'ntagen\[cluster\]'"):
        campaign(written(tmp_path), dask="tcp://127.0.0.1:9", folder=tmp_path / "x")


def test_a_cluster_has_its_own_workers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(InputError, match="a cluster has its own workers"):
        campaign(written(tmp_path), dask="tcp://127.0.0.1:9", workers=2, folder=tmp_path / "x")
    both = ["--dask", "tcp://127.0.0.1:9", "--workers", "2"]
    assert cli.main(["policies", "--random", "1", *both]) == 2
    assert "a cluster has its own workers" in capsys.readouterr().err
