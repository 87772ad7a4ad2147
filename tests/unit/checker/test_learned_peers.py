"""Files of learned strategies, and the output about them, read by programs that others wrote.

The peers are stratetrees, which reads the files of UPPAAL, and strategoutil, which runs
``verifyta``: ``pip install stratetrees joblib strategoutil``.
"""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pytest

from tests.unit.checker.test_learned import ACTIONS, MOVES, QUERY, SHOP, loaded, random_file


@pytest.mark.parametrize("has_locations", [True, False], ids=["locations", "points"])
def test_stratetrees_reads_the_same_values(tmp_path: Path, has_locations: bool) -> None:
    pytest.importorskip("joblib", reason="needs joblib, which stratetrees needs")
    models = pytest.importorskip("stratetrees.models", reason="needs stratetrees")
    draw = random.Random(3)
    file = random_file(draw, minimises=True)
    known = list(file["regressors"].values())
    # It takes integers in keys only, and no tree that is a single leaf.
    for one in known:
        for number, tree in one["regressor"].items():
            if not isinstance(tree, dict):
                one["regressor"][number] = {"var": 1, "bound": 3.5, "low": tree, "high": tree + 0.5}
    file["statevars"] = ["P.location"] if has_locations else []
    keys = ["(0)", "(1)"] if has_locations else ["(1)"]
    file["regressors"] = dict(zip(keys, known, strict=False))
    strategy = loaded(tmp_path, file, MOVES)
    strategy.save(tmp_path / "s.json")
    peer = models.QTree(str(tmp_path / "s.json"))
    for _ in range(2_000):
        discrete = [draw.randrange(2)] if has_locations else []
        continuous = [draw.uniform(0, 8), draw.uniform(0, 8)]
        values = peer.predict_qs([*discrete, *continuous])
        tried = {int(one) for one in file["regressors"][keys[sum(discrete)]]["regressor"]}
        enabled = [number in tried for number in range(len(ACTIONS))]
        decided = strategy.decide(discrete, continuous, enabled)
        assert decided is not None
        worth = {int(one): value for one, value in zip(peer.actions, values, strict=True)}
        assert worth[decided] == min(worth[one] for one in tried)


@pytest.mark.skipif(sys.platform == "win32", reason="the peer needs a shell")
def test_strategoutil_learns_saves_and_reads_the_success(tmp_path: Path) -> None:
    peer = pytest.importorskip("strategoutil", reason="needs strategoutil")
    (tmp_path / "shop.xta").write_text(SHOP)
    (tmp_path / "shop.q").write_text(
        f'{QUERY}\nsaveStrategy("s.json", S)\nstrategy T = loadStrategy("s.json")\n'
        "E[<=1; 100](max: cost) under T\n"
    )
    arguments = {
        "good-runs": 100,
        "total-runs": 100,
        "runs-pr-state": 100,
        "eval-runs": 1,
        "max-iterations": 1,
        "learning-method": 4,
        "filter": 0,
        "silence-progress": "",
    }
    command = f"cd '{tmp_path}' && '{sys.executable}' -m ntagen verifyta"
    said, errors = peer.run_stratego("shop.xta", "shop.q", arguments, command)
    assert errors == ""
    assert peer.successful_result(said)
    assert said.count("-- Formula is satisfied.") == 4
    assert " -- Result: (101 runs)\nLearning statistics for best strategy: \n" in said
    assert (tmp_path / "s.json").exists()
