"""Graphviz: the templates of a model as a graph."""

from __future__ import annotations

from ntagen.convert import convert
from tests.systems import source

MODEL = """chan go; process P(const int[0,1] id) {
  clock x; state A { x <= 3; 2 }, B, C; branchpoint F;
  commit B; urgent C; init A;
  trans A -> B { select i : int[0,1]; guard x > 1 && i == id; sync go!; assign x = 0; },
    A -u-> F { }, F -> C { probability 3; }, F -> B { }; }
system P;"""


def test_locations_and_edges_have_their_labels() -> None:
    assert (
        convert(source(MODEL, 'two "words".xta'), "dot").text
        == r"""digraph "two \"words\"" {
  graph [fontname="Helvetica", labeljust=l, compound=true];
  node [fontname="Helvetica", shape=circle, margin=0.05];
  edge [fontname="Helvetica", fontsize=10];
  subgraph cluster_0 {
    label="P(const int[0,1] id)";
    t0_0 [label="A\nx <= 3\nrate 2", shape=doublecircle];
    t0_1 [label="C\nB"];
    t0_2 [label="U\nC"];
    t0_3 [shape=point, label=""];
    t0_0 -> t0_1 [label="i : int[0,1]\nx > 1 && i == id\ngo!\nx = 0"];
    t0_0 -> t0_3 [label="", style=dashed];
    t0_3 -> t0_2 [label="3"];
    t0_3 -> t0_1 [label=""];
  }
}
"""
    )
