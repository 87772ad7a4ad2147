"""The arrows that show an edge are those of the same edge in the engine, in many models."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from ntagen import checker
from ntagen.errors import NtagenError
from ntagen.simulator.arrows import drawn_edges
from tests.simulated import CROSSING, LAMP, MATCHES, Talk

CORPUS = Path(__file__).parents[2] / "corpus"

BRANCHING = """<nta><declaration>chan c;</declaration>
<template><name>P</name><parameter>const int n</parameter>
<location id="a"><name>A</name></location><location id="b"><name>B</name></location>
<location id="c"><name>C</name></location><branchpoint id="p"/><branchpoint id="q"/>
<init ref="a"/>
<transition><source ref="b"/><target ref="a"/></transition>
<transition><source ref="p"/><target ref="b"/></transition>
<transition><source ref="a"/><target ref="p"/></transition>
<transition><source ref="p"/><target ref="c"/></transition>
<transition><source ref="c"/><target ref="q"/></transition>
<transition><source ref="q"/><target ref="a"/>
<label kind="guard">n &gt; 1</label></transition>
<transition><source ref="q"/><target ref="b"/></transition>
<transition><source ref="c"/><target ref="c"/>
<label kind="select">i : int[1, n]</label></transition>
<transition><source ref="c"/><target ref="a"/></transition>
</template><system>P0 = P(0); P2 = P(2); system P0, P2;</system></nta>"""


def check(model: checker.Model) -> int:
    """Each edge has arrows from its source to its targets; how many edges there are."""
    count, network = 0, json.loads(model.network_json())
    for process, raw in zip(model.processes, network["processes"], strict=True):
        template = model.template(process.template)
        number_of = {one.id: number for number, one in enumerate(template.locations)}
        drawn = drawn_edges(template, raw["edges"])
        for edge, legs in zip(raw["edges"], drawn, strict=True):
            arrows = [[template.edges[number] for number in leg] for leg in legs]
            assert {number_of[leg[0].source] for leg in arrows} == {edge["source"]}
            assert [number_of[leg[-1].target] for leg in arrows] == edge["targets"]
            count += 1
    return count


def test_edges_have_the_arrows_of_the_picture() -> None:
    for text in (LAMP, CROSSING, MATCHES):
        assert check(checker.load(text)) >= 3


def test_branch_points_and_edges_that_are_left_out() -> None:
    model = checker.load(BRANCHING)
    first, second = (one["edges"] for one in json.loads(model.network_json())["processes"])
    assert len(first) != len(second)
    check(model)
    assert drawn_edges(model.template("P"), second)[:2] == [[[0]], [[2, 1], [2, 3]]]
    opened = Talk(BRANCHING)("open")["model"]
    assert [one["template"] for one in opened["processes"]] == [0, 1]
    assert [one["name"] for one in opened["templates"]] == ["P", "P"]


@pytest.mark.slow
def test_the_arrows_of_many_models() -> None:
    count = 0
    for path in sorted([*CORPUS.rglob("*.xta"), *CORPUS.rglob("*.xml")]):
        try:
            model = checker.model.load_file(path)
        except NtagenError:
            continue
        # Two locations of this one have the same id, so that an edge of it is in no picture.
        if path.name != "ignored_parts.xml":
            count += check(model)
    assert count > 300
