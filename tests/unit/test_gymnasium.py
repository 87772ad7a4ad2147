"""Models as Gymnasium environments, and policies of others as strategies."""

from __future__ import annotations

import _thread
import importlib
import math
import re
import sys
import threading
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

import ntagen
from ntagen.checker.learned import LearnedStrategy
from ntagen.checker.policy import action_number
from ntagen.errors import InputError
from tests.choices import TANK
from tests.oracles.learning.cases import HERE
from tests.oracles.learning.published.cases import HERE as PUBLISHED

gymnasium = pytest.importorskip("gymnasium", reason="needs gymnasium, whose interface is tested")

if TYPE_CHECKING:
    from ntagen.gymnasium import Environment

ROOT = Path(__file__).parents[2]
PARTS = "minE(cost)[<=1] {parts, left} -> {}: <> Shop.Done"
LEAVE = "minE(cost)[<=6] {} -> {x}: <> Guest.Done"
BUS = "minE(time)[<=100] {P.location} -> {}: <> P.Done"

Choose = Callable[[NDArray[np.float64], NDArray[np.int8]], int]


def environment(name: str, query: str, wait: float | None = None) -> Environment:
    return ntagen.gymnasium.Environment(HERE / f"{name}.xta", query, wait=wait)


def at_random(seed: int) -> Choose:
    """Chooses among the possible actions."""
    generator = np.random.default_rng(seed)
    return lambda _, mask: int(generator.choice(np.flatnonzero(mask)))


def act(_: NDArray[np.float64], mask: NDArray[np.int8]) -> int:
    """The first of the possible actions."""
    return int(np.flatnonzero(mask)[0])


@dataclass(frozen=True)
class Played:
    """A run: the rewards, the last observation, how it ended, and what was said last."""

    rewards: tuple[float, ...]
    last: tuple[float, ...]
    is_terminated: bool
    info: dict[str, Any]

    @property
    def value(self) -> float:
        return math.fsum(self.rewards)


def played(env: Environment, choose: Choose, seed: int | None = None) -> Played:
    observation, info = env.reset(seed=seed)
    rewards = []
    while True:
        action = choose(observation, info["action_mask"])
        observation, reward, is_terminated, is_truncated, info = env.step(action)
        rewards.append(reward)
        if is_terminated or is_truncated:
            return Played(tuple(rewards), tuple(observation), is_terminated, info)


def values(env: Environment, choose: Choose, runs: int, seed: int = 0) -> NDArray[np.float64]:
    return np.array([played(env, choose, None if k else seed).value for k in range(runs)])


def agrees(found: NDArray[np.float64], value: float, margin: float = 0.0) -> bool:
    """Whether the mean is this, by an interval that misses once in 10,000 times."""
    half = 3.9 * found.std() / math.sqrt(len(found)) + margin
    return abs(found.mean() - value) <= half + 1e-9


