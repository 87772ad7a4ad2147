"""Agents of others on the command line: ``--policy``."""

from __future__ import annotations

import importlib
import json
import pickle
import sys
from pathlib import Path
from types import ModuleType
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np
import pytest

import ntagen
from ntagen.checker.policy import trained_in
from ntagen.cli import main
from ntagen.errors import InputError

pytest.importorskip("gymnasium", reason="needs gymnasium, which agents are trained with")

LEAVE = """
clock x;
double cost;
process Guest() {
  state Inside { x <= 5 }, Done;
  init Inside;
  trans Inside -> Done { assign cost = x + 4 * exp(-x); };
}
system Guest;
"""
BEST = "minE(cost)[<=6] {} -> {x}: <> Guest.Done"
MEAN = "E[<=6; 50](max: cost) under Agent"


class Fake:
    """Has the interface of the algorithms of stable-baselines3: it leaves after a delay."""

    def __init__(self, observation_space: object, delay: float) -> None:
        self.observation_space = observation_space
        self.delay = delay

    def save(self, path: Path) -> None:
        with ZipFile(path, "w") as file:
            file.writestr("agent", pickle.dumps((self.observation_space, self.delay)))

    @classmethod
    def load(cls, path: Path, device: str) -> Fake:
        assert device == "cpu"
        with ZipFile(path) as file:
            return cls(*pickle.loads(file.read("agent")))

    def predict(
        self,
        observation: Any,  # noqa: ANN401
        state: Any = None,  # noqa: ANN401
        episode_start: Any = None,  # noqa: ANN401
        deterministic: bool = False,
    ) -> tuple[Any, Any]:
        assert deterministic
        return np.array(0 if observation[0] >= self.delay else 1), state


class PPO(Fake):
    """The algorithm that the fake package has."""


class RecurrentPPO(Fake):
    """It would have to remember."""


@pytest.fixture
def package(monkeypatch: pytest.MonkeyPatch) -> None:
    """A package with the algorithms above in the place of stable-baselines3."""
    modules = {"stable_baselines3": ModuleType("stable_baselines3")}
    vars(modules["stable_baselines3"]).update(PPO=PPO, RecurrentPPO=RecurrentPPO, number=3)
    modules["stable_baselines3.common.base_class"] = ModuleType("base_class")
    vars(modules["stable_baselines3.common.base_class"])["BaseAlgorithm"] = Fake
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setitem(sys.modules, "sb3_contrib", None)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("leave.xta").write_text(LEAVE, encoding="utf-8")
    return tmp_path


def space(model: str = "leave.xta", query: str = BEST, wait: float | None = 0.05) -> object:
    return ntagen.gymnasium.Environment(model, query, wait=wait).observation_space


def check(
    capsys: pytest.CaptureFixture[str], *words: str, query: str = MEAN, code: int = 0
) -> tuple[str, str]:
    assert main(["check", "leave.xta", "--query", query, *words]) == code
    shown = capsys.readouterr()
    return shown.out, shown.err


@pytest.mark.usefixtures("package")
def test_queries_are_asked_under_an_agent(capsys: pytest.CaptureFixture[str]) -> None:
    for delay in (1.0, 2.0):
        PPO(space(), delay).save(Path(f"{delay}.zip"))
    words = ["--policy", "Agent=PPO:1.0.zip", "--policy", "Late=PPO:2.0.zip", "--json"]
    late = MEAN.replace("Agent", "Late")
    out, err = check(capsys, *words, "--query", late)
    assert "has no effect" not in err
    early, late = (json.loads(line) for line in out.splitlines())
    for answer, delay in ((early, 1.0), (late, 2.0)):
        # It is asked every 0.05 units of time.
        assert answer["value"] == pytest.approx(delay + 4 * np.exp(-delay), abs=0.1)


@pytest.mark.usefixtures("package")
def test_a_policy_takes_the_place_of_a_query_that_defines_it(
    capsys: pytest.CaptureFixture[str],
) -> None:
    PPO(space(), 1.0).save(Path("agent.zip"))
    text = f"/* */ strategy Agent = {BEST}\n{MEAN}\n"
    Path("all.q").write_text(text, encoding="utf-8")
    words = ["--policy", "Agent=PPO:agent.zip"]
    assert main(["check", "leave.xta", "all.q", *words]) == 2
    assert "a query defines the strategy Agent, and so does --policy" in capsys.readouterr().err


@pytest.mark.usefixtures("package")
def test_a_policy_that_no_query_uses_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    PPO(space(), 1.0).save(Path("agent.zip"))
    _, err = check(capsys, "--policy", "Other=PPO:agent.zip", query="Pr[<=6; 10](<> Guest.Done)")
    assert "--policy Other has no effect here: no query is under it" in err


