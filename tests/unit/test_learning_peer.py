"""The known values of learning queries, computed by Storm on models that were written again."""

from __future__ import annotations

import pytest

from tests.oracles.learning.cases import CASES, HELD_BACK, HERE, Case
from tests.oracles.learning.storm import value_of

ALL = [case for case in CASES + HELD_BACK if case.peer]


@pytest.mark.parametrize("is_exact", [True, False], ids=["fractions", "doubles"])
@pytest.mark.parametrize("case", ALL, ids=lambda case: case.name)
def test_storm_finds_the_value(case: Case, is_exact: bool) -> None:
    pytest.importorskip("stormpy", reason="needs stormpy, which models are compared with")
    assert case.peer is not None
    model = HERE / "prism" / f"{case.model}.prism"
    value = value_of(model, case.peer.question, is_exact=is_exact).value - case.peer.more
    assert value == case.exact if is_exact else value == pytest.approx(float(case.exact), abs=1e-6)


def test_every_model_has_a_question() -> None:
    models = {path.stem for path in (HERE / "prism").glob("*.prism")}
    assert models == {case.model for case in ALL}
