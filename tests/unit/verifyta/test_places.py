"""Places of mistakes and queries as verifyta names them."""

from __future__ import annotations

from pathlib import Path

import pytest

import ntagen
from ntagen.checker import RejectedError
from ntagen.verifyta.places import element_at, places_of_queries, reported

XML = """<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD Flat System 1.1//EN' 'flat-1_2.dtd'>
<nta><declaration>int x; {declaration}</declaration>
<template><name>P</name><location id="id0"/>
<init ref="id0"/></template>
<template><name>Q</name><declaration>clock c;</declaration>
<location id="id1"/><location id="id2"><name>L</name>
  <label kind="invariant">c &lt;= 5 {invariant}</label></location><init ref="id1"/>
<transition><source ref="id1"/><target ref="id2"/></transition>
<transition><source ref="id1"/><target ref="id2"/>
  <label kind="guard">c &gt; 3</label>
  <label kind="assignment">x = {update}</label></transition></template>
<system>{system} system P, Q;</system>
<queries><query><formula></formula></query><query><formula>E&lt;&gt; Q.L</formula></query>
<query><formula>A[] é == x</formula></query></queries></nta>
"""
RIGHT = {"declaration": "", "invariant": "", "update": "1", "system": ""}


@pytest.mark.parametrize(
    ("wrong", "place"),
    [
        ({"declaration": "int y = z;"}, "/nta/declaration"),
        ({"invariant": "&amp;&amp; é &lt; z"}, "/nta/template[2]/location[2]/label[1]"),
        ({"update": ""}, "/nta/template[2]/transition[2]/label[2]"),
        ({"update": "nothing"}, "/nta/template[2]/transition[2]/label[2]"),
        ({"system": "R = Nobody();"}, "/nta/system"),
    ],
)
def test_a_mistake_in_xml_has_the_path_of_its_element(
    wrong: dict[str, str], place: str, tmp_path: Path
) -> None:
    path = tmp_path / "m.xml"
    path.write_text(XML.format(**RIGHT | wrong), "utf-8")
    with pytest.raises(RejectedError) as caught:
        ntagen.load(path)
    lines = reported(str(caught.value), Path("other.xml"))
    assert {line.partition(": ")[0] for line in lines} == {f"{path}:{place}"}
    assert all(": [error] " in line and line.endswith(".") for line in lines)


def test_a_mistake_in_a_query_of_the_model_has_its_number(tmp_path: Path) -> None:
    path = tmp_path / "m.xml"
    path.write_text(XML.format(**RIGHT), "utf-8")
    model = ntagen.load(path)
    texts = [query.text for query in model.queries if query.text.strip()]
    places = places_of_queries(texts, path, in_model=True)
    assert places == ["/nta/queries/query[2]/formula", "/nta/queries/query[3]/formula"]
    with pytest.raises(RejectedError) as caught:
        model.check(texts[1])
    (line, *_) = reported(str(caught.value), path)
    assert line.startswith(f"{path}:/nta/queries/query[3]/formula: [error] ")


def test_a_mistake_in_a_text_file_has_its_line(tmp_path: Path) -> None:
    path = tmp_path / "m.xta"
    path.write_text("int x;\nprocess P() { state A; init A; }\nsystem P, Q;\n", "utf-8")
    with pytest.raises(RejectedError) as caught:
        ntagen.load(path)
    (line, *_) = reported(str(caught.value), path)
    assert line.startswith(f"{path}:3: [error] ")


def test_a_syntax_error_says_so() -> None:
    (line,) = reported("a.q:2:1: error[E0105]: expected an expression\n  | A[]", Path("m.xml"))
    assert line == "a.q:2: [error] syntax error: expected an expression."


def test_a_message_without_a_place_is_about_the_model() -> None:
    assert reported("error: it is too large\nhint: …", Path("m.xml")) == [
        "m.xml: [error] it is too large."
    ]


def test_queries_of_a_file_have_their_lines(tmp_path: Path) -> None:
    path = tmp_path / "m.q"
    path.write_text("// one\nE<> P.A\n\nA[] x <= 2 &&\\\n  true\n\nE<> P.A\n", "utf-8")
    texts = ["E<> P.A", "A[] x <= 2 && true", "E<> P.A"]
    assert places_of_queries(texts, path, in_model=False)[0] == f"{path}:2"
    assert places_of_queries(texts, path, in_model=False)[2] == f"{path}:7"


def test_a_broken_file_has_no_elements() -> None:
    assert element_at(b"<nta><template>", 1, 4) is None
