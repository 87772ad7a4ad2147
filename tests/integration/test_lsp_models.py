"""The language server on models and queries, as an editor sees it."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from lsprotocol import types
from pygls.exceptions import JsonRpcException

from ntagen.checker.survey import Texts, survey
from tests.benchmarks.editor import typed
from tests.integration.test_lsp import MOST_S, Editor, editor, identified

MODEL = """\
// How often.
const int N = 3;
chan c[N];
typedef struct { int a; bool b; } pair;
pair s;
process P(const int id) {
  clock x;
  int n; // counted
  state A { x <= 5 }, B;
  init A;
  trans A -> B { guard x > 1 && n < N; sync c[id]!; assign n = 1, s.a = n; };
}
process Q() { state A; init A; trans A -> A { select i : int[0, 2]; sync c[i]?; }; }
p = P(1);
q = Q();
system p, q;
"""
QUERIES = "E<> p.B // Größe\nA[] p.n < 1 // EXPECT:F\n"

XML = """\
<?xml version="1.0" encoding="utf-8"?>
<nta>
  <declaration>int limit = 3; // größer &lt; kleiner
clock x;</declaration>
  <template>
    <name>P</name>
    <location id="a"><name>A</name><label kind="invariant">x &lt;= limit</label></location>
    <location id="b"><name>B</name></location>
    <init ref="a"/>
    <transition><source ref="a"/><target ref="b"/>
      <label kind="guard">x &lt; limit &amp;&amp; limit &gt; 1</label></transition>
  </template>
  <system>system P;</system>
  <queries>
    <query><formula>A[] P.A imply x &lt;= limit</formula><comment/></query>
    <query><formula>strategy S = control: A&lt;&gt; P.B</formula><comment/></query>
    <query><formula>A&lt;&gt; P.B under S</formula><comment/></query>
  </queries>
