"""The published cases under random choice: the published numbers, and simulations of our own."""

from __future__ import annotations

import functools
import re
from dataclasses import dataclass

import pytest

from ntagen.checker import load, load_file
from ntagen.checker.answer import Estimate
from tests.oracles.learning.published import simulation
from tests.oracles.learning.published.cases import HERE, LEARNED, RANDOM, Published
from tests.oracles.learning.published.simulation import Mean


@dataclass(frozen=True)
class Physics:
    """A query about a model, in which some text is replaced, and what a simulation says."""

    model: str
    query: str
    mean: Mean
    change: tuple[str, str] = ("", "")


@functools.cache
def estimate(text: str, query: str) -> Estimate:
    """The engine's answer, whose interval misses once in a thousand times."""
    found = load(text).check(query, alpha=1e-3, seed=1).estimate
    assert found is not None
    return found


@pytest.mark.slow
@pytest.mark.parametrize("case", RANDOM, ids=lambda case: case.name)
def test_random_choice_has_the_published_value(case: Published) -> None:
    found = estimate(case.path.read_text(encoding="utf-8"), case.query)
    # One step of Euler's a push is not exact: see the next test.
    low = 23.14 - 0.05 if case.model == "pole" else case.value - case.margin
    assert found.lower is not None
    assert found.upper is not None
    assert found.lower <= case.value + case.margin
    assert found.upper >= low


@pytest.mark.slow
def test_the_published_falls_are_those_of_a_rough_integrator() -> None:
    rough = simulation.pole_at_random(20_000, 1, simulation.semi_implicit)
    assert rough.value == pytest.approx(23.77, abs=0.163 + rough.half)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["commute", "pole", "stroll", "ball"])
def test_random_runs_agree_with_a_simulation(name: str) -> None:
    case = {
        "commute": lambda: Physics(
            "commute",
            "E[<=2000; 100000](max: travel)",
            Mean(float(simulation.commute_at_random()), 0.0),
        ),
        "pole": lambda: Physics(
            "pole",
            "E[<=10; 1000](max: falls)",
            simulation.pole_at_random(10_000, 1, simulation.runge_kutta),
        ),
        "stroll": lambda: Physics(
            "stroll",
            "E[#<=30; 100000](max: cost + (t > 1) * 1000)",
            simulation.stroll_at_random(100_000, 1),
        ),
        "ball": lambda: Physics(
            "ball",
            "E[<=120; 200](max: lost)",
            simulation.ball_without_hits(20_000, 1),
            ("Choose -> Hit { }", "Choose -> Hit { guard false; }"),
        ),
    }[name]()
    text = (HERE / f"{case.model}.xta").read_text(encoding="utf-8").replace(*case.change)
    found = estimate(text, case.query)
    assert found.lower is not None
    assert found.upper is not None
    assert found.lower - 2 * case.mean.half <= case.mean.value <= found.upper + 2 * case.mean.half


def test_every_published_model_loads_and_has_random_and_learned_values() -> None:
    models = {path.stem for path in HERE.glob("*.xta")}
    assert models == {case.model for case in LEARNED}
    assert models == {case.model for case in RANDOM} | {"ball"}
    for model in models:
        for warning in load_file(HERE / f"{model}.xta").warnings:
            assert re.search(r"\[W02(03|06|13|17)\]", warning), warning
