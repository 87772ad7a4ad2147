"""Models as texts: changes look as if made by hand, and the rest stays byte for byte."""

from __future__ import annotations

import re

import pytest

from ntagen import build
from ntagen.document.document import Document
from ntagen.document.wishes import fulfil
from ntagen.errors import InputError
from tests.edited import GATE, hunks

DATA = GATE.encode()


def edited(do: str, address: str = "", **wish: object) -> tuple[Document, str]:
    """The document after a wish; it can be taken back and made again."""
    document = Document(DATA)
    shown = fulfil(document, {"do": do, "address": address, **wish})
    after = document.file()
    assert fulfil(document, {"do": "undo"}) == address
    assert document.file() == DATA
    assert not document.is_changed
    fulfil(document, {"do": "redo"})
    assert document.file() == after
    return document, shown


def texts_of(document: Document) -> dict[str, str]:
    return {
        name: found.text
        for name, _ in document.outline.texts()
        if (found := document.content(name))
    }


def test_all_texts_have_addresses() -> None:
    texts = texts_of(Document(DATA))
    assert texts["declaration"].startswith("// Both templates know these.\nchan")
    assert texts["templates/0/declaration"] == "clock since; bool quick() { return count < 3; }"
    assert texts["templates/0/locations/1/invariant"] == "since <= LIMIT"
    assert texts["templates/0/edges/0/guard"] == "count < 9 && since >= 1"
    assert texts["queries/0/formula"] == "E<> Gate.Open"
    assert texts["system"] == "system Gate, User;"


@pytest.mark.parametrize("address", sorted(texts_of(Document(DATA))))
@pytest.mark.parametrize("new", ["", "x < 1 && y > 2\n  && z", "é ]]> &amp; <b>", "]]>", "]"])
def test_a_text_is_replaced_in_one_hunk(address: str, new: str) -> None:
    document, shown = edited("text", address, text=new)
    assert shown == address
    assert texts_of(document) == texts_of(Document(DATA)) | {address: new}
    assert hunks(DATA, document.file()) == 1


@pytest.mark.parametrize("address", sorted(texts_of(Document(DATA))))
def test_what_is_typed_into_a_text_changes_nothing_else(address: str) -> None:
    old = texts_of(Document(DATA))[address]
    middle = len(old) // 2
    document, _ = edited("text", address, text=f"{old[:middle]}#{old[middle:]}")
    first, _, second = document.file().partition(b"#")
    assert first + second == DATA


def test_a_text_that_the_file_lacks_is_added() -> None:
    document, _ = edited("text", "templates/1/edges/0/guard", text="n < 1")
    found = rb'open!</label>\n\t\t\t<label kind="guard" x="-?\d+" y="-?\d+">n &lt; 1</label>\n'
    assert re.search(found, document.file())
    assert hunks(DATA, document.file()) == 1
    document, _ = edited("text", "templates/0/parameter", text="int n")
    assert b"Gate</name>\n\t\t<parameter>int n</parameter>\n\t\t<declaration>" in document.file()
    document, _ = edited("text", "templates/1/locations/0/name", text="Idle")
    assert b'y="0">\n\t\t\t<name' in document.file()
    assert build.parse(document.file().decode()).templates[1].locations[0].name == "Idle"
    document, _ = edited("text", "templates/1/locations/0/invariant", text="x<1")
    assert build.parse(document.file().decode()).templates[1].locations[0].invariant == "x<1"
    # A file on one line stays on one line.
    short = Document(b"<nta><template><name>P</name></template><system>system P;</system></nta>")
    fulfil(short, {"do": "text", "address": "declaration", "text": "int n;"})
    assert short.file().startswith(b"<nta><declaration>int n;</declaration><template>")


def test_an_empty_text_that_the_file_lacks_is_not_added() -> None:
    document = Document(DATA)
    fulfil(document, {"do": "text", "address": "templates/1/edges/0/guard", "text": ""})
    assert document.file() == DATA


def test_a_location_is_added_as_those_around_it() -> None:
    document, shown = edited("add-location", "templates/0", name="Ajar", kind="urgent", x=None)
    assert shown == "templates/0/locations/2"
    new = (
        b'\t\t<location id="id3" x="340" y="0">\n\t\t\t<name x="330" y="-34">Ajar</name>\n'
        b"\t\t\t<urgent/>\n\t\t</location>\n"
    )
    assert document.file() == DATA.replace(b'\t\t<init ref="id0"/>', new + b'\t\t<init ref="id0"/>')


def test_an_edge_is_added_with_its_labels() -> None:
    wish = {"source": "id1", "target": "id1", "guard": "since > 2", "assignment": "since = 0"}
    document, shown = edited("add-edge", "templates/0", controllable=False, **wish)
    assert shown == "templates/0/edges/2"
    assert hunks(DATA, document.file()) == 1
    edge = build.parse(document.file().decode()).templates[0].edges[2]
    assert (edge.guard, edge.update, edge.controllable) == ("since > 2", "since = 0", False)
    assert len(edge.nails) == 2  # a loop


