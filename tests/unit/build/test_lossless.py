"""What is read from a file and written again is the same model."""

from __future__ import annotations

from pathlib import Path

import pytest

from ntagen import build, checker
from ntagen.errors import InputError
from ntagen.nsl import load_task
from ntagen.render import render

ROOT = Path(__file__).parents[3]
FILES = sorted(
    path
    for folder in ("tests/corpus", "examples")
    for path in (ROOT / folder).rglob("*.xml")
    if "err" not in path.parts
)

EVERYTHING = """<?xml version="1.0" encoding="utf-8"?>
<!-- written by hand -->
<nta version="2">
  <declaration>// 3 &lt; 4 &amp;&amp; true
chan go; clock x;&#13;
bool b = 4 > 3;</declaration>
  <!-- between -->
  <imports>old</imports>
  <template tool="t">
    <name x="5" y="6">P</name>
    <parameter x="7" y="8">const int n</parameter>
    <declaration><![CDATA[clock y; bool c() { return n < 3 && true; }]]></declaration>
    <location id="a" x="-8" y="0.5" color="#00ff00" tool="u">
      <name x="1" y="2">A</name>
      <label kind="invariant" x="3" y="4">y &lt;= 3</label>
      <label kind="exponentialrate">1</label>
      <label kind="comments" x="5" y="6">a note
of two lines</label>
      <label kind="testcodeEnter">enter();</label>
      <mark/>
    </location>
    <location id="b"><name>B</name><urgent/></location>
    <location id="c"><committed/><label kind="invariant" x="9" y="9"></label></location>
    <branchpoint id="d" x="10" y="20" color="#0000ff"><mark a="1"/></branchpoint>
    <init ref="a"/>
    <transition controllable="false" color="#ff0000" id="e7" action="">
      <source ref="a"/><target ref="d"/>
      <label kind="select" x="1" y="1">i : int[0, 2]</label>
      <label kind="guard">i == n &amp;&amp; c()</label>
      <label kind="synchronisation" x="2" y="-3">go!</label>
      <label kind="comments">why</label>
      <label kind="testcode">press();</label>
      <nail x="30" y="40"/><nail x="50" y="60"/>
    </transition>
    <transition><source ref="d"/><target ref="b"/>
      <label kind="probability">2</label><label kind="assignment">b = false</label></transition>
    <transition><source ref="d"/><target ref="c"/><label kind="probability">1</label></transition>
    <transition><source ref="b"/><target ref="c"/></transition>
    <transition><source ref="c"/><target ref="c"/><label kind="synchronisation">go?</label>
    </transition>
  </template>
  <instantiation>Q = P(1);</instantiation>
  <system>system Q;</system>
  <queries>
    <option key="--extrapolation" value="4"/>
    <query><formula>E&lt;&gt; Q.B</formula><comment>it is
reached</comment><option key="--diagnostic" value="1"/>
      <expect outcome="success" type="symbolic"><resource type="time" value="1" unit="s"/></expect>
      <result outcome="failure" type="quality" timestamp="2020"><details>none</details></result>
      <result outcome="success"/>
    </query>
    <query><formula></formula><comment>a heading</comment></query>
  </queries>
</nta>
"""


def written_again(model: build.Model) -> str:
    """The text of a model, after it has been checked that reading it gives the same."""
    text = model.xml()
    again = build.parse(text)
    assert again == model
    assert again.xml() == text
    for template, other in zip(model.templates, again.templates, strict=True):
        for node, same in zip(template.nodes, other.nodes, strict=True):
            assert node.position in (None, same.position)
        for part, equal in zip(
            [*template.locations, *template.edges], [*other.locations, *other.edges], strict=True
        ):
            assert part.labels.items() <= equal.labels.items()
            if isinstance(part, build.Edge) and isinstance(equal, build.Edge) and part.nails:
                assert part.nails == equal.nails
    return text


def test_the_files_are_there() -> None:
    assert len(FILES) > 5


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_files_give_the_same_network(path: Path) -> None:
    if path.stem == "ignored_parts":
        with pytest.raises(InputError, match="the id a is used twice\nhint: "):
            build.read(path)
        return
    try:
        network = checker.load_file(path).network_json()
    except checker.RejectedError:
        network = None
    text = written_again(build.read(path))
    if network is None:
        with pytest.raises(checker.RejectedError):
            checker.load(text)
    else:
        assert checker.load(text).network_json() == network


@pytest.mark.parametrize("name", ["paper", "stepper"])
def test_generated_models_give_the_same_network(name: str) -> None:
    scene = load_task(ROOT / "examples" / f"{name}.nsl").scene
    text = render(scene, source=f"{name}.nsl")
    written = written_again(build.parse(text))
    assert checker.load(written).network_json() == checker.load(text).network_json()


