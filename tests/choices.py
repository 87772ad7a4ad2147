"""Small models in which the controller chooses, for tests of several modules."""

from __future__ import annotations

TANK = """
double level = 5;
process Tank() {
  state Choose, Done;
  commit Choose, Done;
  init Choose;
  trans Choose -> Done { assign level = level + 2.5; },
        Choose -> Done { assign level = level - 5; },
        Done -u-> Choose { };
}
system Tank;
"""
"""A tank that is filled or emptied step by step."""

ACTIONS = [*(f"P.A->P.B {{ 1, tau, n = {i} }}" for i in range(5)), "P.B->P.A { 1, tau, 1 }", "WAIT"]
"""The actions of a model whose P goes to B with one of five numbers, and back."""
