"""Reads expressions from the words of a statement, by recursive descent.

::

    values:      expression ("," expression)*
    expression:  product (("+" | "-") product)*
    product:     signed (("*" | "/") signed)*
    signed:      ("+" | "-")* quantity
    quantity:    primary [unit]
    unit:        NAME | NAME "/" NAME | "%"
    primary:     NUMBER | NAME | NAME "(" [values] ")" | "(" values ")"

One token ahead decides everywhere. All terminals that were tried at a place are what could stand
there, so that a message can name them. A message does not name how a value could go on if the token
that was found ends values elsewhere: there the value is whole, and something else is missing.

Chains are flat: the depth of a tree is bounded by the depth of its parentheses.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, Literal, cast

from ntagen.nsl import tree
from ntagen.nsl.source import Source, Span
from ntagen.nsl.tokens import Token

END: Final = "$END"
"""The terminal of the end of a statement."""

_AFTER_VALUES: Final = frozenset(
    {END, "COMMA", "RPAR", "RSQB", "RANGE", "PER", "TISSUE_PART", "AT", "TIMES", "APART", "AND"}
    | {"RADIUS", "SIZE", "RADII", "TURNED", "ABOUT", "TO", "TOWARDS"}
    | {"IN", "SEGMENT", "POINT", "LABEL", "GRID"}
    | {"MOVES", "ALONG", "EVERY", "PHASE", "AFTER"}
)
"""The terminals that may follow a value somewhere."""


class UnexpectedTokenError(Exception):
    """A token that cannot stand at its place.

    Attributes:
        token: The token; None is the end of the statement.
        expected: The terminals that could stand there, sorted.
    """

    def __init__(self, token: Token | None, expected: Sequence[str]) -> None:
        super().__init__(token, expected)
        self.token = token
        self.expected = expected


class ExpressionReader:
    """Goes through the words of one statement."""

    def __init__(self, source: Source, words: Sequence[Token]) -> None:
        last = words[-1]
        self._source = source
        self._words = [*words, Token(END, "", last.span.behind(), last.line)]
        self._index = 0
        self._tried: list[tuple[tuple[str, ...], frozenset[str]]] = []

    # --------------------------------------------------------------------------------------- tokens

    def _take(self, *terminals: str, unless: frozenset[str] = frozenset()) -> Token | None:
        """The next token, which is taken if it is of one of these terminals; else None.

        Args:
            terminals: What may stand here.
            unless: If one of these is found here, a message does not say that the others may stand
                here.
        """
        token = self._words[self._index]
        if token.type in terminals:
            self._index += 1
            self._tried.clear()
            return token
        self._tried.append((terminals, unless))
        return None

    def _need(self, *terminals: str) -> Token:
        """The next token, which is taken.

        Raises:
            UnexpectedTokenError: It is of none of these terminals.
        """
        token = self._take(*terminals)
        if token is None:
            found = self._words[self._index]
            tried = (names for names, unless in self._tried if found.type not in unless)
            expected = sorted({one for names in tried for one in names})
            raise UnexpectedTokenError(None if found.type == END else found, expected)
        return token

    def _span(self, first: int) -> Span:
        """The place of the words from an index up to the last one that was taken."""
        return self._words[first].span.to(self._words[self._index - 1].span)

    def _name(self) -> tree.Identifier:
        """A name."""
        return _identifier(self._need("NAME"))

    def _text(self) -> tree.Identifier:
        """A text in quotes, without them."""
        token = self._need("STRING")
        return tree.Identifier(token.span, token.text[1:-1])

    # ---------------------------------------------------------------------------------- expressions

    def _values(self) -> tuple[tree.Expression, ...]:
        """One or more expressions with commas between them."""
        values = [self._expression()]
        while self._take("COMMA"):
            values.append(self._expression())
        return tuple(values)

    def _expression(self) -> tree.Expression:
        """Products, added and subtracted."""
        begin = self._index
        first = self._product()
        rest: list[tuple[Literal["+", "-", "*", "/"], tree.Expression]] = []
        while sign := self._take("SIGN", unless=_AFTER_VALUES):
            rest.append((cast("Literal['+', '-']", sign.text), self._product()))
        return tree.Chain(self._span(begin), first, tuple(rest)) if rest else first

    def _product(self) -> tree.Expression:
        """Values with signs, multiplied and divided."""
        begin = self._index
        first = self._signed()
        rest: list[tuple[Literal["+", "-", "*", "/"], tree.Expression]] = []
        while scale := self._take("SCALE", unless=_AFTER_VALUES):
            rest.append((cast("Literal['*', '/']", scale.text), self._signed()))
        return tree.Chain(self._span(begin), first, tuple(rest)) if rest else first

    def _signed(self) -> tree.Expression:
        """A value with any number of signs before it."""
        begin = self._index
        is_negative = False
        while sign := self._take("SIGN"):
            is_negative ^= sign.text == "-"
        has_sign = self._index > begin
        operand = self._quantity()
        return tree.Signed(self._span(begin), operand, is_negative) if has_sign else operand

    def _quantity(self) -> tree.Expression:
        """A value with or without a unit."""
        begin = self._index
        operand = self._primary()
        unit = self._take("NAME", "RATIO", "PERCENT", unless=_AFTER_VALUES)
        if unit is None:
            return operand
        return tree.Measured(self._span(begin), operand, _identifier(unit))

    def _primary(self) -> tree.Expression:
        """A number, a name, a call, a vector, or an expression in parentheses."""
        begin = self._index
        token = self._need("NUMBER", "NAME", "LPAR")
        if token.type == "NUMBER":
            return tree.Number(token.span, float(token.text))
        if token.type == "NAME":
            if self._take("LPAR", unless=_AFTER_VALUES) is None:
                return tree.Name(token.span, token.text)
            arguments: tuple[tree.Expression, ...] = ()
            if self._take("RPAR") is None:
                arguments = self._values()
                self._need("RPAR")
            return tree.Call(self._span(begin), _identifier(token), arguments)
        parts = self._values()
        self._need("RPAR")
        return parts[0] if len(parts) == 1 else tree.Vector(self._span(begin), parts)


def _identifier(token: Token) -> tree.Identifier:
    """A token as a name with its place."""
    return tree.Identifier(token.span, token.text)
