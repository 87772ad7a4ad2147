"""Models with their templates and queries."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.build.parts import shown
from ntagen.build.template import Template
from ntagen.errors import InputError

if TYPE_CHECKING:
    from ntagen.checker import Model as LoadedModel

_OUTCOMES: Final = {
    "satisfied": "success",
    "not satisfied": "failure",
    "maybe satisfied": "maybe_true",
    "maybe not satisfied": "maybe_false",
    "error": "error",
}


@dataclass(slots=True)
class Outcome:
    """What a query gave, or should give; `outcome_of` makes one from a verdict.

    Attributes:
        outcome: ``success``, ``failure``, ``maybe_true``, ``maybe_false`` or ``error``.
        type: For example ``symbolic``, or ``quantity`` for the number of ``sup`` or ``inf``.
        value: The number.
        attributes: Further attributes of the element.
        extra: Elements in it, as XML.
    """

    outcome: str
    type: str = ""
    value: str = ""
    attributes: dict[str, str] = field(default_factory=dict)
    extra: list[str] = field(default_factory=list)


def outcome_of(expected: bool | float | str) -> Outcome:
    """The outcome that means a verdict.

    Args:
        expected: ``True``, ``False``, the number of ``sup`` or ``inf``, or a verdict as in
            `ntagen.checker.Query.expect`: ``satisfied``, ``not satisfied``, ``maybe satisfied``,
            ``maybe not satisfied`` or ``error``.

    Raises:
        InputError: It is none of these.
    """
    if isinstance(expected, bool):
        return Outcome("success" if expected else "failure", "symbolic")
    if isinstance(expected, int | float):
        return Outcome("success", "quantity", f"{expected!r}")
    if expected not in _OUTCOMES:
        known = ", ".join(_OUTCOMES)
        raise InputError(
            f"a query cannot expect {expected!r}\nhint: write True, False, a number, or one of: "
            f"{known}"
        )
    return Outcome(_OUTCOMES[expected], "symbolic")


@dataclass(slots=True, repr=False)
class Query:
    """A query of a model; `Model.query` makes one.

    Attributes:
        formula: For example ``E<> T.Done``. UPPAAL keeps headings as queries without a formula.
        comment: Its comment.
        expect: What it should give.
        result: What it gave when it was last checked.
        attributes: Further attributes of the element.
        extra: Further elements in it, such as options, as XML.
    """

    formula: str
    comment: str = ""
    expect: Outcome | None = None
    result: Outcome | None = None
    attributes: dict[str, str] = field(default_factory=dict)
    extra: list[str] = field(default_factory=list)

    def __repr__(self) -> str:
        return shown(self, repr(self.formula), ("comment", "expect", "result"))


@dataclass(slots=True, repr=False)
class Model:
    """A model; `read` makes one from a file.

    ``model["Train"]`` is its template ``Train``. The lists may be changed freely.

    Attributes:
        declarations: Global declarations.
        templates: In the order of the file.
        system: The system declarations, with the system line: ``T = Train(0); system T;``.
        queries: In the order of the file.
        instantiations: Declarations before those of the system, in files of old versions.
        attributes: Further attributes of the root element.
        extra: Further elements in it, as XML.
        query_extra: Elements beside the queries, as XML.
    """

    declarations: str = ""
    templates: list[Template] = field(default_factory=list)
    system: str = ""
    queries: list[Query] = field(default_factory=list)
    instantiations: str = ""
    attributes: dict[str, str] = field(default_factory=dict)
    extra: list[str] = field(default_factory=list)
    query_extra: list[str] = field(default_factory=list)

    def __getitem__(self, name: str) -> Template:
        for template in self.templates:
            if template.name == name:
                return template
        known = ", ".join(template.name for template in self.templates) or "none"
        raise KeyError(f"there is no template {name}; the model has {known}")

    def __repr__(self) -> str:
        names = ", ".join(template.name for template in self.templates)
        return f"Model(templates: {names or 'none'}; {len(self.queries)} queries)"

    def template(self, name: str, *, parameters: str = "", declarations: str = "") -> Template:
        """Adds a template.

        Raises:
            InputError: There is a template with this name.
        """
        if any(one.name == name for one in self.templates):
            raise InputError(
                f"the model has a template {name} already\n"
                f'hint: choose another name; model["{name}"] is the one that is there'
            )
        template = Template(name, parameters, declarations)
        self.templates.append(template)
        return template

    def query(
        self, formula: str, comment: str = "", *, expect: bool | float | str | None = None
    ) -> Query:
        """Adds a query; `expect` is what it should give, see `outcome_of`.

        Raises:
            InputError: No query can give what is expected.
        """
        query = Query(formula, comment, None if expect is None else outcome_of(expect))
        self.queries.append(query)
        return query

    def xml(self) -> str:
        """The model as a file of UPPAAL. Parts without a place are laid out.

        Raises:
            InputError: The structure is wrong; the message names all mistakes.
        """
        from ntagen.build.writing import written

        return written(self)

    def write(self, path: str | Path) -> None:
        """Writes the model as a file of UPPAAL.

        Raises:
            InputError: The structure is wrong, or the file cannot be written.
        """
        from ntagen.files import write_files

        path = Path(path)
        if path.suffix.lower() != ".xml":
            raise InputError(
                f"cannot write {path}: a model is written as UPPAAL's XML\n"
                f"hint: call the file {path.stem}.xml"
            )
        write_files({path: self.xml()})

    def load(self) -> LoadedModel:
        """The model in the engine, which answers its queries.

        Raises:
            InputError: The structure is wrong. If the engine does not accept a text, it is a
                `ntagen.checker.RejectedError`, which has the diagnostics.
        """
        from ntagen import checker

        return checker.load(self.xml(), "built.xml")
