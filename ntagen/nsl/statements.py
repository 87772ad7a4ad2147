"""Reads a single statement from its words, by recursive descent: the grammar of the language.

The parser cuts a file into statements first (see parser.py), so that a mistake in one does not hide
a mistake in another. Statements nest like this::

    file:         (let | include | environment "{" body "}")*
    body:         (let | include | needle "{" … "}" | motion "{" … "}" | region | tissue
                   | resolution | safety | transform | query | for "{" (let | region | for)* "}"
                   | drive "{" parameter* "}" | device "{" axis* "}" | tracker)*

The docstring of a method has the rule that it reads: words in quotes are words of the language.
Terminals are those of tokens.py. Units are names here. A later phase checks whether `mmm` is a
unit, because it can give a better message than "unexpected name".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, Literal, cast

from ntagen.nsl import tree
from ntagen.nsl.expressions import END, ExpressionReader, UnexpectedTokenError
from ntagen.nsl.source import Source
from ntagen.nsl.tokens import Token
from ntagen.scene import RegionKind
from ntagen.values import dataclass

__all__ = ["PlainRegion", "UnexpectedTokenError", "read_statement"]

_Shape = tree.Sphere | tree.Solid | tree.Image | tree.Around


def read_statement(source: Source, words: Sequence[Token]) -> tree.Statement:
    """The tree of a statement, without the statements in its braces.

    Args:
        source: The text.
        words: The tokens of the statement; no parentheses are nested deeper than recursion can go.

    Raises:
        UnexpectedTokenError: A token cannot stand at its place.
    """
    return _StatementReader(source, words).statement()


@dataclass(frozen=True, slots=True)
class PlainRegion(Token):
    """The keyword of a plain region, in place of all its words.

    Attributes:
        start: Where the region begins.
        end: Where it ends.
        node: Its tree.
    """

    start: int
    end: int
    node: tree.Region


class _StatementReader(ExpressionReader):
    """Reads one statement."""

    def statement(self) -> tree.Statement:
        """A statement of any kind, up to the end of the words."""
        first = self._need(*_STATEMENTS)
        read = _STATEMENTS[first.type](self, first)
        self._need(END)
        return read

    # ---------------------------------------------------------------------------------- structure

    def environment(self, _word: Token) -> tree.Environment:
        """``"environment" NAME``."""
        name = self._name()
        return tree.Environment(self._span(0), name, ())

    def section(self, word: Token) -> tree.Section:
        """``"needle" | "motion" | "drive"``."""
        keyword = cast("Literal['needle', 'motion', 'drive']", word.text)
        return tree.Section(self._span(0), keyword, ())

    def loop(self, _word: Token) -> tree.Loop:
        """``"for" NAME "in" expression ".." expression``."""
        variable = self._name()
        self._need("IN")
        first = self._expression()
        self._need("RANGE")
        last = self._expression()
        return tree.Loop(self._span(0), variable, first, last, ())

    def let(self, _word: Token) -> tree.Let:
        """``"let" NAME "=" expression``."""
        name = self._name()
        self._need("EQUAL")
        value = self._expression()
        return tree.Let(self._span(0), name, value)

    def include(self, _word: Token) -> tree.Include:
        """``"include" STRING``."""
        path = self._text()
        return tree.Include(self._span(0), path)

    # -------------------------------------------------------------------------- needle and motion

    def setting(self, word: Token) -> tree.Setting:
        """``("tip" | "heading" | "bevel" | "radius" | "speed" | "length" | "step") expression``."""
        value = self._expression()
        return tree.Setting(self._span(0), _SETTINGS[word.type], value)

    def roll(self, _word: Token) -> tree.Roll:
        """``"roll" "by" values limit*``.

        A limit is ``"at" ("most" expression "times" | "least" expression "apart")``.
        """
        self._need("BY")
        angles = self._values()
        at_most: list[tree.Expression] = []
        at_least: list[tree.Expression] = []
        while self._take("AT"):
            is_most = self._need("MOST", "LEAST").type == "MOST"
            (at_most if is_most else at_least).append(self._expression())
            self._need("TIMES" if is_most else "APART")
        return tree.Roll(self._span(0), angles, tuple(at_most), tuple(at_least))

    def spin(self, _word: Token) -> tree.Spin:
        """``"spin" values``."""
        fractions = self._values()
        return tree.Spin(self._span(0), fractions)

    def wait(self, _word: Token) -> tree.Wait:
        """``"wait" expression ["at" "most" expression "times"]``."""
        length = self._expression()
        at_most: tree.Expression | None = None
        if self._take("AT"):
            self._need("MOST")
            at_most = self._expression()
            self._need("TIMES")
        return tree.Wait(self._span(0), length, at_most)

    def gate(self, _word: Token) -> tree.Gate:
        """``"push" "only" "while" "phase" "between" expression "and" expression``."""
        for terminal in ("ONLY", "WHILE", "PHASE", "BETWEEN"):
            self._need(terminal)
        first = self._expression()
        self._need("AND")
        last = self._expression()
        return tree.Gate(self._span(0), first, last)

    # ------------------------------------------------------------------------------------ regions

    def region(self, word: Token) -> tree.Region:
        """``REGION_KIND region_name shape [moves]``."""
        name = self._region_name()
        shape = self._shape()
        moves = self._moves()
        return tree.Region(self._span(0), cast(RegionKind, word.text), name, shape, moves)

    def _region_name(self) -> tree.RegionName:
        """``NAME ("[" expression "]")*``."""
        begin = self._index
        name = self._name()
        indices: list[tree.Expression] = []
        while self._take("LSQB", unless=_AFTER_NAMES):
            indices.append(self._expression())
            self._need("RSQB")
        return tree.RegionName(self._span(begin), name, tuple(indices))

    def _shape(self) -> _Shape:
        """The word of a shape, and its rule in `_SHAPES`."""
        begin = self._index
        word = self._need(*_SHAPES)
        return _SHAPES[word.type](self, word, begin)

    def sphere(self, _word: Token, begin: int) -> tree.Sphere:
        """``"sphere" expression "radius" expression``."""
        center = self._expression()
        self._need("RADIUS")
        radius = self._expression()
        return tree.Sphere(self._span(begin), center, radius)

    def around(self, _word: Token, begin: int) -> tree.Around:
        """``"around" region_name "margin" expression``."""
        region = self._region_name()
        self._need("MARGIN")
        margin = self._expression()
        return tree.Around(self._span(begin), region, margin)

    def turnable(self, word: Token, begin: int) -> tree.Solid:
        """``("box" expression "size" | "ellipsoid" expression "radii") expression [turned]``.

        The turn is ``"turned" expression "about" expression``.
        """
        form = cast("Literal['box', 'ellipsoid']", word.text)
        center = self._expression()
        self._need("SIZE" if form == "box" else "RADII")
        measures = (center, self._expression())
        if self._take("TURNED") is None:
            return tree.Solid(self._span(begin), form, measures)
        angle = self._expression()
        self._need("ABOUT")
        axis = self._expression()
        return tree.Solid(self._span(begin), form, measures, (angle, axis))

    def rod(self, word: Token, begin: int) -> tree.Solid:
        """``("capsule" | "cylinder") expression "to" expression "radius" expression``.

        A capsule may have another ``"to" expression``: the radius at its second end.
        """
        measures = [self._expression()]
        self._need("TO")
        measures.append(self._expression())
        self._need("RADIUS")
        measures.append(self._expression())
        if word.type == "CAPSULE" and self._take("TO"):
            measures.append(self._expression())
        form = cast("Literal['capsule', 'cylinder']", word.text)
        return tree.Solid(self._span(begin), form, tuple(measures))

    def halfspace(self, _word: Token, begin: int) -> tree.Solid:
        """``"halfspace" expression "towards" expression``."""
        place = self._expression()
        self._need("TOWARDS")
        side = self._expression()
        return tree.Solid(self._span(begin), "halfspace", (place, side))

    def image(self, word: Token, begin: int) -> tree.Image:
        """``("mesh" | "segmentation" | "markups") STRING clause*``."""
        path = self._text()
        clauses: list[tree.Clause] = []
        while (clause := self._clause()) is not None:
            clauses.append(clause)
        form = cast(tree.ImageForm, word.text)
        return tree.Image(self._span(begin), form, path, tuple(clauses))

    def _clause(self) -> tree.Clause | None:
        """A clause of a shape from a file, if one comes next.

        ``"in" NAME [NAME [NAME]] | ("segment" | "point") STRING
        | ("label" | "radius" | "grid") expression``
        """
        begin = self._index
        word = self._take("IN", "SEGMENT", "POINT", "LABEL", "RADIUS", "GRID")
        if word is None:
            return None
        if word.type == "IN":
            names = [self._name()]
            while len(names) < 3 and (more := self._take("NAME")):
                names.append(tree.Identifier(more.span, more.text))
            return tree.Clause(self._span(begin), "in", tuple(names))
        if word.type in ("SEGMENT", "POINT"):
            of_text = cast("Literal['segment', 'point']", word.text)
            text = self._text()
            return tree.Clause(self._span(begin), of_text, (text,))
        of_value = cast("Literal['label', 'radius', 'grid']", word.text)
        value = self._expression()
        return tree.Clause(self._span(begin), of_value, (), value)

    def _moves(self) -> tree.Moves | None:
        """How a region moves, if it does.

        ``"moves" (along | through | "as" STRING "every" expression)``
        """
        begin = self._index
        if self._take("MOVES") is None:
            return None
        if self._take("AS"):
            path = self._text()
            self._need("EVERY")
            period = self._expression()
            return tree.Moves(self._span(begin), period, path=path)
        return self._through(begin) if self._take("THROUGH") else self._along(begin)

    def _through(self, begin: int) -> tree.Moves:
        """``"through" place ("," place)* "every" expression``.

        A place is ``expression "after" expression``.
        """
        places = [self._place()]
        while self._take("COMMA"):
            places.append(self._place())
        self._need("EVERY")
        period = self._expression()
        return tree.Moves(self._span(begin), period, places=tuple(places))

    def _place(self) -> tuple[tree.Expression, tree.Expression]:
        """``expression "after" expression``."""
        place = self._expression()
        self._need("AFTER")
        return place, self._expression()

    def _along(self, begin: int) -> tree.Moves:
        """``expression "along" expression "every" expression ["phase" expression]``."""
        way = self._expression()
        self._need("ALONG")
        towards = self._expression()
        self._need("EVERY")
        period = self._expression()
        phase = self._expression() if self._take("PHASE") else None
        return tree.Moves(self._span(begin), period, (way, towards), phase)

    # --------------------------------------------------------------------------- the rest of a task

    def tissue(self, _word: Token) -> tree.Tissue:
        """``"tissue" NAME (TISSUE_PART expression)*``."""
        name = self._name()
        bounds: list[tree.TissueBound] = []
        while part := self._take("TISSUE_PART"):
            word = tree.Identifier(part.span, part.text)
            bounds.append(tree.TissueBound(word, self._expression()))
        return tree.Tissue(self._span(0), name, tuple(bounds))

    def resolution(self, _word: Token) -> tree.Resolution:
        """``"resolution" expression "per" NAME``."""
        count = self._expression()
        self._need("PER")
        unit = self._name()
        return tree.Resolution(self._span(0), count, unit)

    def safety(self, _word: Token) -> tree.Choice:
        """``"safety" NAME``."""
        word = self._name()
        return tree.Choice(self._span(0), "safety", word)

    def transform(self, _word: Token) -> tree.Transform:
        """``"transform" NAME NAME (STRING | values)``."""
        direction, space = self._name(), self._name()
        if file := self._take("STRING"):
            path = tree.Identifier(file.span, file.text[1:-1])
            return tree.Transform(self._span(0), direction, space, path, ())
        rows = self._values()
        return tree.Transform(self._span(0), direction, space, None, rows)

    def parameter(self, word: Token) -> tree.Parameter:
        """``PARAMETER values``."""
        values = self._values()
        return tree.Parameter(self._span(0), word.text, values)

    def device(self, _word: Token) -> tree.Device:
        """``"device" NAME STRING``."""
        kind, port = self._name(), self._text()
        return tree.Device(self._span(0), kind, port, ())

    def axis(self, word: Token) -> tree.Axis:
        """``AXIS NAME expression``."""
        letter, steps = self._name(), self._expression()
        keyword = cast("Literal['insert', 'roll']", word.text)
        return tree.Axis(self._span(0), keyword, letter, steps)

    def tracker(self, _word: Token) -> tree.Tracker:
        """``"tracker" NAME STRING [STRING]``."""
        kind, address = self._name(), self._text()
        text = self._take("STRING")
        name = None if text is None else tree.Identifier(text.span, text.text[1:-1])
        return tree.Tracker(self._span(0), kind, address, name)


_SETTINGS: Final[
    dict[str, Literal["tip", "heading", "bevel", "radius", "speed", "length", "step"]]
] = {
    "TIP": "tip",
    "HEADING": "heading",
    "BEVEL": "bevel",
    "RADIUS": "radius",
    "SPEED": "speed",
    "LENGTH": "length",
    "STEP": "step",
}

_STATEMENTS: Final[dict[str, Callable[[_StatementReader, Token], tree.Statement]]] = {
    "ENVIRONMENT": _StatementReader.environment,
    "NEEDLE": _StatementReader.section,
    "MOTION": _StatementReader.section,
    "DRIVE": _StatementReader.section,
    "FOR": _StatementReader.loop,
    "LET": _StatementReader.let,
    "INCLUDE": _StatementReader.include,
    "PARAMETER": _StatementReader.parameter,
    "DEVICE": _StatementReader.device,
    "AXIS": _StatementReader.axis,
    "TRACKER": _StatementReader.tracker,
    "REGION_KIND": _StatementReader.region,
    **dict.fromkeys(_SETTINGS, _StatementReader.setting),
    "ROLL": _StatementReader.roll,
    "SPIN": _StatementReader.spin,
    "WAIT": _StatementReader.wait,
    "PUSH": _StatementReader.gate,
    "TISSUE": _StatementReader.tissue,
    "RESOLUTION": _StatementReader.resolution,
    "SAFETY": _StatementReader.safety,
    "TRANSFORM": _StatementReader.transform,
}
"""What reads a statement, by the terminal of its first word."""

_SHAPES: Final[dict[str, Callable[[_StatementReader, Token, int], _Shape]]] = {
    "SPHERE": _StatementReader.sphere,
    "AROUND": _StatementReader.around,
    "BOX": _StatementReader.turnable,
    "ELLIPSOID": _StatementReader.turnable,
    "CAPSULE": _StatementReader.rod,
    "CYLINDER": _StatementReader.rod,
    "HALFSPACE": _StatementReader.halfspace,
    "MESH": _StatementReader.image,
    "SEGMENTATION": _StatementReader.image,
    "MARKUPS": _StatementReader.image,
}
"""What reads a shape, by the terminal of its first word."""

_AFTER_NAMES: Final = frozenset({"MARGIN", *_SHAPES})
"""The terminals that may follow the name of a region somewhere."""
