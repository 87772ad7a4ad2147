"""What an editor is told of a model: its mistakes, what may be typed, where names are declared."""

from __future__ import annotations

from typing import Any

import pytest

from ntagen.checker.survey import Texts, survey_json
from ntagen.document.document import Document
from ntagen.document.names import Names
from ntagen.document.wishes import fulfil
from tests.edited import GATE

GUARD = "templates/0/edges/0/guard"


def told(text: str = GATE, name: str = "gate.xml", **texts: str) -> tuple[Document, Names]:
    """A document after its texts were set, and its names."""
    document = Document(text.encode())
    for address, new in texts.items():
        fulfil(document, {"do": "text", "address": address.replace("__", "/"), "text": new})
    return document, Names(document, survey_json(Texts(name, document.text.decode())))


def completed(document: Document, names: Names, address: str, at: int) -> dict[str, Any]:
    content = document.content(address)
    return names.completions(address, "" if content is None else content.text, at)


def labels(found: dict[str, Any]) -> set[str]:
    return {one["label"] for one in found["options"]}


def test_a_mistake_has_its_place_in_its_text() -> None:
    _, names = told(templates__0__edges__0__guard="count < 9 && sinec >= 1")
    (mistake,) = names.mistakes()
    assert mistake["at"] == {"address": GUARD, "from": 13, "to": 18}
    assert (mistake["code"], mistake["severity"]) == ("E0201", "error")
    (mistake,) = names.mistakes(whole=True)
    whole = GATE.index("count &lt; 9") + len("count &lt; 9 &amp;&amp; ")
    assert mistake["at"] == {"address": "text", "from": whole, "to": whole + 5}


def test_places_count_as_in_a_browser() -> None:
    # A character beyond the first 65,536 is two units of UTF-16.
    _, names = told(declaration="/* 😀 */ chan open, close; clock c; int n = m;")
    places = {one["at"]["from"] for one in names.mistakes() if "'m'" in one["message"]}
    assert places == {len("/* 😀 */ chan open, close; clock c; int n = ") + 1}


def test_a_model_without_mistakes_has_none() -> None:
    assert told()[1].mistakes() == []


def test_names_of_the_place_are_completed() -> None:
    document, names = told(templates__0__edges__0__guard="count < 9 && sin")
    found = completed(document, names, GUARD, 16)
    assert found["from"] == 13
    assert {"since", "quick", "count", "LIMIT", "forall"} <= labels(found)
    assert not {"Open", "A[]", "typedef"} & labels(found) - {"Open"}
    (since,) = (one for one in found["options"] if one["label"] == "since")
    assert (since["kind"], since["detail"]) == ("clock", "clock since")
    # A label that the file does not have yet knows what its template knows.
    assert "since" in labels(completed(document, names, "templates/0/edges/1/guard", 0))
    assert "since" not in labels(completed(document, names, "templates/1/edges/0/guard", 0))
    assert {"A[]", "Gate"} <= labels(completed(document, names, "queries/0/formula", 0))


def test_what_was_typed_since_then_is_completed() -> None:
    document, names = told()
    fulfil(document, {"do": "text", "address": "declaration", "text": "int n;"})
    fulfil(document, {"do": "text", "address": GUARD, "text": "count < 9 && since >= 1 && LIM"})
    found = completed(document, names, GUARD, 30)
    assert found["from"] == 27
    assert "LIMIT" in labels(found)


def test_what_follows_a_dot_is_completed() -> None:
    document, names = told(queries__0__formula="E<> Gate.Op")
    found = completed(document, names, "queries/0/formula", 11)
    assert found["from"] == 9
    assert {"Open", "Shut", "since"} <= labels(found)
    assert "count" not in labels(found)
    assert labels(completed(document, names, "queries/0/formula", 4)) >= {"Gate", "count"}


def test_fields_of_fields_are_completed() -> None:
    text = (
        "typedef struct { int width; } part;\nstruct { part left[2]; } whole;\n"
        "process P() { state A; init A; trans A -> A { guard whole.left[1].w; }; }\nsystem P;\n"
    )
    document, names = told(text, "model.xta")
    at = text.index("left[1].w") + len("left[1].w")
    assert labels(completed(document, names, "text", at)) == {"width"}


@pytest.mark.parametrize(
    ("address", "at", "found"),
    [
        (GUARD, 2, {"address": "declaration", "from": 76, "to": 81}),
        (GUARD, 14, {"address": "templates/0/declaration", "from": 6, "to": 11}),
        ("queries/0/formula", 11, {"address": "templates/0/locations/1/name", "from": 0, "to": 4}),
        ("system", 8, {"address": "templates/0/name", "from": 0, "to": 4}),
    ],
)
def test_a_name_leads_to_its_declaration(address: str, at: int, found: dict[str, Any]) -> None:
    document, names = told()
    told_at = names.definition(address, at)["at"]
    text = document.content(told_at["address"])
    assert text is not None
    assert told_at["address"] == found["address"]
    assert text.text[told_at["from"] : told_at["to"]] == names.definition(address, at)["name"]
    assert told_at["to"] - told_at["from"] == found["to"] - found["from"]


def test_what_has_no_name_leads_nowhere() -> None:
    _, names = told()
    assert names.definition(GUARD, 7) == {}
    assert names.definition("templates/1/edges/0/guard", 0) == {}
