"""What the synthesiser makes of a model whose arithmetic goes wrong."""

from __future__ import annotations

import pytest

import ntagen.render
from ntagen.errors import ModelError
from ntagen.plan.synthesise import EngineSynthesiser
from tests.scenes import PAPER

WRAPPING = """
const int distance = 2000000000;
int[0, 1] one = 1;
int get_miss() { return 0; }
process Automaton() {
  state Start, Final_TR_Reached;
  init Start;
  trans Start -> Final_TR_Reached { guard one * distance + distance > 0; };
}
Checker = Automaton();
system Checker;
"""


def test_a_model_that_wraps_round_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ntagen.render, "render", lambda _, **__: WRAPPING)
    with pytest.raises(ModelError, match="does not fit into 32 bits"):
        EngineSynthesiser()(PAPER)