def test_queries_templates_and_branch_points_are_added() -> None:
    document, shown = edited("add-query", formula="A[] count < 9", comment="few")
    assert shown == "queries/1"
    assert document.content("queries/1/formula").text == "A[] count < 9"  # type: ignore[union-attr]
    document, shown = edited("add-template", name="Third")
    assert shown == "templates/2"
    assert document.outline.told()["templates"][2]["locations"][0]["initial"]
    document, shown = edited("add-branch-point", "templates/1", x=10, y=20)
    assert document.outline.told()["templates"][1]["branch_points"] == [
        {"id": "id3", "place": [10, 20]}
    ]
    bare = Document(b"<nta>\n  <system>system P;</system>\n</nta>\n")
    fulfil(bare, {"do": "add-query", "formula": "E<> true"})
    assert b"</system>\n  <queries>\n    <query>\n" in bare.file()


def test_parts_are_removed_with_what_needs_them() -> None:
    document, _ = edited("remove", "templates/0/edges/0")
    assert hunks(DATA, document.file()) == 1
    assert b"\n\n" not in document.file()
    document, _ = edited("remove", "templates/0/locations/0")
    model = build.parse(document.file().decode())
    assert [one.name for one in model.templates[0].locations] == ["Open"]
    assert model.templates[0].edges == []
    assert model.templates[0].initial is model.templates[0].locations[0]
    document, _ = edited("remove", "queries/0")
    assert document.outline.queries == []
    document, _ = edited("remove", "templates/1/locations/0")
    assert b'<init ref="id2"/>' not in document.file()


def test_locations_and_bends_move() -> None:
    document, _ = edited("move", "templates/0/locations/0", x=8, y=-16)
    assert b'<location y="-16" x="8" id="id0">\n\t\t\t<name x="-2" y="-50">' in document.file()
    assert hunks(DATA, document.file()) == 1
    document, _ = edited("move-bend", "templates/0/edges/1", number=0, x=50, y=60)
    assert b'<nail x="50" y="60"/>' in document.file()
    document, _ = edited("move-bend", "templates/0/edges/1", number=1, x=1, y=2)
    assert b'<nail x="102" y="68"/><nail x="1" y="2"/></transition>' in document.file()
    document, _ = edited("remove-bend", "templates/0/edges/1", number=0)
    assert b"<nail" not in document.file()


def test_locations_without_a_place_get_one_before_one_is_moved() -> None:
    text = GATE.replace('y="0" x="0" id="id0"', 'id="id0"').replace(' x="204" y="0"', "")
    document = Document(text.encode())
    fulfil(document, {"do": "move", "address": "templates/0/locations/0", "x": 7, "y": 9})
    first, second = document.outline.told()["templates"][0]["locations"]
    assert first["place"] == [7, 9]
    assert second["place"] not in (None, [7, 9])


def test_kinds_owners_and_starts_change() -> None:
    document, _ = edited("kind", "templates/0/locations/1", kind="committed")
    assert b"</label>\n\t\t\t<committed/>\n\t\t</location>" in document.file()
    fulfil(document, {"do": "kind", "address": "templates/0/locations/1", "kind": "urgent"})
    fulfil(document, {"do": "kind", "address": "templates/0/locations/1", "kind": "normal"})
    assert document.file() == DATA
    document, _ = edited("initial", "templates/0/locations/1")
    assert document.file() == DATA.replace(b'init ref="id0"', b'init ref="id1"')
    document, _ = edited("end", "templates/0/edges/0", end="target", to="id0")
    assert document.file() == DATA.replace(b'target ref="id1"', b'target ref="id0"')
    document, _ = edited("controllable", "templates/0/edges/0", controllable=False)
    assert b'<transition controllable="false">' in document.file()


def test_typing_is_one_edit() -> None:
    document = Document(DATA)
    for text in ("a", "ab", "abc"):
        fulfil(document, {"do": "text", "address": "system", "text": text, "join": True})
    fulfil(document, {"do": "text", "address": "system", "text": "abc d", "join": False})
    fulfil(document, {"do": "undo"})
    assert document.content("system").text == "abc"  # type: ignore[union-attr]
    fulfil(document, {"do": "undo"})
    assert document.file() == DATA
    fulfil(document, {"do": "redo"})
    fulfil(document, {"do": "redo"})
    assert document.content("system").text == "abc d"  # type: ignore[union-attr]


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_encodings_and_line_ends_stay(encoding: str, line_end: str) -> None:
    named = GATE.replace("utf-8", encoding.partition("-sig")[0])
    data = named.replace("by hand", "by hånd").replace("\n", line_end).encode(encoding)
    document = Document(data)
    assert document.file() == data
    text = document.content("declaration").text  # type: ignore[union-attr]
    fulfil(document, {"do": "text", "address": "declaration", "text": text + "\n// → ü"})
    assert document.content("declaration").text == text + "\n// → ü"  # type: ignore[union-attr]
    arrow = "&#8594;" if encoding == "latin-1" else "→"
    end = f"// how often{line_end}// {arrow} ü</declaration>".encode(encoding.removesuffix("-sig"))
    assert encoding == "utf-16" or end in document.file()
    fulfil(document, {"do": "undo"})
    assert document.file() == data


