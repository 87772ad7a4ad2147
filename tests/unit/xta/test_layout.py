"""The layout of textual models."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from ntagen.checker.survey import Texts, survey
from ntagen.cli.needle.fmt import command
from ntagen.errors import InputError
from ntagen.xta import format_model, tokenise

CORPUS = Path(__file__).parents[2] / "corpus"
MODELS = sorted(path for kind in ("*.xta", "*.ta") for path in CORPUS.rglob(kind))

WRITTEN = """\
const int N=3; typedef struct {int a;bool b ;} pair;


pair both[2]= {{1,true},
{ 2,false }};
int f(int &x,const pair &p){
if(x< -1&&!p.b)
return- x;
  else {
x++; // counted
}
for( i:int[0,N-1] ) x+=i ;
return x>0 ?x:both[0].a; }
/* the one
     process */
process P (){
clock x ;
state A {x<=3&&
x'==1}, B{;2};
init A;
trans
A->B{guard x>=1&&
x<3;sync c[0] ! ;assign x=0;},
 B -u-> A { sync d?; };
}
system P;
"""

LAID_OUT = """\
const int N = 3; typedef struct { int a; bool b; } pair;

pair both[2] = {{1, true},
  { 2, false }};
int f(int &x, const pair &p) {
  if (x < -1 && !p.b)
    return -x;
  else {
    x++; // counted
  }
  for (i : int[0, N - 1]) x += i;
  return x > 0 ? x : both[0].a; }
/* the one
     process */
process P() {
  clock x;
  state A { x <= 3 &&
          x' == 1 }, B { ; 2 };
  init A;
  trans
    A -> B { guard x >= 1 &&
      x < 3; sync c[0]!; assign x = 0; },
    B -u-> A { sync d?; };
}
system P;
"""


def test_a_model_is_laid_out() -> None:
    assert format_model(WRITTEN) == LAID_OUT
    assert format_model(LAID_OUT) == LAID_OUT


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        ("int x = a & b, y = a&b;", "int x = a & b, y = a&b;\n"),
        ("int x = - -1 - - 2;", "int x = - -1 - -2;\n"),
        ("int x = a --b;", "int x = a-- b;\n"),
        ("x = b ? 1 : 2;", "x = b ? 1 : 2;\n"),
        ("bool b = forall(i:T)a[i] imply(x>1);", "bool b = forall(i : T) a[i] imply (x > 1);\n"),
        ("int x;   // one\nint yy;  // two\n", "int x;   // one\nint yy;  // two\n"),
        ("\n\n\nint x;\n\n\n\nint y;\n\n", "int x;\n\nint y;\n"),
        ("void f()\n{\nx=1;\n}\n", "void f()\n{\n  x = 1;\n}\n"),
        ("int x;\r\n  int y;\r\n", "int x;\r\nint y;\r\n"),
        ("", ""),
    ],
)
def test_blanks_and_lines(written: str, expected: str) -> None:
    assert format_model(written) == expected
    assert format_model(expected) == expected


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_layout_keeps_what_a_model_says(path: Path) -> None:
    text = path.read_text("utf-8")
    done = format_model(text)
    assert words(done) == words(text)
    assert format_model(done) == done
    before, after = (survey(Texts("a.xta", one)) for one in (text, done))
    assert [one.name for one in before.symbols] == [one.name for one in after.symbols]
    assert [one.code for one in before.mistakes] == [one.code for one in after.mistakes]


PIECES = st.sampled_from(
    [
        *re.findall(
            r"\S+",
            """
            x A E 1 2.5 int state trans if else guard system "s" // /*c*/ /* -u-> A[] E<> --> <= ++
            -- - ! ? & ' . , ; : { } ( ) [ ] = := == < > ü \\
            """,
        ),
        "// c\n",
        "/* a\n  b */",
    ]
)


@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(PIECES, st.sampled_from(["", " ", "\n", "\t", "\n\n\n"])), max_size=30))
def test_layout_keeps_the_tokens_of_any_text(parts: list[tuple[str, str]]) -> None:
    text = "".join(piece + blank for piece, blank in parts)
    done = format_model(text)
    assert words(done) == words(text)
    assert format_model(done) == done


def words(text: str) -> list[str]:
    return [token.text for token in tokenise(text)]


def test_the_command_formats_models_in_place(tmp_path: Path) -> None:
    path = tmp_path / "a.xta"
    path.write_text(WRITTEN.replace("&&\nx<3", "&& x<3"), "utf-8")
    assert CliRunner().invoke(command, ["--check", str(path)]).exit_code == 1
    assert CliRunner().invoke(command, [str(path)]).exit_code == 0
    assert path.read_text("utf-8") == LAID_OUT.replace("&&\n      x < 3", "&& x < 3")
    assert CliRunner().invoke(command, ["--check", str(path)]).exit_code == 0


def test_a_model_with_mistakes_of_form_is_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "a.xta"
    path.write_text("int  x = ;\n", "utf-8")
    failed = CliRunner().invoke(command, [str(path)])
    assert isinstance(failed.exception, InputError)
    assert f"{path}:1:10: error[E0105]" in str(failed.exception)
    assert path.read_text("utf-8") == "int  x = ;\n"


@pytest.mark.parametrize("name", ["a.xml", "a.q"])
def test_what_has_no_layout_is_refused(name: str) -> None:
    failed = CliRunner().invoke(command, [name])
    assert "has no standard layout\nhint: " in str(failed.exception)
