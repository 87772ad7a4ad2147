"""Translates the templates to Python: ``make templates``, after each change of them.

Jinja parses the templates when this runs, and never when a model is rendered: importing it would
take longer than all of rendering. `ntagen.render.generated` is the result: one function for each of
the two documents, which writes a list of texts. A test compares it with what this module makes, and
its texts with those of Jinja.

Only the parts of Jinja that the templates use are known; any other is an error here. All names must
be known when this runs, and unknown attributes are errors when a model is rendered.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final, cast

from jinja2 import Environment, nodes

from ntagen.files import write_files

TEMPLATES: Final = Path(__file__).parents[1] / "templates"
RESULT: Final = Path(__file__).with_name("generated.py")

DOCUMENTS: Final = {
    "declaration": ("uppaal/declarations.c.jinja", ("model", "source"), "shown"),
    "document": ("model.xml.jinja", ("model", "declaration", "queries"), "escaped"),
    "plan_document": ("plan.xml.jinja", ("model", "declaration", "queries"), "escaped"),
}
"""The functions of the result: the template of each, its parameters, and what values go through."""

_HEAD: Final = '''"""The templates as Python. `make templates` wrote this; do not change it."""

# ruff: noqa
# mypy: ignore-errors

from typing import Any

from ntagen.render.writing import Safe, escaped, shown, with_last
'''
_OPERATORS: Final = {
    "eq": "==",
    "ne": "!=",
    "lt": "<",
    "lteq": "<=",
    "gt": ">",
    "gteq": ">=",
    "in": "in",
    "notin": "not in",
}
_BINARY: Final = {nodes.Add: "+", nodes.Sub: "-", nodes.And: "and", nodes.Or: "or"}


def translated() -> str:
    """The text of `ntagen.render.generated`."""
    environment = Environment(keep_trailing_newline=True)
    lines = [_HEAD]
    for name, (template, parameters, escape) in DOCUMENTS.items():
        writer = _Writer(environment, escape)
        writer.known |= set(parameters)
        typed = ", ".join(f"{parameter}: Any" for parameter in parameters)
        body = list(writer.template(template, 1))
        lines += ["", f"def {name}({typed}) -> str:", "    out = []", "    put = out.append"]
        lines += [*body, '    return "".join(out)', ""]
    return "\n".join(lines)


class _Writer:
    """Writes the lines of one function.

    Attributes:
        known: The names that have a value so far.
    """

    def __init__(self, environment: Environment, shown: str) -> None:
        self.known: set[str] = set()
        self._environment = environment
        self._shown = shown
        self._loops = 0

    def template(self, name: str, depth: int) -> Iterator[str]:
        """The lines of a template, in place of the line that includes it."""
        yield from self._body(self._parsed(name), depth)

    def _parsed(self, name: str) -> list[nodes.Node]:
        """The statements of a template."""
        text = (TEMPLATES / name).read_text("utf-8")
        return self._environment.parse(text, name).body

    def _body(self, body: list[nodes.Node], depth: int) -> Iterator[str]:
        """The lines of some statements."""
        indent = "    " * depth
        for node in body:
            match node:
                case nodes.Output():
                    for part in node.nodes:
                        yield from self._output(part, indent)
                case nodes.If():
                    yield from self._condition(node, depth)
                case nodes.For():
                    yield from self._loop(node, depth)
                case nodes.Assign(target=nodes.Name(name=name)):
                    yield f"{indent}{name} = {self._value(node.node)}"
                    self.known.add(name)
                case nodes.Include(template=nodes.Const(value=str(name))):
                    yield from self.template(name, depth)
                case nodes.FromImport(template=nodes.Const(value=str(name))):
                    # The macros of a file are made once.
                    if not set(map(str, node.names)) <= self.known:
                        macros = [one for one in self._parsed(name) if isinstance(one, nodes.Macro)]
                        yield from self._body([*macros], depth)
                case nodes.Macro():
                    yield from self._macro(node, depth)
                case _:
                    raise _unknown(node)

    def _output(self, node: nodes.Node, indent: str) -> Iterator[str]:
        """The line that writes a text or a value."""
        if isinstance(node, nodes.TemplateData):
            first, *rest = node.data.splitlines(keepends=True) or [""]
            yield f"{indent}put({first!r}" + ("" if rest else ")")
            for number, line in enumerate(rest, start=1):
                yield f"{indent}    {line!r}" + (")" if number == len(rest) else "")
        else:
            yield f"{indent}put({self._shown}({self._value(node)}))"

    def _condition(self, node: nodes.If, depth: int) -> Iterator[str]:
        indent = "    " * depth
        word = "if"
        for branch in (node, *node.elif_):
            yield f"{indent}{word} {self._value(branch.test)}:"
            yield from self._body(branch.body, depth + 1) if branch.body else (f"{indent}    pass",)
            word = "elif"
        if node.else_:
            yield f"{indent}else:"
            yield from self._body(node.else_, depth + 1)

    def _loop(self, node: nodes.For, depth: int) -> Iterator[str]:
        """A loop; `loop.last` has a name of its own in each."""
        if node.else_ or node.recursive:
            raise _unknown(node)
        indent = "    " * depth
        target, rows = self._target(node.target), self._value(node.iter)
        if node.test is not None:
            rows = f"[{target} for {target} in {rows} if {self._value(node.test)}]"
        self._loops += 1
        self.known.add(f"is_last_{self._loops}")
        yield f"{indent}for is_last_{self._loops}, {target} in with_last({rows}):"
        yield from self._body(node.body, depth + 1)
        self._loops -= 1

    def _macro(self, node: nodes.Macro, depth: int) -> Iterator[str]:
        """A macro is a function that returns a text."""
        indent = "    " * depth
        names = [argument.name for argument in node.args]
        defaults = [f"={self._value(one)}" for one in node.defaults]
        first = len(names) - len(defaults)
        parameters = names[:first] + [a + b for a, b in zip(names[first:], defaults, strict=True)]
        self.known |= {node.name, *names}
        yield f"{indent}def {node.name}({', '.join(parameters)}):"
        yield f"{indent}    out = []"
        yield f"{indent}    put = out.append"
        yield from self._body(node.body, depth + 1)
        yield f'{indent}    return Safe("".join(out))'

    def _target(self, node: nodes.Node) -> str:
        """The names that a loop gives values to."""
        if isinstance(node, nodes.Tuple):
            return "(" + ", ".join(map(self._target, node.items)) + ")"
        if not isinstance(node, nodes.Name):
            raise _unknown(node)
        self.known.add(node.name)
        return node.name

    def _value(self, node: nodes.Node) -> str:
        """An expression."""
        match node:
            case nodes.Const():
                return repr(node.value)
            case nodes.Name():
                if node.name not in self.known:
                    raise ValueError(f"line {node.lineno}: the name `{node.name}` has no value")
                return node.name
            case nodes.Getattr(node=nodes.Name(name="loop"), attr="last"):
                return f"is_last_{self._loops}"
            case nodes.Getattr():
                return f"{self._value(node.node)}.{node.attr}"
            case nodes.Getitem():
                return f"{self._value(node.node)}[{self._value(node.arg)}]"
            case nodes.List() | nodes.Tuple():
                items = "".join(f"{self._value(item)}, " for item in node.items)
                return f"[{items}]" if isinstance(node, nodes.List) else f"({items})"
            case nodes.CondExpr():
                other = "''" if node.expr2 is None else self._value(node.expr2)
                return f"({self._value(node.expr1)} if {self._value(node.test)} else {other})"
            case nodes.Call(dyn_args=None, dyn_kwargs=None):
                given = [self._value(one) for one in node.args]
                given += [f"{one.key}={self._value(one.value)}" for one in node.kwargs]
                return f"{self._value(node.node)}({', '.join(given)})"
        return self._operation(node)

    def _operation(self, node: nodes.Node) -> str:
        """An operator or a filter and its operands."""
        match node:
            case nodes.Not():
                return f"(not {self._value(node.node)})"
            case nodes.Neg():
                return f"(-{self._value(node.node)})"
            case nodes.Concat():
                return f"''.join(map(shown, ({', '.join(map(self._value, node.nodes))},)))"
            case nodes.Compare(ops=[nodes.Operand(op=operator, expr=right)]):
                return f"({self._value(node.expr)} {_OPERATORS[operator]} {self._value(right)})"
            case nodes.Test(name="none"):
                return f"({self._value(node.node)} is None)"
            case nodes.BinExpr() if type(node) in _BINARY:
                operator = _BINARY[type(node)]
                return f"({self._value(node.left)} {operator} {self._value(node.right)})"
            case nodes.Filter(node=nodes.Node() as left):
                return self._filter(node, self._value(left))
        raise _unknown(node)

    def _filter(self, node: nodes.Filter, value: str) -> str:
        """A filter on a value."""
        given = [self._value(one) for one in node.args]
        # The types of Jinja say pairs, which they are not.
        named = cast("list[nodes.Keyword]", cast(object, node.kwargs))
        match node.name, given, named:
            case "join", [between], []:
                return f"{between}.join(map(shown, {value}))"
            case "map", [], [attribute] if attribute.key == "attribute":
                return f"[one.{attribute.value.as_const()} for one in {value}]"
            case "list", [], []:
                return f"list({value})"
            case "length", [], []:
                return f"len({value})"
            case "lower", [], []:
                return f"shown({value}).lower()"
            case "format", [_, *_], []:
                return f"({value} % ({', '.join(given)},))"
        raise _unknown(node)


def _unknown(node: nodes.Node) -> Exception:
    return ValueError(f"line {node.lineno}: {type(node).__name__} has no translation yet: {node}")


if __name__ == "__main__":
    write_files({RESULT: translated()})
