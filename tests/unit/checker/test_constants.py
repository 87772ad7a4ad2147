"""Models with other constants: what is edited, what follows from it, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from ntagen import checker
from ntagen.checker import RejectedError
from ntagen.checker.constants import written
from ntagen.cli import main

XTA = """
const int N = 3, K = 2;  // how many, and how long
const int LENGTHS[2] = { 4, /* the second */ 5 };
typedef struct { int x; int y; } pair;
const pair PLACE = { 1, 2 };
int count = N;
process P(const int[1, N] id) {
  const int OWN = K + 1;
  int[0, 100] a = LENGTHS[1] + PLACE.y + OWN;
  state A;
  init A;
}
system P;
"""

XML = """<?xml version="1.0" encoding="utf-8"?>
<nta>
  <declaration>const bool SMALL = 1 &lt; 2 &amp;&amp; true; // größer
  int word = SMALL ? 1 : 0;</declaration>
  <template>
    <name>P</name>
    <declaration><![CDATA[const bool LATE = 3 < 2;
int own = LATE ? 1 : 0;]]></declaration>
    <location id="a"><name>A</name></location>
    <init ref="a"/>
  </template>
  <system>const int LAST = 7; int end = LAST; system P;</system>
</nta>
"""


def holds(model: checker.Model, condition: str) -> bool:
    return model.check(f"E<> {condition}").satisfied


def test_what_depends_on_a_constant_follows() -> None:
    model = checker.load(XTA)
    larger = model.with_constants(N=5)
    assert [process.name for process in larger.processes] == [f"P({i})" for i in range(1, 6)]
    assert holds(larger, "count == 5")
    assert len(model.processes) == 3
    assert "N = 5, K = 2;  // how many" in larger.text
    assert model.text == XTA


def test_several_values_of_all_kinds() -> None:
    model = checker.load(XTA).with_constants(
        {"P.OWN": "K * 10"}, K=np.int64(3), LENGTHS=np.array([8, 9]), PLACE={"x": 1, "y": 20}
    )
    assert holds(model, "P(1).a == 9 + 20 + 30")
    assert holds(checker.load(XTA).with_constants(PLACE=[1, 3]), "P(1).a == 5 + 3 + 3")


def test_xml_is_edited_as_it_is_written() -> None:
    model = checker.load(XML).with_constants(
        {"P.LATE": "1 < 2 && true"}, SMALL="2 < 1 && true", LAST=8
    )
    assert "SMALL = 2 &lt; 1 &amp;&amp; true; // größer" in model.text
    assert "LATE = 1 < 2 && true;" in model.text
    assert holds(model, "word == 0 && P.own == 1 && end == 8")


def test_a_file_of_another_encoding_is_edited(tmp_path: Path) -> None:
    path = tmp_path / "wide.xta"
    path.write_bytes(XTA.encode("utf-16"))
    assert holds(checker.load_file(path).with_constants(K=4), "P(1).a == 5 + 2 + 5")


def test_a_large_table_is_replaced() -> None:
    table = list(range(100))
    text = f"const int T[100] = {{{', '.join(map(str, table))}}};\nint x = T[99];\n"
    model = checker.load(text + "process P() { state A; init A; }\nsystem P;")
    assert holds(model.with_constants(T=table[::-1]), "x == 0")


def test_the_rule_for_overflows_stays() -> None:
    model = checker.load(XTA)
    model.overflow = "error"
    assert model.with_constants(N=2).overflow == "error"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"M": 3}, "declares no constant `M`"),
        ({"OWN": 3}, "hint: it has N, K, LENGTHS, PLACE, P.OWN"),
        ({"count": 3}, "`count` is a variable, not a constant"),
        ({"P.a": 3}, "`P.a` is a variable, not a constant"),
        ({"N": "3; int more = 2"}, "expected the end of the value, found `;`"),
        ({"N": ""}, "the value of N:1:1"),
        ({"N": 1.5}, "an integer (int) is needed here"),
        ({"N": -1}, "the range from 1 to -1 is empty"),
        ({"LENGTHS": [1, 2, 3]}, "error[E0218]"),
        ({"N": "N"}, "'N' is not declared"),
    ],
)
def test_wrong_values_are_refused(values: dict[str, object], message: str) -> None:
    with pytest.raises(RejectedError) as caught:
        checker.load(XTA, "model.xta").with_constants(values)  # type: ignore[arg-type]
    assert message in str(caught.value)


def test_a_file_with_entities_of_its_own_is_refused() -> None:
    text = XML.replace("<nta>", '<!DOCTYPE nta [<!ENTITY seven "7">]>\n<nta>', 1)
    with pytest.raises(RejectedError, match="entities of its own"):
        checker.load(text.replace("LAST = 7", "LAST = &seven;")).with_constants(LAST=8)


def test_values_are_written_as_in_declarations() -> None:
    assert written([True, np.True_, 2, 0.5, "N + 1"]) == "{true, true, 2, 0.5, N + 1}"
    assert written({"x": 1, "y": (2, 3)}) == "{ x: 1, y: {2, 3} }"
    with pytest.raises(ValueError, match="inf cannot be the value of a constant"):
        written(math.inf)
    with pytest.raises(TypeError, match="None cannot be the value of a constant"):
        written(None)


def test_the_command_line_gives_constants(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "model.xta"
    path.write_text(XTA)

    def code(*arguments: str) -> int:
        return main(["check", str(path), *arguments])

    assert code("--query", "E<> count == 4", "--constant", "N=4") == 0
    assert code("--query", "E<> count == 4") == 1
    assert code("--query", "E<> P(1).a == 9", "--constant", "P.OWN = 2", "--constant", "N=1") == 0
    assert code("--query", "E<> true", "--constant", "N") == 2
    assert "'N' is not NAME=VALUE, such as N=4" in capsys.readouterr().err
    environment = Path(__file__).parents[3] / "examples" / "paper.nsl"
    assert main(["check", str(environment), "--constant", "N=4"]) == 2
    assert "an environment has none" in capsys.readouterr().err