</nta>
"""

Session = Callable[[Editor, str, str], Awaitable[None]]


def run(tmp_path: Path, session: Session, name: str = "a.xta", model: str = MODEL) -> None:
    """A session with a model and its queries, which are on the disk, and of which none is open."""
    (tmp_path / name).write_text(model, "utf-8")
    queries = tmp_path / "a.q"
    if not name.endswith(".xml"):
        queries.write_text(QUERIES, "utf-8")

    async def whole() -> None:
        async with editor() as client:
            await session(client, (tmp_path / name).as_uri(), queries.as_uri())

    asyncio.run(whole())


def at(text: str, words: str, mark: str = "|") -> types.Position:
    """The place of a bar in words of a text, or of the beginning of the words."""
    plain = words.replace(mark, "")
    start = text.index(plain) + max(0, words.find(mark))
    line = text.count("\n", 0, start)
    before = text[text.rfind("\n", 0, start) + 1 : start]
    return types.Position(line, len(before.encode("utf-16-le")) // 2)


async def words_at(client: Editor, uri: str, place: types.Position) -> list[str]:
    params = types.CompletionParams(identified(uri), place)
    found = await asyncio.wait_for(client.text_document_completion_async(params), MOST_S)
    assert isinstance(found, list)
    return [one.label for one in found]


def applied(text: str, edits: Any) -> str:  # noqa: ANN401  of the protocol
    lines = text.splitlines(keepends=True)
    for one in sorted(edits, key=lambda edit: edit.range.start, reverse=True):
        start, end = one.range.start, one.range.end
        assert start.line == end.line
        line = lines[start.line].encode("utf-16-le")
        new = line[: 2 * start.character] + one.new_text.encode("utf-16-le")
        lines[start.line] = (new + line[2 * end.character :]).decode("utf-16-le")
    return "".join(lines)


def test_mistakes_of_a_model_and_of_its_queries(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, queries: str) -> None:
        assert await client.open(model, MODEL) == []
        assert await client.mistakes(queries) == []
        (mistake,) = await client.change(model, 2, MODEL.replace("n < N;", "n < M;"))
        assert (mistake.code, mistake.message.split("\n")[0]) == ("E0201", "'M' is not declared")
        assert mistake.range.start == at(MODEL, "n < |N")
        assert await client.mistakes(queries) == []
        assert await client.change(model, 3, MODEL.replace("state A {", "state C {")) != []
        client.text_document_did_close(types.DidCloseTextDocumentParams(identified(model)))
        while await client.mistakes(model):
            pass

    run(tmp_path, session)


@pytest.mark.slow
def test_places_in_xml_are_those_of_the_file(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, _queries: str) -> None:
        assert await client.open(model, XML) == []
        wrong = XML.replace("&amp;&amp; limit", "&amp;&amp; limt")
        (mistake,) = await client.change(model, 2, wrong)
        assert mistake.range == types.Range(at(wrong, "|limt"), at(wrong, "limt|"))
        assert "in " in mistake.message.split("\n")[1]
        told = await client.hover(model, wrong, "limt")
        assert told is not None
        assert told.startswith("**error[E0201]")
        broken = XML.replace("x &lt; limit &amp;&amp;", "x &lt; lim &am")
        assert await client.change(model, 3, broken) != []
        assert "limit" in await words_at(client, model, at(broken, "x &lt; lim|"))
        assert await words_at(client, model, at(broken, 'kind="gu|ard"')) == []

    run(tmp_path, session, "a.xml", XML)


@pytest.mark.slow
def test_other_xml_has_no_answers(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, _queries: str) -> None:
        other = "<project><name>P</name></project>"
        assert await client.open(model, other) == []
        assert await client.hover(model, other, "P") is None
        assert await words_at(client, model, types.Position(0, 16)) == []
        assert await client.change(model, 2, XML.replace("limit = 3", "limit = x3")) != []

    run(tmp_path, session, "a.xml", XML)


def test_words_and_names(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, queries: str) -> None:
        await client.open(model, MODEL)
        assert await client.hover(model, MODEL, "N; sync") == (
            "```xta\nconst int N = 3\n```\n\nHow often.\n\nconstant on line 2"
        )
        assert await words_at(client, model, at(MODEL, "s.|a = n")) == ["a", "b"]
        found = await words_at(client, model, at(MODEL, "&& |n < N"))
        assert {"n", "id", "x", "N", "imply", "fabs", "INT8_MAX"} <= set(found)
        assert found.index("n") < found.index("N") < found.index("imply") < found.index("fabs")
        assert "i" not in found
        assert await words_at(client, model, at(MODEL, "// How |often")) == []
        typed = QUERIES + "E<> p."
        await client.open(queries, typed)
        assert await words_at(client, queries, types.Position(2, 6)) == ["id", "x", "n", "A", "B"]
        assert {"p", "q", "N", "deadlock"} <= set(
            await words_at(client, queries, types.Position(2, 4))
        )

    run(tmp_path, session)


@pytest.mark.slow
def test_declarations_and_uses(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, queries: str) -> None:
        await client.open(model, MODEL)
        client.show(queries, QUERIES)
        place = at(MODEL, "|n < N")
        found = await client.text_document_definition_async(
            types.DefinitionParams(identified(model), place)
        )
        assert found == types.Location(
            model, types.Range(at(MODEL, "int |n;"), at(MODEL, "int n|;"))
        )
        for declared in (False, True):
            uses = await client.text_document_references_async(
                types.ReferenceParams(types.ReferenceContext(declared), identified(model), place)
            )
            assert [one.uri for one in uses or []] == [model] * (3 + declared) + [queries]
        marked = await client.text_document_document_highlight_async(
            types.DocumentHighlightParams(identified(queries), types.Position(1, 6))
        )
        assert [one.range.start for one in marked or []] == [types.Position(1, 6)]
        outline = await client.text_document_document_symbol_async(
            types.DocumentSymbolParams(identified(model))
        )
        below = {one.name: [inner.name for inner in one.children] for one in outline or []}  # type: ignore[union-attr]
        assert below == {
            **{name: [] for name in ("N", "c", "pair", "s", "p", "q")},
            "P": ["id", "x", "n", "A", "B"],
            "Q": ["A"],
        }

    run(tmp_path, session)


def test_a_name_is_changed_in_both_files(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, queries: str) -> None:
        await client.open(model, MODEL)
        place = at(MODEL, "|n < N")
        wanted = types.PrepareRenameParams(identified(model), place)
        prepared = await client.text_document_prepare_rename_async(wanted)
        assert isinstance(prepared, types.PrepareRenamePlaceholder)
        assert prepared.placeholder == "n"
        edit = await client.text_document_rename_async(
            types.RenameParams(identified(model), place, "count")
        )
        assert edit is not None
        assert edit.changes is not None
        after = Texts(
            "a.xta",
            applied(MODEL, edit.changes[model]),
            "a.q",
            applied(QUERIES, edit.changes[queries]),
        )
        assert "count < N" in after.model
        assert "int count; // counted" in after.model
        assert "p.count < 1" in after.queries
        assert survey(after).mistakes == ()

    run(tmp_path, session)


@pytest.mark.slow
def test_a_name_in_xml_is_changed_and_nothing_else(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, _queries: str) -> None:
        await client.open(model, XML)
        edit = await client.text_document_rename_async(
            types.RenameParams(identified(model), at(XML, "int |limit"), "most")
        )
        assert edit is not None
        assert edit.changes is not None
        assert applied(XML, edit.changes[model]) == XML.replace("limit", "most")

    run(tmp_path, session, "a.xml", XML)


REFUSED = [
    ("|n < N", "id", "id would mean `const int id` on line 11"),
    ("|n < N", "N", "N would mean `int N` on line 11"),
    ("|n < N", "1a", "1a is no name"),
    ("|n < N", "control", "control is no name"),
    ("|n < N", "A", "A would mean `int A`"),
    ("// |How", "x", "no name stands here"),
]


def test_a_name_that_would_change_the_meaning_is_refused(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, _queries: str) -> None:
        await client.open(model, MODEL)
        for place, name, reason in REFUSED:
            with pytest.raises(JsonRpcException, match=reason):
                await client.text_document_rename_async(
                    types.RenameParams(identified(model), at(MODEL, place), name)
                )

    run(tmp_path, session)


@pytest.mark.slow
def test_layout_of_a_model(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, _queries: str) -> None:
        wanted = types.DocumentFormattingParams(
            identified(model), types.FormattingOptions(tab_size=2, insert_spaces=True)
        )
        await client.open(model, MODEL.replace("  clock x;", "clock  x ;"))
        (edit,) = await client.text_document_formatting_async(wanted) or []
        assert edit.new_text == MODEL
        await client.change(model, 2, MODEL.replace("init A;", "init ;"))
        assert await client.text_document_formatting_async(wanted) is None

    run(tmp_path, session)


async def lenses(client: Editor, uri: str) -> list[types.Command]:
    params = types.CodeLensParams(identified(uri))
    found = await asyncio.wait_for(client.text_document_code_lens_async(params), MOST_S)
    return [one.command for one in found or [] if one.command is not None]


async def press_lens(client: Editor, command: types.Command) -> None:
    await client.workspace_execute_command_async(
        types.ExecuteCommandParams(command.command, command.arguments)
    )


async def answered(client: Editor, uri: str) -> list[str]:
    """The titles of the lenses once no check runs."""
    for _ in range(int(MOST_S / 0.1)):
        titles = [one.title for one in await lenses(client, uri)]
        if "checking; stop" not in titles:
            return titles
        await asyncio.sleep(0.1)
    raise AssertionError("a check did not end")


@pytest.mark.slow
def test_queries_are_checked_where_they_stand(tmp_path: Path) -> None:
    async def session(client: Editor, model: str, queries: str) -> None:
        await client.open(queries, QUERIES.replace("EXPECT:F", "EXPECT:T"))
        first, second = await lenses(client, queries)
        assert first.title == "check this query"
        await press_lens(client, second)
        assert [one.title for one in await lenses(client, queries)][1] == "checking; stop"
        words = "not satisfied (expected: satisfied)"
        assert await answered(client, queries) == ["check this query", f"{words}; check again"]
        (hint,) = (
            await client.text_document_inlay_hint_async(
                types.InlayHintParams(
                    identified(queries), types.Range(types.Position(0, 0), types.Position(9, 0))
                )
            )
            or []
        )
        assert (hint.position, hint.label) == (types.Position(1, 11), words)
        await client.open(model, MODEL + "\n")
        assert {one.title for one in await lenses(client, queries)} == {"check this query"}

    run(tmp_path, session)


@pytest.mark.slow
def test_a_query_under_a_strategy_is_checked_with_it_and_a_check_is_stopped(
    tmp_path: Path,
) -> None:
    async def session(client: Editor, model: str, _queries: str) -> None:
        # The text is not that of the file.
        await client.open(model, XML.replace("limit = 3", "limit = 4"))
        *_, last = await lenses(client, model)
        await press_lens(client, last)
        assert (await answered(client, model))[2].endswith("; check again")
        first = (await lenses(client, model))[0]
        await press_lens(client, first)
        stop = (await lenses(client, model))[0]
        assert stop.title == "checking; stop"
        await press_lens(client, stop)
        assert (await lenses(client, model))[0].title == "check this query"

    run(tmp_path, session, "a.xml", XML)


@pytest.mark.slow
def test_queries_without_a_model_have_their_forms_checked(tmp_path: Path) -> None:
    async def session(client: Editor, _model: str, queries: str) -> None:
        (tmp_path / "a.xta").unlink()
        shown: list[str] = []

        @client.feature(types.WINDOW_SHOW_MESSAGE)
        def _show(params: types.ShowMessageParams) -> None:
            shown.append(params.message)

        assert await client.open(queries, "E<> p.B\n") == []
        (mistake,) = await client.change(queries, 2, "E<> p.B +\n")
        assert mistake.code == "E0105"
        assert len(shown) == 1
        assert "there is no model beside" in shown[0]

    run(tmp_path, session)


@pytest.mark.slow
def test_any_edit_has_an_answer(tmp_path: Path) -> None:
    """A smaller version of the benchmark `tests/benchmarks/editor.py`."""

    async def session(client: Editor, model: str, _queries: str) -> None:
        path = Path(model.removeprefix("file://"))
        assert len(await typed(client, path, 200, random.Random(7))) == 200

    run(tmp_path, session, "a.xml", XML)
