"""Edits of models at random: the rest stays as it was, and everything can be taken back."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.document.document import Document
from ntagen.document.wishes import fulfil
from ntagen.errors import InputError
from tests.edited import GATE

PIECES = st.sampled_from(
    [
        *("a", "é", "😀", "\n", "\r\n", "\t", "<", ">", "&", "]]>", "]", "<![CDATA["),
        *("<!-- c -->", "&amp;", "&#10;", "&#13;", "'", '"', "x <= 3 && y"),
    ]
)
TEXTS = st.lists(PIECES, max_size=12).map("".join)
KINDS = [
    *("name", "parameter", "declaration", "locations/0/name"),
    *("locations/0/comments", "edges/0/guard", "edges/1/assignment"),
]
ADDRESSES = st.sampled_from(
    ["declaration", "system", "queries/0/formula", "queries/0/comment"]
    + [f"templates/0/{kind}" for kind in (*KINDS, "locations/1/invariant")]
    + [f"templates/1/{kind}" for kind in KINDS]
)
PARTS = st.sampled_from(
    [f"templates/{number}/{kind}" for number in (0, 1) for kind in ("locations/0", "edges/0", "")]
    + ["queries/0", "templates/0"]
)
PLACES = st.integers(-2000, 2000)
WISHES = st.one_of(
    st.fixed_dictionaries(
        {"do": st.just("text"), "address": ADDRESSES, "text": TEXTS, "join": st.booleans()}
    ),
    st.fixed_dictionaries(
        {"do": st.sampled_from(["move", "remove", "initial", "arrange"]), "address": PARTS}
        | {"x": PLACES, "y": PLACES}
    ),
    st.fixed_dictionaries({"do": st.just("add-location"), "address": PARTS, "name": TEXTS}),
    st.fixed_dictionaries(
        {"do": st.just("add-edge"), "address": PARTS, "guard": TEXTS}
        | {"source": st.just("id1"), "target": st.just("id1")}
    ),
    st.fixed_dictionaries({"do": st.just("add-query"), "formula": TEXTS}),
    st.fixed_dictionaries({"do": st.sampled_from(["undo", "redo"])}),
)
ENCODINGS = st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"])


@settings(max_examples=60, deadline=None)
@given(TEXTS, ENCODINGS)
def test_a_document_is_the_file_that_was_read(text: str, encoding: str) -> None:
    data = text.encode(encoding, "replace")
    assert Document(data).file() == data


@settings(max_examples=100, deadline=None)
@given(st.lists(WISHES, max_size=8), ENCODINGS, st.sampled_from(["\n", "\r\n"]))
def test_edits_are_taken_back_one_by_one(
    wishes: list[dict[str, object]], encoding: str, line_end: str
) -> None:
    named = GATE.replace("utf-8", encoding.removesuffix("-sig"))
    data = named.replace("\n", line_end).encode(encoding)
    document = Document(data)
    for wish in wishes:
        before = document.file()
        try:
            fulfil(document, wish)
        except InputError:
            assert document.file() == before
        else:
            assert not document.problem
    after = document.file()
    count = 0
    while document.undo() is not None:
        count += 1
    assert document.file() == data
    for _ in range(count):
        document.redo()
    assert document.file() == after or "undo" in [wish["do"] for wish in wishes]


@settings(max_examples=100, deadline=None)
@given(ADDRESSES, TEXTS, st.sampled_from(["\n", "\r\n"]))
def test_a_text_is_what_was_typed_and_the_others_stay(
    address: str, text: str, line_end: str
) -> None:
    document = Document(GATE.replace("\n", line_end).encode())
    before = {name: document.content(name).text for name, _ in document.outline.texts()}  # type: ignore[union-attr]
    fulfil(document, {"do": "text", "address": address, "text": text})
    after = {name: document.content(name).text for name, _ in document.outline.texts()}  # type: ignore[union-attr]
    typed = text.replace("\r\n", "\n")
    assert after == before | ({address: typed} if typed or address in before else {})
