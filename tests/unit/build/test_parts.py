"""Models made and changed in Python, and the messages about wrong ones."""

from __future__ import annotations

import copy
from pathlib import Path

import pytest

import ntagen
from ntagen import build
from ntagen.errors import InputError


@pytest.fixture
def model() -> build.Model:
    """A train that comes, waits for the gate, and crosses or turns back."""
    model = build.Model(declarations="const int N = 3; chan go; clock x;")
    train = model.template("Train", parameters="const int id")
    safe = train.location("Safe", initial=True)
    coming = train.location("Coming", invariant="x <= 20 && id < 9")
    crossing = train.location("Crossing", rate="2")
    fork = train.branch_point()
    train.edge(safe, "Coming", select="i : int[0, 1]", guard="i == id", sync="go!", update="x = 0")
    train.edge(coming, fork, guard="x >= 3", controllable=False)
    train.edge(fork, crossing, weight="3")
    train.edge(fork, safe, weight="1")
    gate = model.template("Gate")
    free = gate.location("Free", urgent=False, comment="always", initial=True)
    gate.edge(free, free, sync="go?")
    model.system = "T0 = Train(0); T1 = Train(1); system T0, T1, Gate;"
    model.query("E<> T0.Crossing", "it can cross", expect=True)
    model.query("sup{T0.Coming}: x", expect=20)
    return model


def test_a_model_made_in_python_answers_queries(model: build.Model) -> None:
    loaded = model.load()
    assert [process.name for process in loaded.processes] == ["T0", "T1", "Gate"]
    assert [query.expect for query in loaded.queries] == ["satisfied", 20.0]
    assert loaded.check(loaded.queries[0]).satisfied
    assert loaded.check("sup{T0.Coming}: x").value == 20
    assert [edge.controllable for edge in loaded.template("Train").edges] == [
        True,
        False,
        True,
        True,
    ]


def test_written_and_read_again_it_is_equal(model: build.Model, tmp_path: Path) -> None:
    path = tmp_path / "train.xml"
    model.write(path)
    again = build.read(path)
    assert again == model
    assert again.xml() == model.xml() == path.read_text("utf-8")
    assert ntagen.load(path).network_json() == model.load().network_json()


def test_parts_that_say_something_else_are_not_equal(model: build.Model) -> None:
    for change in (
        lambda m: setattr(m["Train"]["Safe"], "invariant", "x <= 3"),
        lambda m: setattr(m["Train"]["Safe"], "name", "Away"),
        lambda m: setattr(m["Train"].edges[0], "target", m["Train"]["Crossing"]),
        lambda m: setattr(m["Train"], "initial", m["Train"]["Coming"]),
        lambda m: setattr(m["Gate"].edges[0], "controllable", False),
        lambda m: setattr(m["Gate"]["Free"], "color", "#ff0000"),
        lambda m: setattr(m.queries[0], "expect", None),
        lambda m: m["Train"].extra.append("<note/>"),
        lambda m: m["Train"].attributes.update(a="1"),
    ):
        other = copy.deepcopy(model)
        assert other == model
        change(other)
        assert other != model
        assert build.parse(other.xml()) == other != model


def test_a_second_initial_location_is_refused_and_not_added() -> None:
    template = build.Model().template("A")
    first = template.location("First", initial=True)
    with pytest.raises(InputError, match="template A, location Second: First is initial already"):
        template.location("Second", initial=True)
    assert template.initial is first
    assert template.locations == [first]


def test_what_exists_can_be_changed(model: build.Model) -> None:
    train = model["Train"]
    train["Coming"].invariant = "x <= 7"
    train.remove(train["Crossing"])
    assert [(edge.source, edge.target) for edge in train.edges] == [
        (train["Safe"], train["Coming"]),
        (train["Coming"], train.branch_points[0]),
        (train.branch_points[0], train["Safe"]),
    ]
    train.remove(train.edges[0])
    assert len(train.edges) == 2
    model.queries.clear()
    answer = model.load().check("E<> T0.Coming")
    assert answer.satisfied is False
    train.remove(train["Safe"])
    with pytest.raises(InputError, match="template Train has no initial location"):
        model.load()


def test_a_sweep_over_a_constant_is_a_loop(model: build.Model) -> None:
    found = []
    model.system = "T0 = Train(0); system T0, Gate;"
    for least in (1, 5):
        model["Train"].edges[1].guard = f"x >= {least}"
        found.append(model.load().check("inf{T0.Crossing}: x").value)
    assert found == [1, 5]


def test_parts_show_what_they_say(model: build.Model) -> None:
    train = model["Train"]
    assert repr(model) == "Model(templates: Train, Gate; 2 queries)"
    assert repr(train) == "Template('Train', 3 locations, 4 edges)"
    assert repr(train["Coming"]) == "Location('Coming', invariant='x <= 20 && id < 9')"
    assert repr(train.edges[1]) == "Edge(Coming → Train.3, guard='x >= 3', controllable=False)"
    assert repr(train.branch_points[0]) == "BranchPoint('Train.3')"
    assert repr(model.queries[1]).startswith("Query('sup{T0.Coming}: x', expect=Outcome(")


