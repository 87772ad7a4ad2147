"""The rules of the grammar and the methods that make their nodes belong together."""

from __future__ import annotations

from ntagen.nsl.convert import TreeBuilder
from ntagen.nsl.grammar import grammar

WITHOUT_NODES = {"statement", "outside", "query"}
"""Their tokens are read by the parser itself, or they only list other rules."""


def test_every_rule_has_a_method_and_every_method_a_rule() -> None:
    # A rule for one other rule alone makes no node, and neither do those that begin with `_`.
    names = {
        str(rule.alias or rule.origin.name)
        for rule in grammar().rules
        if rule.alias or not (rule.options.expand1 and len(rule.expansion) == 1)
    }
    names = {name for name in names if not name.startswith("_")} - WITHOUT_NODES
    assert names == {name for name in vars(TreeBuilder) if not name.startswith("_")}