@pytest.mark.usefixtures("package")
@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["Agent"], "write NAME=ALGORITHM:FILE, such as Agent=PPO:agent.zip"),
        (["Agent=agent.zip"], "write NAME=ALGORITHM:FILE"),
        (["Agent=PPO:a.zip", "Agent=PPO:b.zip"], "two policies have the name Agent"),
        (["Agent=PPO:missing.zip"], "missing.zip"),
        (["Agent=PPO:torn.zip"], "torn.zip has no agent of PPO that can be loaded: "),
        (["Agent=DQN:agent.zip"], "'DQN' is no algorithm of stable-baselines3\nhint: PPO"),
        (["Agent=RecurrentPPO:agent.zip"], "is no algorithm of stable-baselines3"),
        (["Agent=number:agent.zip"], "is no algorithm of stable-baselines3"),
        (["Agent=PPO:plain.zip"], "it is not known what the policy 'Agent' sees"),
        (["Agent=PPO:other.zip"], "'y' is not declared"),
        (["Agent=PPO:moves.zip"], "the policy is for another model: its action 1 is `"),
    ],
)
def test_a_wrong_policy_is_refused(
    capsys: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    PPO(space(), 1.0).save(Path("agent.zip"))
    Path("torn.zip").write_bytes(Path("agent.zip").read_bytes()[:-40])
    PPO(None, 1.0).save(Path("plain.zip"))
    with pytest.raises(BadZipFile):
        PPO.load(Path("torn.zip"), device="cpu")
    other = LEAVE.replace("double cost;", "double cost; clock y;")
    PPO(space(other, BEST.replace("{x}", "{x, y}")), 1.0).save(Path("other.zip"))
    moves = LEAVE.replace("; };\n}", "; }, Inside -> Inside { guard x > 9; };\n}")
    assert moves != LEAVE
    PPO(space(moves), 1.0).save(Path("moves.zip"))
    options = [part for word in words for part in ("--policy", word)]
    _, err = check(capsys, *options, code=2)
    assert message in err


def test_a_missing_package_is_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    PPO(space(), 1.0).save(Path("agent.zip"))
    for name in ("stable_baselines3", "sb3_contrib"):
        monkeypatch.setitem(sys.modules, name, None)
    _, err = check(capsys, "--policy", "Agent=PPO:agent.zip", code=2)
    assert "stable-baselines3, which is not installed" in err
    assert "hint: pip install stable-baselines3" in err


def test_agents_know_what_they_see() -> None:
    model = ntagen.load("leave.xta")
    training = trained_in(PPO(space(), 1.0))
    assert training is not None
    assert (training["features"], training["wait"]) == ("{} -> {x}", 0.05)
    assert list(model.follow("Agent", PPO(space(), 1.0))) == training["actions"]
    # Without a clock among the features there is nothing to wait for.
    without = trained_in(PPO(space(query=BEST.replace("{x}", "{}"), wait=None), 1.0))
    assert without is not None
    assert without["wait"] is None
    with pytest.raises(InputError, match="not known what the policy 'Agent' sees"):
        model.follow("Agent", lambda _seen, _mask: 0)
    # What is said counts.
    model.follow("Agent", PPO(None, 1.0), "{} -> {x}", wait=0.5)
    answer = model.check(MEAN)
    assert answer.estimate is not None
    assert answer.estimate.value == pytest.approx(1 + 4 * np.exp(-1))


def test_a_refused_policy_is_not_kept() -> None:
    moves = LEAVE.replace("; };\n}", "; }, Inside -> Inside { guard x > 9; };\n}")
    model = ntagen.load("leave.xta")
    with pytest.raises(InputError, match="the policy is for another model"):
        model.follow("Agent", PPO(space(moves), 1.0))
    with pytest.raises(InputError, match="there is no strategy 'Agent'"):
        model.check(MEAN)


@pytest.mark.slow
def test_an_agent_of_stable_baselines_is_asked(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("stable_baselines3", reason="needs stable-baselines3, whose agent is asked")
    package = importlib.import_module("stable_baselines3")
    env = ntagen.gymnasium.Environment("leave.xta", BEST, wait=0.5)
    agent = package.PPO("MlpPolicy", env, n_steps=64, seed=1, device="cpu").learn(128)
    agent.save("agent.zip")
    out, _ = check(capsys, "--policy", "Agent=PPO:agent.zip", "--json")
    model = ntagen.load("leave.xta")
    model.follow("Agent", agent, "{} -> {x}", wait=0.5)
    expected = model.check(MEAN).estimate
    assert expected is not None
    assert json.loads(out)["value"] == expected.value