def same_mean(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Whether two means may be the same, by an interval that misses once in 10,000 times."""
    half = 3.9 * math.sqrt(one.var() / len(one) + other.var() / len(other))
    return abs(one.mean() - other.mean()) <= half + 1e-9


@pytest.mark.parametrize(
    ("name", "query"),
    [("parts", PARTS), ("leave", LEAVE), ("traffic", "minE(cost)[<=1]: <> Day.Done")],
)
def test_gymnasium_accepts_the_environment(name: str, query: str) -> None:
    from gymnasium.utils.env_checker import check_env

    with warnings.catch_warnings():
        # What is seen has no bounds, which is not forbidden.
        warnings.filterwarnings("ignore", ".*(infinity|probably too).*")
        warnings.filterwarnings("ignore", ".*env.spec.*")
        check_env(environment(name, query), skip_render_check=True)


def test_the_query_says_what_is_seen_and_done() -> None:
    env = environment("parts", PARTS)
    assert env.discrete == ("parts", "left")
    assert env.continuous == ()
    assert len(env.actions) == env.action_space.n == 3
    assert env.actions[-1] == "WAIT"
    observation, info = env.reset(seed=1)
    assert observation.tolist() == [2.0, 5.0]
    assert observation.dtype == np.float64
    assert info["action_mask"].tolist() == [1, 1, 0]
    assert info["actions"] == env.actions[:2]
    assert info["time"] == 0.0
    assert not info["replaced"]
    assert env.action_masks().tolist() == [True, True, False]


def test_rewards_add_up_to_the_value_of_the_run() -> None:
    run = played(environment("parts", PARTS), lambda _seen, _mask: 1, 3)
    parts, left = run.last
    assert run.is_terminated
    # Each fast try costs 3, and each part that is missing 10.
    assert run.value == -(3 * (5 - left) + 10 * parts)
    gains = played(environment("parts", PARTS.replace("min", "max")), lambda _seen, _mask: 1, 3)
    assert gains.value == -run.value


def test_the_first_reward_has_the_value_at_the_beginning() -> None:
    text = (HERE / "parts.xta").read_text(encoding="utf-8").replace("int cost;", "int cost = 100;")
    changed = ntagen.gymnasium.Environment(text, PARTS)
    own = environment("parts", PARTS)
    first, second = (played(env, lambda _seen, _mask: 1, 3) for env in (own, changed))
    assert second.rewards[0] == first.rewards[0] - 100
    assert second.rewards[1:] == first.rewards[1:]


def test_same_seed_and_same_decisions_give_the_same_runs() -> None:
    one, other = (environment("leave", LEAVE.replace("x}", "}")) for _ in range(2))
    runs, again = ([played(env, act, seed) for seed in (5, None)] for env in (one, other))
    assert [run.rewards for run in runs] == [run.rewards for run in again]
    assert [run.last for run in runs] == [run.last for run in again]
    assert runs[0].rewards != runs[1].rewards
    # A run that is left in its middle leaves no trace.
    other.reset(seed=9)
    assert played(other, act, 5).rewards == runs[0].rewards


def test_runs_are_those_of_queries() -> None:
    """Run k of a seed is the same in both, where the decisions are the same."""
    model = ntagen.load(HERE / "parts.xta")
    model.follow("Agent", lambda _seen, _mask: 1, "{parts, left} -> {}")
    answer = model.check("E[<=1; 200](max: cost) under Agent", seed=11)
    assert answer.estimate is not None
    own = values(environment("parts", PARTS), lambda _seen, _mask: 1, 200, seed=11)
    assert answer.estimate.value == pytest.approx(-own.mean())


def test_random_actions_have_the_mean_of_the_uniform_choice() -> None:
    found = ntagen.load(HERE / "parts.xta").check("E[<=1; 100000](max: cost)", seed=3).estimate
    assert found is not None
    own = values(environment("parts", PARTS), at_random(1), 3000)
    assert agrees(-own, found.value, margin=(found.upper - found.lower) / 2)


@pytest.mark.slow
def test_a_learned_strategy_has_its_value() -> None:
    answer = ntagen.load(HERE / "leave.xta").check(
        f"strategy Best = {LEAVE}", seed=1, good_runs=500, max_iterations=6, runs=1000
    )
    strategy = answer.strategy
    assert isinstance(strategy, LearnedStrategy)
    assert answer.estimate is not None

    def best(seen: NDArray[np.float64], mask: NDArray[np.int8]) -> int:
        found = strategy.decide([], list(seen), [bool(one) for one in mask])
        assert found is not None
        return found

    env = environment("leave", LEAVE, wait=0.01)
    assert env.actions == strategy.actions
    assert -played(env, best, 1).value == pytest.approx(answer.estimate.value, abs=5e-3)
    assert -played(env, act, 1).value > answer.estimate.value + 1


def test_waiting_ends_after_its_time() -> None:
    env = environment("leave", LEAVE, wait=0.25)
    wait = len(env.actions) - 1
    observation, info = env.reset(seed=1)
    times = []
    while info["action_mask"][wait] and len(times) < 100:
        assert observation.tolist() == pytest.approx([info["time"]])
        times.append(info["time"])
        observation, _, _, _, info = env.step(wait)
    assert times == pytest.approx(np.arange(0, 5, 0.25).tolist())
    assert env.step(0)[2]
    # Without it a hundredth of the bound.
    env = environment("leave", LEAVE)
    env.reset(seed=1)
    assert env.step(wait)[-1]["time"] == pytest.approx(0.06)


def test_the_best_delay_has_its_value() -> None:
    env = environment("leave", LEAVE, wait=0.01)
    run = played(env, lambda seen, _: 0 if seen[0] >= math.log(4) else 1, 1)
    assert -run.value == pytest.approx(1 + math.log(4), abs=1e-3)


def test_without_clocks_delays_are_drawn() -> None:
    env = environment("leave", "minE(cost)[<=6] {} -> {}: <> Guest.Done")
    own = values(env, lambda _seen, _mask: 0, 3000)
    # The mean of x + 4 exp(-x) for x from 0 to 5.
    assert agrees(-own, 2.5 + 4 * (1 - math.exp(-5)) / 5)


def test_an_impossible_action_is_replaced() -> None:
    env = environment("parts", PARTS)
    costs = set()
    for seed in range(40):
        env.reset(seed=seed)
        _, reward, _, _, info = env.step(2)
        assert info["replaced"]
        costs.add(reward)
    assert costs == {-1.0, -3.0}
    env.reset(seed=1)
    assert not env.step(0)[-1]["replaced"]


def test_the_bound_truncates() -> None:
    env = environment("leave", LEAVE.replace("6", "1"), wait=0.3)
    env.reset(seed=1)
    for _ in range(3):
        assert env.step(1)[2:4] == (False, False)
    _, reward, is_terminated, is_truncated, info = env.step(1)
    assert (is_terminated, is_truncated, info["time"]) == (False, True, 1.0)
    assert reward == 0.0


def test_probabilities_are_rewarded_at_the_end() -> None:
    query = "maxPr[<=1] {parts, left} -> {}: <> Shop.Done && parts == 0"
    env = environment("parts", query)
    own = values(env, lambda _seen, _mask: 1, 2000)
    assert set(own) == {0.0, 1.0}
    # At least two of five tries succeed.
    assert agrees(own, 1 - 0.2**5 - 5 * 0.8 * 0.2**4)


def test_a_run_without_decisions_ends_with_the_first_step() -> None:
    query = "minE(cost)[<=1] {parts} -> {}: <> true"
    env = environment("parts", query)
    _, info = env.reset(seed=1)
    assert info["actions"] == ("WAIT",)
    assert env.step(2)[1:4] == (0.0, True, False)


ROUTES = (
    "strategy Safe = control: A[] not Courier.Stuck",
    "minE(cost)[<=50] {Courier.location} -> {}: <> Courier.Home under Safe",
)

COURIER = """
int cost;
process Courier() {
  state Start, Fast, Slow, Stuck, Home;
  urgent Start, Fast, Slow;
  init Start;
  trans Start -> Fast { assign cost += 1; },
        Start -> Slow { assign cost += 4; },
        Fast -u-> Home { }, Fast -u-> Stuck { }, Slow -u-> Home { };
}
system Courier;
"""


def test_a_safe_strategy_restricts_what_is_possible() -> None:
    env = ntagen.gymnasium.Environment(COURIER, ROUTES[1], strategies=ROUTES[:1])
    runs = [played(env, at_random(k), k) for k in range(30)]
    assert {run.value for run in runs} == {-4.0}
    assert all(run.is_terminated for run in runs)


def test_a_shield_restricts_what_is_possible() -> None:
    unsafe = "level < 0 || level >= 8"
    query = f"minPr[#<=60] {{}} -> {{level}}: <> {unsafe}"
    shield = "strategy Shield = acontrol: A[] level >= 0 && level < 8 { level[0,10]:4 }"
    free = ntagen.gymnasium.Environment(TANK, query, wait=1.0)
    assert values(free, at_random(1), 20).tolist() == [-1.0] * 20
    kept = ntagen.gymnasium.Environment(
        TANK, f"{query} under Shield", wait=1.0, strategies=[shield]
    )
    assert values(kept, at_random(1), 20).tolist() == [0.0] * 20


def test_runs_are_bounded_by_moves_or_a_clock() -> None:
    moves = environment("parts", "minE(cost)[#<=3] {left} -> {}: <> Shop.Done")
    run = played(moves, lambda _seen, _mask: 0, 1)
    assert (run.is_terminated, run.value) == (False, -3.0)
    with pytest.raises(InputError, match="how long to wait is"):
        environment("leave", "minE(cost)[#<=3] {} -> {x}: <> Guest.Done")
    clock = environment("leave", "minE(cost)[x<=2] {} -> {x}: <> Guest.Done", wait=0.7)
    run = played(clock, lambda _seen, _mask: 1, 1)
    assert (run.is_terminated, run.info["time"]) == (False, 2.0)


@pytest.mark.parametrize(
    ("query", "words"),
    [
        (f"strategy S = {PARTS}", "names no strategy"),
        ("control: A[] true", "query for the best strategy"),
        ("Pr[<=1](<> Shop.Done)", "query for the best strategy"),
        ("minE(cost)[<=1] {nothing} -> {}: <> Shop.Done", "nothing"),
        ("minE(cost)[<=1] {left} -> {}: <> Shop.Done under Safe", "Safe"),
        ("minE(cost)[<=1", "E0"),
    ],
)
def test_a_wrong_query_is_refused(query: str, words: str) -> None:
    with pytest.raises(ntagen.RejectedError, match=words):
        environment("parts", query)


def test_a_model_without_choices_is_refused() -> None:
    text = (HERE / "parts.xta").read_text(encoding="utf-8").replace(" -> ", " -u-> ")
    with pytest.raises(ntagen.RejectedError, match="nothing to decide"):
        ntagen.gymnasium.Environment(text, PARTS)
    with pytest.raises(ntagen.RejectedError, match="nothing to decide"):
        ntagen.load(text).follow("Agent", lambda _seen, _mask: 0, "{left} -> {}")


@pytest.mark.parametrize("action", [-1, 3, 1.0, math.nan, None, "0", np.array([0, 1])])
def test_a_wrong_action_is_refused(action: object) -> None:
    env = environment("parts", PARTS)
    env.reset(seed=1)
    with pytest.raises(InputError, match="from 0 to 2"):
        env.step(action)
    assert env.step(np.int64(0))[1] == -1.0


def test_an_action_may_be_of_any_integer_type() -> None:
    assert [action_number(one, 3) for one in (2, np.int64(2), np.array(2), np.uint8(2))] == [2] * 4


def test_a_step_needs_a_run() -> None:
    env = environment("parts", PARTS)
    for _ in range(2):
        with pytest.raises(InputError, match="no run"):
            env.step(0)
        with pytest.raises(InputError, match="no run"):
            env.action_masks()
        played(env, lambda _seen, _mask: 0, 1)
    env.close()
    with pytest.raises(InputError, match="closed"):
        env.reset(seed=1)


@pytest.mark.parametrize("wait", [0.0, -1.0, math.nan])
def test_a_wrong_time_to_wait_is_refused(wait: float) -> None:
    with pytest.raises(InputError, match="positive"):
        environment("leave", LEAVE, wait=wait)
    with pytest.raises(InputError, match="positive"):
        ntagen.load(HERE / "leave.xta").follow("A", lambda _seen, _mask: 0, "{} -> {x}", wait=wait)


def test_a_run_that_fails_says_why() -> None:
    text = (HERE / "parts.xta").read_text(encoding="utf-8").replace("cost += 3", "cost /= 0")
    env = ntagen.gymnasium.Environment(text, PARTS)
    env.reset(seed=1)
    with pytest.raises(ntagen.RejectedError, match="division by zero"):
        env.step(1)
    with pytest.raises(InputError, match="no run"):
        env.step(0)
    assert played(env, lambda _seen, _mask: 0, 2).is_terminated


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    monkeypatch.delitem(sys.modules, "ntagen.gymnasium", raising=False)
    with pytest.raises(InputError, match=r"ntagen\[gymnasium\]"):
        importlib.import_module("ntagen.gymnasium")


class Predictor:
    """A policy as stable-baselines3 has it, which hits where there are as many tries as parts."""

    def predict(
        self,
        observation: NDArray[np.float64],
        state: object = None,
        episode_start: object = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.int64], None]:
        assert deterministic
        parts, left = observation
        return np.array(int(left <= parts)), None


class Masked(Predictor):
    """A policy that asks for the mask, as sb3-contrib's."""

    masks: list[list[bool]]

    def predict(  # type: ignore[override]
        self,
        observation: NDArray[np.float64],
        deterministic: bool = False,
        action_masks: NDArray[np.bool_] | None = None,
    ) -> tuple[int, None]:
        assert action_masks is not None
        self.masks.append(action_masks.tolist())
        return int(observation[1] <= observation[0]), None


def test_queries_are_asked_under_a_policy() -> None:
    model = ntagen.load(HERE / "parts.xta")
    model.check(f"strategy Best = {PARTS}")
    actions = model.follow("Agent", Predictor(), "{parts, left} -> {}")
    assert actions == environment("parts", PARTS).actions
    mean = "E[<=1; 4000](max: cost)"
    agent = model.check(f"{mean} under Agent", seed=2).estimate
    best = model.check(f"{mean} under Best", seed=2).estimate
    # Both do the same with the same random numbers.
    assert agent is not None
    assert best is not None
    assert agent.value == best.value
    chance = model.check("Pr[<=1](<> Shop.Done && parts > 0) under Agent", runs=4000).estimate
    assert chance is not None
    assert chance.lower <= chance.value <= chance.upper
    shown = model.check("simulate[<=1; 2]{left, parts} under Agent")
    assert len(shown.trajectories) == 2
    masked = Masked()
    masked.masks = []
    model.follow("Agent", masked, "{parts, left} -> {}")
    again = model.check(f"{mean} under Agent", seed=2).estimate
    assert again is not None
    assert again.value == best.value
    assert masked.masks[0] == [True, True, False]


def test_an_answer_under_a_policy_does_not_depend_on_threads() -> None:
    model = ntagen.load(HERE / "leave.xta")
    seen: list[float] = []

    def forgetful(observation: NDArray[np.float64], _: object) -> int:
        seen.append(observation[0])
        return len(seen) % 2

    def answer(threads: int) -> float:
        seen.clear()
        model.follow("Agent", forgetful, "{} -> {x}", wait=0.5)
        found = model.check("E[<=6; 300](max: cost) under Agent", seed=4, threads=threads).estimate
        assert found is not None
        return found.value

    assert answer(1) == answer(2)


@pytest.mark.parametrize("query", ["E<> Shop.Done", "A[] left >= 0", "control: A[] true"])
def test_symbolic_queries_under_a_policy_are_refused(query: str) -> None:
    model = ntagen.load(HERE / "parts.xta")
    model.follow("Agent", Predictor(), "{parts, left} -> {}")
    with pytest.raises(ntagen.RejectedError, match="random runs only"):
        model.check(f"{query} under Agent")


def test_a_policy_has_no_file_and_no_best_strategy(tmp_path: Path) -> None:
    model = ntagen.load(HERE / "parts.xta")
    model.follow("Agent", Predictor(), "{parts, left} -> {}")
    with pytest.raises(ntagen.RejectedError, match="random runs only"):
        model.check(f'saveStrategy("{tmp_path}/agent.json", Agent)')
    with pytest.raises(ntagen.RejectedError, match="not supported"):
        model.check(f"{PARTS} under Agent")


@pytest.mark.parametrize(
    ("policy", "words"),
    [
        (lambda _seen, _mask: 7, "from 0 to 2"),
        (lambda _seen, _mask: math.nan, "nan is no action"),
        (lambda _seen, _mask: 1 // 0, "ZeroDivisionError"),
        (lambda: 0, "TypeError"),
    ],
)
def test_a_failing_policy_ends_the_query(policy: Choose, words: str) -> None:
    model = ntagen.load(HERE / "parts.xta")
    model.follow("Agent", policy, "{parts, left} -> {}")
    with pytest.raises(ntagen.RejectedError, match=words) as caught:
        model.check("E[<=1; 100](max: cost) under Agent")
    assert "Agent" in str(caught.value)
    assert caught.value.__cause__ is not None
    # The model can be asked again.
    model.follow("Agent", Predictor(), "{parts, left} -> {}")
    assert model.check("E[<=1; 100](max: cost) under Agent").estimate is not None


def test_an_interruption_in_a_policy_goes_on() -> None:
    def interrupted(_seen: object, _mask: object) -> int:
        raise KeyboardInterrupt

    model = ntagen.load(HERE / "parts.xta")
    model.follow("Agent", interrupted, "{parts, left} -> {}")
    with pytest.raises(KeyboardInterrupt):
        model.check("E[<=1; 100](max: cost) under Agent")


LINGERING = """
int[0,20] steps;
process Worker() {
  clock x;
  state Ready, Works { x <= 1 };
  urgent Ready;
  init Ready;
  trans Ready -> Works { guard steps < 20; assign steps = steps + 1, x = 0; },
        Works -u-> Ready { guard x >= 1; };
}
process Bell() {
  clock y;
  state Rings, Silent { y <= 1 };
  urgent Rings;
  init Rings;
  trans Rings -u-> Silent { assign y = 0; },
        Silent -u-> Rings { guard y >= 1; };
}
W = Worker();
B = Bell();
system W, B;
"""


def test_a_policy_is_asked_once_about_each_moment() -> None:
    """Where it waits although time stands still, code gives the run up, which begins anew."""
    asked: dict[str, list[float]] = {}
    for engine in ("jit", "interpreter"):
        seen = asked.setdefault(engine, [])

        def wait_if_possible(
            values: NDArray[np.float64], mask: NDArray[np.int8], seen: list[float] = seen
        ) -> int:
            seen.append(float(values[0]))
            return 1 if mask[1] else 0

        model = ntagen.load(LINGERING)
        model.follow("Agent", wait_if_possible, "{steps} -> {}")
        answer = model.check("E[<=15; 1500](max: steps) under Agent", engine=engine, seed=3)
        assert answer.verdict == "satisfied"
    # Runs that are made ahead are asked about, too, as many as there is time for.
    least = min(map(len, asked.values()))
    assert least > 30_000
    assert asked["jit"][:least] == asked["interpreter"][:least]


def test_a_policy_must_not_ask_its_model() -> None:
    model = ntagen.load(HERE / "parts.xta")

    def curious(_seen: object, _mask: object) -> int:
        return int(model.check("E<> Shop.Done").verdict == "satisfied")

    model.follow("Agent", curious, "{parts, left} -> {}")
    with pytest.raises(ntagen.RejectedError, match="must not ask the model"):
        model.check("E[<=1; 100](max: cost) under Agent")


def test_an_interruption_closes_the_environment() -> None:
    """No decision comes before the bound, which is far away."""
    text = """
        int cost;
        process Clock() { clock x; state Tick { x <= 1 }; init Tick;
          trans Tick -u-> Tick { guard x >= 1; assign x = 0; }; }
        process Never() { state Stay; init Stay; trans Stay -> Stay { guard cost > 0; }; }
        system Clock, Never;
    """
    env = ntagen.gymnasium.Environment(text, "minE(cost)[<=1e12] {cost} -> {}: <> cost > 0")
    timer = threading.Timer(0.2, _thread.interrupt_main)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        env.reset(seed=1)
    timer.join()
    with pytest.raises(InputError, match="closed"):
        env.reset(seed=1)


def test_a_wrong_policy_is_refused() -> None:
    model = ntagen.load(HERE / "parts.xta")
    with pytest.raises(InputError, match="no policy"):
        model.follow("Agent", 3, "{parts} -> {}")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="no name"):
        model.follow("my agent", Predictor(), "{parts} -> {}")
    for features in ("{nothing} -> {}", "parts", "{parts}", "{parts} -> {} and more", ""):
        with pytest.raises(ntagen.RejectedError, match="E0"):
            model.follow("Agent", Predictor(), features)
    with pytest.raises(ntagen.RejectedError, match="how long to wait is"):
        ntagen.load(HERE / "leave.xta").follow("Agent", Predictor(), "{} -> {x}")


def test_the_page_shows_what_happens(capsys: pytest.CaptureFixture[str]) -> None:
    page = (ROOT / "docs" / "environments.md").read_text(encoding="utf-8")
    program = "".join(re.findall(r"```python\n(.*?)```", page, re.DOTALL))
    exec(compile(program, "environments.md", "exec"), {})
    first, second = capsys.readouterr().out.splitlines()
    assert first == "2.386 True"
    assert "value=2.386" in second


# The same cases, made by others: uppaal-gym has environments of its own for them.


@dataclass(frozen=True)
class Shown:
    """What runs of an environment here, and of one of others, show: two numbers of each run."""

    own: NDArray[np.float64]
    peer: NDArray[np.float64]

    def agree(self) -> bool:
        """Whether both have the same means, neither of which is trivial."""
        columns = zip(self.own.T, self.peer.T, strict=True)
        return all(one.std() > 0 and same_mean(one, other) for one, other in columns)


def peers() -> ModuleType:
    found = pytest.importorskip("uppaal_gym", reason="needs uppaal-gym, which is compared with")
    # Some of its environments draw from the generator that all programs share.
    np.random.seed(1)
    envs: ModuleType = found.envs
    return envs


def number_of(env: Environment, text: str) -> int:
    """The number of the only action with this text in its own."""
    found = [number for number, one in enumerate(env.actions) if text in one]
    assert len(found) == 1
    return found[0]


def published(name: str, query: str) -> Environment:
    return ntagen.gymnasium.Environment(PUBLISHED / f"{name}.xta", query, wait=1.0)


def walks(runs: int) -> Shown:
    """The random walk, fast where it is late: whether it is too late, and the number of steps."""
    peer = peers().RandomWalkEnv()
    env = published("stroll", "minE(cost)[#<=100] {} -> {x, t}: <> x > 1 or t > 1")
    fast, slow = number_of(env, "Fast"), number_of(env, "Slow")
    own, other = [], []
    for run in range(runs):
        shown = played(env, lambda seen, _: fast if seen[0] < seen[1] else slow, run)
        own.append((float(shown.last[1] > 1), len(shown.rewards)))
        seen, count, is_over = peer.reset()[0], 0, False
        while not is_over:
            seen, _, is_over, _, _ = peer.step(peer.FAST if seen[0] < seen[1] else peer.SLOW)
            count += 1
        other.append((float(seen[1] > 1), count))
    return Shown(np.array(own), np.array(other))


def bounces(runs: int) -> Shown:
    """The ball, 30 units of time: whether it is lost, and the number of hits until then."""
    peer = peers().BouncingBallEnv(ts_size=0.1)
    env = published("ball", "minE(hits)[<=29.999] {} -> {height, speed}: <> lost > 0")
    hit, rest = number_of(env, "Hit"), number_of(env, "Wait {")

    def hits(seen: NDArray[np.float64]) -> bool:
        return bool(seen[0] >= 6 and 0 <= seen[1] <= 1)

    own, other = [], []
    for run in range(runs):
        shown = played(env, lambda seen, _: hit if hits(seen) else rest, run)
        own.append((float(shown.is_terminated), -shown.value))
        peer.reset(seed=run)
        # There it is thrown from another height, and decided upon at once.
        peer.p = 7 + peer.np_random.uniform(0, 3)
        seen, _, is_over, _, _ = peer.step(0)
        count = 0
        for _ in range(299):
            if is_over:
                break
            count += hits(seen)
            seen, _, is_over, _, _ = peer.step(int(hits(seen)))
        other.append((float(is_over), count))
    return Shown(np.array(own), np.array(other))


def follows(runs: int) -> Shown:
    """The cars, for four seconds, in which none reaches a limit: crashes, and the distance."""
    peer = peers().CruiseControlEnv()
    env = published(
        "follow", "minE(distance)[<=4] {own_speed, other_speed, distance} -> {}: <> distance <= 0"
    )
    brake, drive = number_of(env, "own_change = -2"), number_of(env, "own_change = 2 }")

    def drives(seen: NDArray[np.float64]) -> bool:
        return bool(seen[2] >= 7)

    own, other = [], []
    for run in range(runs):
        shown = played(env, lambda seen, _: drive if drives(seen) else brake, run)
        own.append((float(shown.is_terminated), -shown.value))
        seen, is_over = peer.reset()[0], False
        for _ in range(4):
            if not is_over:
                seen, _, is_over, _, _ = peer.step(1 if drives(seen) else 0)
        other.append((float(is_over), float(seen[2])))
    return Shown(np.array(own), np.array(other))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("show", "runs"),
    [(walks, 4000), (bounces, 600), (follows, 4000)],
    ids=["walks", "bounces", "follows"],
)
def test_environments_of_others_are_the_same(show: Callable[[int], Shown], runs: int) -> None:
    assert show(runs).agree()