def test_comments_in_a_text_and_written_carriage_returns_stay() -> None:
    data = b"<nta><declaration>int a;<!-- kept -->&#13;\nint b;</declaration></nta>"
    document = Document(data)
    assert document.content("declaration").text == "int a;\nint b;"  # type: ignore[union-attr]
    fulfil(document, {"do": "text", "address": "declaration", "text": "int a;\nint c;"})
    assert document.file() == data.replace(b"int b", b"int c")
    fulfil(document, {"do": "text", "address": "declaration", "text": "int c;"})
    assert b"<!-- kept -->" in document.file()


def test_the_text_of_a_model_that_is_no_xml_is_one_text() -> None:
    data = b"process P() { state A; init A; }\r\nsystem P;\r\n"
    document = Document(data)
    assert not document.has_parts
    assert not document.problem
    with pytest.raises(InputError, match="is one text"):
        fulfil(document, {"do": "add-template", "name": "Q"})
    fulfil(
        document,
        {"do": "text", "address": "text", "text": "process Q() { state A; init A; }\nsystem P;\n"},
    )
    assert document.file() == data.replace(b"P()", b"Q()")


def test_a_file_that_is_not_well_formed_is_edited_as_a_whole_and_comes_back() -> None:
    document = Document(DATA.replace(b"</queries>", b""))
    assert "not well-formed" in document.problem
    with pytest.raises(InputError, match="edit the whole text"):
        fulfil(document, {"do": "text", "address": "system", "text": "x"})
    whole = document.content("text").text  # type: ignore[union-attr]
    whole = whole.replace("</query>\n", "</query>\n\t</queries>\n")
    fulfil(document, {"do": "text", "address": "text", "text": whole})
    assert not document.problem
    assert document.content("system").text == "system Gate, User;"  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        ({"do": "format"}, "nothing that can be done"),
        ({"do": ["text"]}, "do is no text"),
        ({}, "nothing that can be done"),
        ({"do": "text", "address": "templates/9/name", "text": ""}, "no templates/9"),
        ({"do": "text", "address": "templates/0/edges/0/color", "text": ""}, "no templates"),
        ({"do": "text", "address": "templates/-1/name", "text": ""}, "no templates"),
        ({"do": "text", "address": 7, "text": ""}, "address is no text"),
        ({"do": "text", "address": "system", "text": "\0"}, "U\\+0000"),
        ({"do": "text", "address": "system", "text": "\ud800"}, "U\\+D800"),
        ({"do": "add-template", "name": " "}, "a template has a name"),
        ({"do": "add-location", "address": "templates/0", "kind": "slow"}, "urgent, committed"),
        ({"do": "add-location", "address": "queries/0", "name": "A"}, "only templates"),
        ({"do": "add-edge", "address": "templates/0", "source": "id0", "target": "id2"}, "'id2'"),
        ({"do": "move", "address": "templates/0/edges/0", "x": 0, "y": 0}, "only locations"),
        ({"do": "move", "address": "templates/0/locations/0", "x": 1.5, "y": 0}, "whole number"),
        ({"do": "move", "address": "templates/0/locations/0", "x": 10**9, "y": 0}, "too far away"),
        (
            {"do": "move-bend", "address": "templates/0/edges/1", "number": 3, "x": 0, "y": 0},
            "bend",
        ),
        ({"do": "end", "address": "templates/0/edges/1", "end": "source", "to": "id2"}, "'id2'"),
        (
            {"do": "end", "address": "templates/0/edges/1", "end": "label", "to": "id1"},
            "only edges",
        ),
        ({"do": "end", "address": "queries/0", "end": "source", "to": "id1"}, "only edges"),
        ({"do": "initial", "address": "templates/0/edges/1"}, "starts in a location"),
        ({"do": "remove", "address": "declaration"}, "no declaration"),
    ],
)
def test_what_cannot_be_done_is_refused(wish: dict[str, object], message: str) -> None:
    document = Document(DATA)
    with pytest.raises(InputError, match=message):
        fulfil(document, wish)
    assert document.file() == DATA


def test_a_character_that_the_encoding_of_a_text_lacks_is_refused() -> None:
    document = Document("// å\nsystem P;\n".encode("latin-1"))
    with pytest.raises(InputError, match="latin-1, which has no '→'"):
        fulfil(document, {"do": "text", "address": "text", "text": "// å →\nsystem P;\n"})


def test_entities_of_a_file_leave_only_the_whole_text() -> None:
    document = Document(b'<!DOCTYPE nta [<!ENTITY n "9">]><nta><system>system P;</system></nta>')
    assert "declares entities" in document.problem


def test_names_and_mistakes_are_only_text_in_a_picture() -> None:
    data = GATE.replace("Shut", "&lt;script&gt;alert(1)&lt;/script&gt;").encode()
    picture = Document(data).picture(0)
    assert "<script" not in picture
    assert picture.count('class="location"') == 2
