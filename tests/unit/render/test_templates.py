"""The translated templates: they are current, and write what Jinja writes."""

from __future__ import annotations

import html
from pathlib import Path

import jinja2
import pytest
from markupsafe import Markup

from ntagen import nsl
from ntagen.render import generated, queries, render, translate
from ntagen.render.values import model_values
from ntagen.render.writing import Safe, escaped, with_last
from ntagen.scene import Scene

ROOT = Path(__file__).parents[3]
TASKS = [*ROOT.glob("examples/**/*.nsl"), *ROOT.glob("tests/corpus/nsl/ok/*.nsl")]


def environment() -> jinja2.Environment:
    """Jinja as the templates are meant: unknown names are errors, XML is escaped."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(translate.TEMPLATES),
        undefined=jinja2.StrictUndefined,
        autoescape=lambda name: name is not None and name.endswith(".xml.jinja"),
        keep_trailing_newline=True,
    )


TEMPLATES = environment()


def by_jinja(scene: Scene, source: str | None, *, only_plans: bool) -> str:
    """The model as Jinja renders it from the templates themselves."""
    values = model_values(scene, only_plans=only_plans)
    declaration = TEMPLATES.get_template("uppaal/declarations.c.jinja").render(
        model=values, source=source
    )
    return TEMPLATES.get_template("model.xml.jinja").render(
        model=values,
        declaration=Markup(html.escape(declaration, quote=False)),
        queries=queries.model_queries(scene),
    )


def test_the_translation_is_current() -> None:
    assert Path(generated.__file__).read_text("utf-8") == translate.translated(), "make templates"


@pytest.mark.parametrize("path", sorted(TASKS), ids=lambda path: path.stem)
def test_models_are_those_of_jinja(path: Path) -> None:
    try:
        scene = nsl.load(path)
    except nsl.SourceError:
        pytest.skip("a file to be included, or one with files that a script makes")
    for only_plans in (False, True):
        source = f"{path.name} <'&\">"
        expected = by_jinja(scene, source, only_plans=only_plans)
        assert render(scene, source, only_plans=only_plans) == expected


@pytest.mark.parametrize("value", ["a < b && c", "'\"", 3, "plain", "&amp;", Safe("<b>")])
def test_values_are_escaped_as_jinja_does(value: object) -> None:
    given = Markup(value) if isinstance(value, Safe) else value
    assert escaped(value) == TEMPLATES.from_string("{{ x|e }}").render(x=given)


def test_the_last_row_is_known() -> None:
    assert list(with_last("ab")) == [(False, "a"), (True, "b")]
    assert list(with_last([])) == []


@pytest.mark.parametrize(
    "text",
    [
        "{{ nothing }}",
        "{{ model | upper }}",
        "{% raw %}x{% endraw %}{% call f() %}{% endcall %}",
        "{% for x in model recursive %}{% endfor %}",
    ],
)
def test_what_has_no_translation_is_an_error(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "one.jinja").write_text(text)
    monkeypatch.setattr(translate, "TEMPLATES", tmp_path)
    monkeypatch.setattr(translate, "DOCUMENTS", {"one": ("one.jinja", ("model",), "shown")})
    with pytest.raises(ValueError, match="line 1"):
        translate.translated()
