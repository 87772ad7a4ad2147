"""Drives with a policy: who decides, what the log says of it, and that replays decide the same."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from ntagen import cli
from ntagen.drive.reading import RunLog, read_log
from ntagen.drive.records import Advised, Command
from ntagen.nsl import loads
from ntagen.plan.actions import Plan, Push, Roll
from ntagen.plan.policy import CONTINUOUS, DISCRETE, Policy, digest_of
from ntagen.plan.steering import around_of
from ntagen.render import Seen
from ntagen.scene import Scene
from ntagen.units import rad_from_deg

CHANCE = Path(__file__).parents[2] / "examples" / "chance" / "chance.nsl"
HALF_TURN = Roll(rad_from_deg(180.0))
PLAN = Plan.of([HALF_TURN, Push(18.0), HALF_TURN, Push(32.0)])
SCENE: Scene = loads(CHANCE.read_text(encoding="utf-8"))
WINDOW = range(4, 14)


def rolling_after(pushes: int | None) -> Policy:
    """A policy by hand: its second roll comes after so many pushes; None: it has seen nothing."""
    around = around_of(PLAN, SCENE, Seen(0.1, rad_from_deg(1.0), rad_from_deg(5.0)))
    regressors = {
        f"(1,{place})": {"regressor": {"0": 0.5, "1": 0.0 if place == pushes else 1.0}}
        for place in WINDOW
    }
    strategy = {
        "statevars": list(DISCRETE),
        "pointvars": list(CONTINUOUS),
        "actions": {
            "0": "Insertion.Next->Insertion.Push { 1, tau, 1 }",
            "1": "Insertion.Next->Insertion.Next { 1, tau, 1 }",
        },
        "regressors": {} if pushes is None else regressors,
    }
    return Policy.of("probability", digest_of(SCENE, around), around, strategy, {})


def silent() -> Policy:
    """A silent policy."""
    around = replace(rolling_after(None).around, window=0)
    return Policy.silent("probability", digest_of(SCENE, around), around, {})


def driven(policy: Policy | None, folder: Path) -> RunLog:
    """The log of a run, which a replay must decide in the same way."""
    path, log = folder / "t.policy.json", folder / "run.mcap"
    arguments = ["drive", str(CHANCE), "--seed", "1", "--quiet", "--log", str(log)]
    if policy is not None:
        path.write_text(policy.text(), encoding="utf-8")
        arguments += ["--policy", str(path)]
    assert cli.main(arguments) == 0
    assert cli.main(["replay", str(log)]) == 0
    return read_log(log)


def rolls(log: RunLog) -> list[float]:
    """The depths at which the needle was rolled."""
    depths, depth_mm = [], 0.0
    for one in log.records:
        if isinstance(one, Command) and one.kind == "push":
            depth_mm += one.value
        elif isinstance(one, Command) and one.kind == "roll":
            depths.append(depth_mm)
    return depths


def advised(log: RunLog) -> list[Advised]:
    return [one for one in log.records if isinstance(one, Advised)]


def test_the_policy_decides_where_the_needle_rolls(tmp_path: Path) -> None:
    alone = driven(None, tmp_path)
    assert not advised(alone)
    assert alone.policy is None
    policy = rolling_after(9)
    log = driven(policy, tmp_path)
    assert log.policy == policy
    assert rolls(log) == [0.0, 18.0]
    assert rolls(log) != rolls(alone)
    said = advised(log)
    assert {one.by for one in said} == {"policy"}
    assert [one.depth_mm for one in said if one.move == "roll"] == [0.0, 18.0]
    assert said[-1].reason.startswith("roll 180 deg, push ")


def test_a_silent_policy_is_as_none_and_says_so_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    alone = driven(None, tmp_path)
    assert "silent" not in capsys.readouterr().err
    log = driven(silent(), tmp_path)
    note = f"note: {tmp_path / 't.policy.json'} is silent: plans are followed as without a policy"
    assert capsys.readouterr().err.count(note) == 1
    assert not advised(log)
    decided = [[one for one in run.records if isinstance(one, Command)] for run in (alone, log)]
    assert decided[0] == decided[1]


def test_a_policy_that_says_nothing_leaves_all_to_syntheses(tmp_path: Path) -> None:
    alone, log = driven(None, tmp_path), driven(rolling_after(None), tmp_path)
    assert rolls(log) == rolls(alone)
    silent = [one for one in advised(log) if not one.move]
    assert silent
    assert {(one.by, one.reason) for one in silent} == {
        ("re-synthesis", "the policy has not seen this")
    }


def test_a_move_that_is_not_safe_is_not_made(tmp_path: Path) -> None:
    """A roll after 8 mm would lead into the vessel."""
    log = driven(rolling_after(4), tmp_path)
    assert 8.0 not in rolls(log)
    refused, *_ = [one for one in advised(log) if one.by != "policy"]
    assert (refused.depth_mm, refused.move) == (8.0, "roll")
    assert refused.reason == "no plan that begins so is safe"


@pytest.mark.parametrize(
    ("task", "policy", "words"),
    [
        (CHANCE, "{", "is no JSON"),
        (CHANCE, '{"format": "ntagen policy", "version": 2}', "'aim' is missing"),
        (CHANCE, '{"format": "ntagen policy", "version": 1}', "the policy has version 1"),
        (CHANCE.parents[1] / "paper.nsl", None, "one of another task"),
    ],
)
def test_a_wrong_policy_costs_no_log(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    task: Path,
    policy: str | None,
    words: str,
) -> None:
    path, log = tmp_path / "t.policy.json", tmp_path / "run.mcap"
    path.write_text(rolling_after(9).text() if policy is None else policy, encoding="utf-8")
    log.write_text("an earlier log")
    assert cli.main(["drive", str(task), "--policy", str(path), "--log", str(log)]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert "hint: " in said
    assert log.read_text() == "an earlier log"
