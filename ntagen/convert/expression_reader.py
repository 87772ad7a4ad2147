"""Reads expressions and updates of UPPAAL's language, and of TChecker's.

The engine has accepted a model before its texts come here, so what is read is right. Only what
other formats can hold is read; the rest raises `UnknownExpression`, which says what it is.
"""

from __future__ import annotations

import re
from typing import Final

from ntagen.convert.expressions import (
    LEVELS,
    PREFIX,
    Assign,
    Binary,
    Call,
    Choice,
    Expr,
    Field,
    Index,
    Name,
    Number,
    Quantified,
    Unary,
    shown,
)


class UnknownExpression(ValueError):  # noqa: N818  it says what an expression is
    """An expression that no other format can hold; the message names what it uses."""


_TOKEN: Final = re.compile(
    r"\s*(?://[^\n]*\n?|/\*.*?\*/)?\s*(?:"
    r"(?P<number>\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_]\w*)|"
    r"(?P<sign><<=|>>=|\*\*|:=|\+\+|--|->|<<|>>|<\?|>\?|<=|=<|>=|==|!=|&&|\|\||"
    r"[-+*/%&|^]=|[-+*/%<>=!?:()\[\],.&|^'{};]))",
    re.DOTALL,
)

_TCK_NAME: Final = re.compile(r"\s*(?P<name>[A-Za-z_][\w.]*)")
"""Names of TChecker may have dots."""

_WORDS: Final = {"and": "&&", "or": "||", "not": "!", "=<": "<="}
"""Other words for signs; ``=<`` is one of the old syntax."""

_QUANTIFIERS: Final = ("forall", "exists", "sum")
_COMPOUND: Final = ("+=", "-=", "*=", "/=", "%=", "&=", "|=", "^=", "<<=", ">>=")


def tokens_of(text: str, *, tck: bool = False) -> list[str]:
    """The words and signs of an expression, without comments; `tck`: in TChecker's language."""
    found, position = [], 0
    stripped = re.sub(r"//[^\n]*|/\*.*?\*/", " ", text, flags=re.DOTALL).rstrip()
    while position < len(stripped):
        match = (tck and _TCK_NAME.match(stripped, position)) or _TOKEN.match(stripped, position)
        if match is None:
            raise UnknownExpression(f"the text `{stripped[position:].strip()[:20]}`")
        word = match[match.lastgroup or 0]
        found.append(word if tck else _WORDS.get(word, word))
        position = match.end()
    return found


def parse_expression(text: str, *, tck: bool = False) -> Expr:
    """Reads an expression of UPPAAL's language, or of TChecker's.

    Raises:
        UnknownExpression: It uses what no other format has.
    """
    return _Reader(tokens_of(text, tck=tck), tck=tck).whole()


def parse_tck_statements(text: str) -> list[Assign]:
    """Reads the statements of an edge of TChecker, in order.

    Raises:
        UnknownExpression: It is no list of assignments.
    """
    reader = _Reader(tokens_of(text, tck=True), tck=True)
    updates = []
    while reader.token:
        if reader.token in ("if", "while", "local"):
            raise UnknownExpression(f"the statement `{reader.token}`")
        if reader.token == "nop":
            reader.take()
        else:
            target = reader.expression(PREFIX)
            reader.expect("=")
            updates.append(Assign(target, reader.expression()))
        if reader.token:
            reader.expect(";")
    return updates


def parse_updates(text: str) -> list[Assign]:
    """Reads the updates of an edge, in order.

    Raises:
        UnknownExpression: It uses what no other format has, such as functions with effects.
    """
    reader = _Reader(tokens_of(text))
    updates = []
    while reader.token:
        updates += reader.update()
        if reader.token:
            reader.expect(",")
    return updates


