"""The table of edges asks the engine for those of a process when they are needed."""

from ntagen import checker
from ntagen.checker.edges import EdgeTable, RawEdge, step_of

MANY = """
process P(int[0, 3] id) {
  state A, B;
  init A;
  trans A -u-> B { select k : int[1, 2]; guard id < 3; };
}
system P;
"""


def test_the_edges_of_a_process_are_asked_for_once_and_those_of_others_not_at_all() -> None:
    model = checker.load(MANY)
    asked: list[int] = []

    def edges(process: int) -> list[RawEdge]:
        asked.append(process)
        return model._raw.edges(process)

    table = EdgeTable(edges)
    for _ in range(2):
        [edge] = step_of(table, [(2, 0, 0, [1])]).edges
        assert (edge.process, edge.source, edge.target) == ("P(2)", "A", "B")
        assert edge.select == {"k": 1}
    assert asked == [2]
    assert not table[2][0].controllable