def test_places_are_kept_and_missing_ones_are_laid_out(model: build.Model) -> None:
    train = model["Train"]
    assert len({one.position for one in build.parse(model.xml())["Train"].nodes}) == 4
    for number, node in enumerate(train.nodes):
        node.position = (100 * number, -17)
    train["Safe"].labels["name"] = (3, 4)
    train.edges[0].nails = [(50, -60)]
    train.edges[0].labels["guard"] = (51, -61)
    new = train.location("New")
    train.edge(train.location("Newer"), new)
    read = build.parse(model.xml())["Train"]
    assert [one.position for one in read.locations[:3]] == [(0, -17), (100, -17), (200, -17)]
    assert read.branch_points[0].position == (300, -17)
    assert read["Safe"].labels["name"] == (3, 4)
    assert read.edges[0].nails == [(50, -60)]
    assert read.edges[0].labels["guard"] == (51, -61)
    assert read.edges[1].labels.keys() == {"guard"}
    # Those without a place are apart, and below the others.
    below = [read["New"].position, read["Newer"].position]
    assert len(set(below)) == 2
    assert all(place is not None and place[1] > 50 for place in below)
    assert new.position is None


def test_a_notebook_shows_a_template(model: build.Model) -> None:
    picture = model["Train"]._repr_svg_()
    assert picture.startswith("<svg")
    assert "Crossing" in picture


def test_mistakes_are_told_when_they_are_made(model: build.Model) -> None:
    train, gate = model["Train"], model["Gate"]
    with pytest.raises(InputError) as error:
        train.edge("Safe", gate["Free"])
    assert str(error.value) == (
        "template Train, edge Safe → Free: Free is not in this template\n"
        'hint: make it with location("Free") of template Train, or add the edge to its own template'
    )
    with pytest.raises(InputError, match="template Train has a location Safe already\nhint: "):
        train.location("Safe")
    with pytest.raises(InputError, match="the model has a template Gate already\nhint: "):
        model.template("Gate")
    with pytest.raises(InputError, match="edge 3 → Safe: 3 is no location\nhint: "):
        train.edge(3, train["Safe"])  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"no location 'Saf'\nhint: did you mean 'Safe'\?"):
        train.edge("Safe", "Saf")
    with pytest.raises(KeyError, match="no location Saf; it has Safe, Coming, Crossing"):
        train["Saf"]
    with pytest.raises(KeyError, match="no template Trains; the model has Train, Gate"):
        model["Trains"]
    with pytest.raises(InputError, match="is not a part of template Train\nhint: "):
        train.remove(gate["Free"])
    with pytest.raises(InputError, match="cannot expect 'perhaps'\nhint: write True, False"):
        model.query("E<> true", expect="perhaps")
    assert len(train.edges) == 4
    assert len(model.queries) == 2


def test_a_wrong_structure_is_refused_with_all_its_mistakes(model: build.Model) -> None:
    train, gate = model["Train"], model["Gate"]
    train.edges[0].target = gate["Free"]
    train.edges[1].guard = 3  # type: ignore[assignment]
    train["Safe"].name = "Coming"
    train["Crossing"].position = (1, "2")  # type: ignore[assignment]
    train["Crossing"].attributes["a b"] = "c"
    train.name = "Gate"
    gate.initial = train["Crossing"]
    gate.declarations = "\x00"
    gate.extra = ["<note>"]
    gate.locations.append(build.Location("Other"))
    gate.locations.append(gate.locations[0])
    model.system = "  "
    model.queries[0].expect = True  # type: ignore[assignment]
    with pytest.raises(InputError) as error:
        model.xml()
    lines = str(error.value).split("\n")
    assert [line[:6] for line in lines[1::2]] == ["hint: "] * (len(lines) // 2)
    assert lines[::2] == [
        "the model has no system line",
        "the model has two templates Gate",
        "template Gate, location Crossing: 'a b' cannot name an attribute",
        "template Gate, location Crossing: position is (1, '2'), not a place",
        "template Gate: two locations are called Coming",
        "template Gate, edge Coming → Free: Free is not in this template",
        "template Gate, edge Coming → Train.3: guard is 3, not a text",
        "template Gate: declarations has the character U+0000, which XML cannot hold",
        "template Gate: extra has '<note>', which is not XML",
        "template Gate: location 1 has no id",
        "template Gate: location Free is listed twice",
        "template Gate: two locations are called Free",
        "template Gate: two locations have the id Gate.0",
        "template Gate: the initial location Crossing is not in this template",
        "query 1: expect is True, not an outcome",
    ]


def test_what_texts_mean_is_judged_by_the_engine(model: build.Model) -> None:
    model["Train"]["Coming"].invariant = "x <"
    with pytest.raises(ntagen.RejectedError, match="template Train, location Coming, invariant"):
        model.load()
    assert "x &lt;</label>" in model.xml()


def test_only_xml_is_written(model: build.Model, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"hint: call the file train\.xml"):
        model.write(tmp_path / "train.xta")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("verdict", "outcome"),
    [
        (True, ("success", "symbolic", "")),
        (False, ("failure", "symbolic", "")),
        (2.5, ("success", "quantity", "2.5")),
        ("not satisfied", ("failure", "symbolic", "")),
        ("maybe satisfied", ("maybe_true", "symbolic", "")),
    ],
)
def test_expectations_are_outcomes(
    verdict: bool | float | str, outcome: tuple[str, str, str]
) -> None:
    made = build.outcome_of(verdict)
    assert (made.outcome, made.type, made.value) == outcome