class _Reader:
    """Reads one text by precedence."""

    def __init__(self, tokens: list[str], *, tck: bool = False) -> None:
        self._tokens = tokens
        self._tck = tck
        self._next = 0

    @property
    def token(self) -> str:
        """The next token; empty at the end."""
        return self._tokens[self._next] if self._next < len(self._tokens) else ""

    def take(self) -> str:
        """Goes behind the next token."""
        token = self.token
        self._next += 1
        return token

    def expect(self, sign: str) -> None:
        """Goes behind a sign."""
        if self.token != sign:
            raise UnknownExpression(f"`{self.token or 'the end'}` where `{sign}` is expected")
        self._next += 1

    def whole(self) -> Expr:
        """All of the text as one expression."""
        found = self.expression()
        while self.token == "," and not self._tck:
            # The old syntax has lists of conditions.
            self.take()
            found = Binary("&&", found, self.expression())
        if self.token in ("=", ":=", "++", "--", *_COMPOUND):
            raise UnknownExpression("an assignment inside an expression")
        if self.token:
            raise UnknownExpression(f"`{self.token}`")
        return found

    def expression(self, least: int = 0) -> Expr:
        """An expression whose operators have at least this level."""
        left = self._operand()
        while (level := LEVELS.get(self.token, -1)) >= max(least, 3):
            operator = self.take()
            left = Binary(operator, left, self.expression(level + 1))
        if self.token == "?" and least <= 2:
            self.take()
            then = self.expression(2)
            self.expect(":")
            left = Choice(left, then, self.expression(2))
        return left

    def update(self) -> list[Assign]:
        """One update: nothing for ``1``, which some editors write for none."""
        if self.token in ("++", "--"):
            operator = self.take()
            target = self._operand()
            return [Assign(target, Binary(operator[0], target, Number(1)))]
        target = self.expression(PREFIX)
        operator = self.token
        if operator in ("=", ":="):
            self.take()
            start = self._next
            value = self.expression()
            if self.token in ("=", ":="):
                # In a = b = c the right one comes first.
                self._next = start
                inner = self.update()
                return [*inner, Assign(target, inner[-1].target)]
            return [Assign(target, value)]
        if operator in _COMPOUND:
            self.take()
            return [Assign(target, Binary(operator[:-1], target, self.expression()))]
        if operator in ("++", "--"):
            self.take()
            return [Assign(target, Binary(operator[0], target, Number(1)))]
        if isinstance(target, Number):
            return []
        if isinstance(target, Call):
            raise UnknownExpression(f"the function `{target.function}`")
        raise UnknownExpression(f"an update that is no assignment: `{shown(target)}`")

    def _operand(self) -> Expr:
        token = self.token
        if token in ("-", "!", "+"):
            self.take()
            # In TChecker's grammar `!i == 1` is the negation of a comparison.
            operand = self.expression(LEVELS["=="] if self._tck and token == "!" else PREFIX)
            if token == "+":
                return operand
            if token == "-" and isinstance(operand, Number):
                return Number(-operand.value)
            return Unary(token, operand)
        if token in _QUANTIFIERS and not self._tck:
            return self._quantified()
        if token == "if" and self._tck:
            return self._conditional()
        return self._postfix(self._primary())

    def _primary(self) -> Expr:
        token = self.take()
        if token == "(":
            inner = self.expression()
            self.expect(")")
            return inner
        if token.isdigit():
            if int(token) >= 2**31:
                raise UnknownExpression(f"the number {token}, which has more than 32 bits")
            return Number(int(token))
        if token and (token[0].isalpha() or token[0] == "_"):
            if token in ("true", "false"):
                return Number(int(token == "true"))
            return Name(token)
        if token[:1].isdigit():
            raise UnknownExpression(f"the number `{token}`, which is no integer")
        raise UnknownExpression(f"`{token or 'the end'}` where an operand is expected")

    def _postfix(self, found: Expr) -> Expr:
        while True:
            if self.token == "[":
                self.take()
                index = self.expression()
                self.expect("]")
                found = Index(found, index)
            elif self.token == ".":
                self.take()
                found = Field(found, self.take())
            elif self.token == "(" and isinstance(found, Name):
                self.take()
                found = Call(found.text, self._arguments())
            elif self.token == "'":
                raise UnknownExpression("the rate of a clock")
            else:
                return found

    def _arguments(self) -> tuple[Expr, ...]:
        arguments = []
        while self.token != ")":
            arguments.append(self.expression())
            if self.token != ")":
                self.expect(",")
        self.take()
        return tuple(arguments)

    def _conditional(self) -> Expr:
        """``if c then a else b``, in brackets."""
        self.take()
        condition = self.expression()
        self.expect("then")
        then = self.expression()
        self.expect("else")
        return Choice(condition, then, self.expression())

    def _quantified(self) -> Expr:
        kind = self.take()
        self.expect("(")
        name = self.take()
        self.expect(":")
        depth, words = 0, []
        while depth or self.token != ")":
            depth += {"[": 1, "(": 1, "]": -1, ")": -1}.get(self.token, 0)
            if not self.token:
                raise UnknownExpression("a quantifier without a body")
            words.append(self.take())
        self.take()
        return Quantified(kind, name, " ".join(words), self.expression())