def test_everything_in_a_file_is_kept() -> None:
    model = build.parse(EVERYTHING)
    text = written_again(model)
    before, after = checker.load(EVERYTHING), checker.load(text)
    assert after.network_json() == before.network_json()
    assert after.queries == before.queries
    assert [query.expect for query in after.queries] == ["satisfied"]
    template = model["P"]
    a, b, c = template.locations
    assert template.labels == {"name": (5, 6), "parameters": (7, 8)}
    assert (a.position, a.color, a.attributes) == ((-8, 0.5), "#00ff00", {"tool": "u"})
    assert (a.invariant, a.rate, a.comment) == ("y <= 3", "1", "a note\nof two lines")
    assert a.labels == {"name": (1, 2), "invariant": (3, 4), "comment": (5, 6)}
    assert (b.urgent, b.committed, c.urgent, c.committed) == (True, False, False, True)
    assert (c.name, c.shown_name, c.labels) == ("", "c", {"invariant": (9, 9)})
    edge = template.edges[0]
    assert (edge.controllable, edge.color) == (False, "#ff0000")
    assert edge.attributes == {"id": "e7", "action": ""}
    assert edge.nails == [(30, 40), (50, 60)]
    assert edge.target is template.branch_points[0]
    assert template.edges[1].weight == "2"
    assert model.queries[0].comment == "it is\nreached"
    assert model.declarations == "// 3 < 4 && true\nchan go; clock x;\r\nbool b = 4 > 3;"
    for kept in (
        "<!-- written by hand -->",
        "<!-- between -->",
        "<imports>old</imports>",
        '<nta version="2">',
        '<template tool="t">',
        '<label kind="testcodeEnter">enter();</label>',
        '<mark a="1"/>',
        '<option key="--extrapolation" value="4"/>',
        '<option key="--diagnostic" value="1"/>',
        '<resource type="time" value="1" unit="s"/>',
        'timestamp="2020"><details>none</details></result>',
        '<result outcome="success"/>',
        "a heading",
    ):
        assert text.count(kept) == 1


@pytest.mark.parametrize(
    "data",
    [
        "\ufeff<nta><declaration>// ä€</declaration></nta>".encode(),
        "<nta><declaration>// ä€</declaration></nta>".encode("utf-16"),
        "<nta><declaration>// ä€</declaration></nta>".encode("utf-16-be"),
        "<nta><declaration>// ä€</declaration></nta>".encode("utf-16-le"),
        b'<?xml version="1.0" encoding="ISO-8859-1"?><nta><declaration>// \xe4</declaration></nta>',
        b"<nta><declaration>// \xe4</declaration></nta>",
    ],
    ids=["mark", "utf-16", "big", "little", "latin", "not-utf-8"],
)
def test_files_are_decoded_as_the_engine_does(data: bytes, tmp_path: Path) -> None:
    path = tmp_path / "m.xml"
    path.write_bytes(data)
    assert build.read(path).declarations.removesuffix("€") == "// ä"


def test_a_system_section_in_the_last_template_is_found() -> None:
    text = (
        "<nta><template><name>P</name><location id='a'/><init ref='a'/>"
        "<instantiation>Q = P();</instantiation><system>system Q;</system></template></nta>"
    )
    model = build.parse(text)
    assert (model.instantiations, model.system) == ("Q = P();", "system Q;")
    assert checker.load(model.xml()).network_json() == checker.load(text).network_json()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("process P() {}", "the text: only models in UPPAAL's XML can be edited, and this is none"),
        ("<nta", "the text:1: the file is not well-formed XML: unclosed token"),
        (
            "<nta>\n<a>&b;</a></nta>",
            "the text:2: the file is not well-formed XML: undefined entity",
        ),
        (
            "<!DOCTYPE nta SYSTEM 'x'><nta><declaration>&b;</declaration></nta>",
            "the text:1: unknown entity &b;",
        ),
        ("<html/>", "the text:1: this XML file is not a UPPAAL model: its root is <html>"),
        ("<nta>\n<?a b?></nta>", "the text:1: <?a b?> cannot be kept"),
        ("<nta>hello</nta>", "the text:1: the text 'hello' directly in <nta> cannot be kept"),
        (
            "<nta>\n<declaration>int <b>x</b>;</declaration></nta>",
            "the text:2: <b> in the text of <declaration> cannot be kept",
        ),
        (
            "<nta><declaration>int <!-- no -->x;</declaration></nta>",
            "the text:1: <!--> in the text of <declaration> cannot be kept",
        ),
        (
            "<nta><system a='1'/></nta>",
            "the text:1: the attribute a of <system> cannot be kept",
        ),
        (
            "<nta><template><location/></template></nta>",
            "the text:1: this location has no id",
        ),
        (
            "<nta><template><location id='a' x='1'/></template></nta>",
            "the text:1: the place of <location> is not two numbers",
        ),
        (
            "<nta><template><location id='a' x='1' y='inf'/></template></nta>",
            "the text:1: the place of <location> is not two numbers",
        ),
        (
            "<nta><template><location id='a'/><init ref='b'/></template></nta>",
            "the text:1: no location or branch point has the id 'b'",
        ),
        (
            "<nta><template><branchpoint id='a'/><init ref='a'/></template></nta>",
            "the text:1: a process cannot start in a branch point",
        ),
        (
            "<nta><template><transition><target ref='a'/></transition></template></nta>",
            "the text:1: this edge has no <source>",
        ),
        (
            "<nta><template><location id='a'/><transition><source ref='a'/><target ref='a'/>"
            "<nail/></transition></template></nta>",
            "the text:1: this nail has no place",
        ),
        (
            "<nta><template><location id='a'><label kind='invariant'>x</label>"
            "<label kind='invariant'>y</label></location></template></nta>",
            "the text:1: a second invariant label",
        ),
    ],
)
def test_what_cannot_be_kept_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        build.parse(text)
    first, hint = str(error.value).split("\n")
    assert first == message
    assert hint.startswith("hint: ")


def test_a_file_that_is_not_xml_is_named() -> None:
    with pytest.raises(
        InputError, match=r"fischer\.xta: only models .*\nhint: `ntagen convert` makes XML"
    ):
        build.read(ROOT / "examples" / "models" / "fischer.xta")
    with pytest.raises(FileNotFoundError):
        build.read("nothing.xml")
