"""Text to typed tree, with every mistake of form reported in one run.

The way of a file:

1. lark's lexer cuts the text into tokens. What is no token is reported and left out.
2. The tokens are cut into statements: at braces, and at the words that begin one. All of these
   words are reserved, so that the cut is right even where the statement before it is wrong.
3. Each statement is parsed alone by the grammar (`grammar.lark`, LALR). One with a mistake is
   reported at the first token that cannot stand where it stands, and becomes a `Broken`; the others
   are not touched by it.

A first word that is nearly a keyword is reported and then taken for it, so that a slip in
``needle`` does not also make all that stands in its braces look wrong.

Cost: linear in the length of the text. The depth of the tree is bounded (`MAX_DEPTH`), so that
whoever walks it may recurse.
"""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from typing import TYPE_CHECKING, Final, Literal, cast

from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter, did_you_mean, suggest
from ntagen.nsl.quantity import is_unit
from ntagen.nsl.source import Source, Span

if TYPE_CHECKING:
    import lark

MAX_DEPTH: Final = 40
"""How deep parentheses may be nested in an expression, and braces in a file."""

BlockKind = Literal["file", "environment", "needle", "motion", "for"]

_REGIONS: Final = frozenset({"target", "critical", "detection"})
_NEEDLE_ITEMS: Final = frozenset({"tip", "heading", "bevel", "radius", "speed"})
_MOTION_ITEMS: Final = frozenset({"step", "roll"})
_BODY_ITEMS: Final = _REGIONS | {
    "tissue",
    "resolution",
    "safety",
    "query",
    "needle",
    "motion",
    "for",
}

ALLOWED: Final[dict[BlockKind, frozenset[str]]] = {
    "file": frozenset({"let", "include", "environment"}),
    "environment": _BODY_ITEMS | {"let", "include"},
    "needle": _NEEDLE_ITEMS,
    "motion": _MOTION_ITEMS,
    "for": _REGIONS | {"let", "for"},
}
"""Which statements may stand where."""

KEYWORDS: Final = frozenset().union(*ALLOWED.values())
"""The words that begin a statement."""

_OTHER_WORDS: Final = frozenset(
    {"sphere", "around", "margin", "by", "at", "most", "least", "times", "apart", "per", "in"}
)
RESERVED: Final = KEYWORDS | _OTHER_WORDS
"""All words that cannot be names because of the grammar."""

BLOCKS: Final[dict[str, BlockKind]] = {
    "environment": "environment",
    "needle": "needle",
    "motion": "motion",
    "for": "for",
}
"""The statements that have braces."""
_NAMING: Final = _REGIONS | {"environment", "let", "for"}


@dataclass(frozen=True, slots=True)
class Token:
    """A token: its terminal in the grammar, its text and its place."""

    type: str
    text: str
    span: Span
    line: int


@dataclass(frozen=True, slots=True)
class Comment:
    """A comment, with its slashes."""

    text: str
    span: Span
    line: int


@functools.cache
def _grammar() -> lark.Lark:
    """The parser of single statements; lark is imported when the first file is read."""
    import lark

    text = resources.files("ntagen.nsl").joinpath("grammar.lark").read_text("utf-8")
    return lark.Lark(
        text,
        parser="lalr",
        lexer="basic",
        start=["statement", "outside"],
        propagate_positions=True,
        maybe_placeholders=False,
    )


def tokenise(source: Source) -> list[Token | Comment]:
    """Every token and comment of a source; together with white space they are all of its text."""
    found: list[Token | Comment] = []
    for token in _grammar().lex(source.text, dont_ignore=True):
        start = cast(int, token.start_pos)
        span = source.span(start, start + len(token))
        if token.type in ("LINE_COMMENT", "BLOCK_COMMENT"):
            found.append(Comment(str(token).rstrip(), span, cast(int, token.line)))
        elif token.type != "SPACE":
            found.append(Token(token.type, str(token), span, cast(int, token.line)))
    return found


def parse(source: Source, reporter: Reporter, kind: BlockKind | None = "file") -> tree.File:
    """The tree of a source; mistakes of form go to the reporter.

    Args:
        source: The text.
        reporter: Where mistakes go.
        kind: In which braces the text stands: those of an include; None allows what any may hold.

    Returns:
        The tree of all that could be read.
    """
    tokens = [t for t in tokenise(source) if isinstance(t, Token)]
    return _Parser(source, tokens, reporter).file(kind)


class _Parser:
    """Cuts the tokens of one source into statements and parses each."""

    def __init__(self, source: Source, tokens: list[Token], reporter: Reporter) -> None:
        self._source = source
        self._reporter = reporter
        self._stray = [t.span.start for t in tokens if t.type in _STRAY]
        self._report_stray([t for t in tokens if t.type in _STRAY])
        self._tokens = [t for t in tokens if t.type not in _STRAY]
        self._is_cut_short = any(t.type == "UNCLOSED_COMMENT" for t in tokens)
        self._index = 0
        texts = [t.text for t in self._tokens if t.type == "BRACE"]
        self._missing_closing = texts.count("{") - texts.count("}")

    # ---------------------------------------------------------------------------------- statements

    def file(self, kind: BlockKind | None) -> tree.File:
        """All statements up to the end of the tokens."""
        statements: list[tree.Statement] = []
        while True:
            statements.extend(self._block(kind, depth=0))
            closing = self._peek()
            if closing is None:
                return tree.File(self._source, tuple(statements))
            self._index += 1
            self._reporter.report(
                "unmatched-brace",
                closing.span,
                "this brace closes nothing",
                hint="remove it, or look above for a missing `{`",
            )

    def _block(self, kind: BlockKind | None, depth: int) -> Iterator[tree.Statement]:
        """The statements up to a closing brace, which is left, or the end of the tokens."""
        while (token := self._peek()) is not None and token.text != "}":
            if token.text == "{" and token.type == "BRACE":
                self._reporter.report(
                    "missing-brace", token.span, "no statement stands before this brace"
                )
                yield from self._braces(kind, depth)
                continue
            if self._leaves_unclosed(kind, token):
                return
            yield self._statement(kind, depth)

    def _leaves_unclosed(self, kind: BlockKind | None, token: Token) -> bool:
        """Whether a block without its closing brace ends here, before another's statement."""
        return (
            kind in ("needle", "motion", "for")
            and self._missing_closing > 0
            and token.text in KEYWORDS - ALLOWED[kind]
            and token.text in ALLOWED["environment"]
        )

    def _statement(self, kind: BlockKind | None, depth: int) -> tree.Statement:
        """The statement that begins here, with its braces."""
        words = self._cut(kind)
        keyword = words[0].text
        is_misplaced = keyword in KEYWORDS and kind is not None and keyword not in ALLOWED[kind]
        if is_misplaced and kind is not None:
            self._report_misplaced(words[0], kind)
        parsed = self._parse_words(words)
        body: tuple[tree.Statement, ...] = ()
        brace = self._peek()
        has_brace = brace is not None and brace.text == "{"
        if keyword in BLOCKS:
            if has_brace:
                body = tuple(self._braces(BLOCKS[keyword], depth))
            else:
                self._reporter.report(
                    "missing-brace", words[-1].span.behind(), f"`{{` is missing after `{keyword}`"
                )
                if self._missing_closing < 0:
                    self._missing_closing += 1
                    body = tuple(self._block(BLOCKS[keyword], depth + 1))
                    self._close(words[-1])
        elif has_brace and brace is not None:
            if not isinstance(parsed, tree.Broken):
                self._reporter.report(
                    "missing-brace",
                    brace.span,
                    f"`{keyword}` has no braces",
                    hint="write its properties on one line",
                )
            body = tuple(self._braces(None, depth))
        if is_misplaced:
            return tree.Broken(parsed.span, keyword, _declared_name(words))
        return _with_body(parsed, body)

    def _braces(self, kind: BlockKind | None, depth: int) -> Iterator[tree.Statement]:
        """The statements in the braces that begin here."""
        opening = self._tokens[self._index]
        self._index += 1
        if depth < MAX_DEPTH:
            yield from self._block(kind, depth + 1)
        else:
            self._reporter.report(
                "nesting-too-deep", opening.span, f"braces are nested deeper than {MAX_DEPTH}"
            )
            self._skip_block()
        self._close(opening)

    def _skip_block(self) -> None:
        """Goes to the brace that closes the block, without looking at what is in it."""
        depth = 0
        while (token := self._peek()) is not None:
            if token.type == "BRACE":
                depth += 1 if token.text == "{" else -1
                if depth < 0:
                    return
            self._index += 1

    def _close(self, opening: Token) -> None:
        """Takes the closing brace of a block."""
        token = self._peek()
        if token is not None and token.text == "}":
            self._index += 1
            return
        self._missing_closing -= 1
        if not self._is_cut_short:
            self._reporter.report(
                "unclosed-brace",
                opening.span,
                "this brace is never closed",
                hint="add the missing `}`"
                + ("" if token is None else f" before line {token.line}"),
            )

    def _cut(self, kind: BlockKind | None) -> list[Token]:
        """The tokens of one statement: up to a brace or to a word that begins another one."""
        first = self._as_keyword(self._tokens[self._index], kind)
        self._index += 1
        words = [first]
        parentheses = 0
        while (token := self._peek()) is not None and token.type != "BRACE":
            previous = words[-1]
            if len(words) == 1 and first.text in _NAMING and self._is_name_reserved(first, token):
                token = Token("NAME", token.text, token.span, token.line)
            elif begins_statement(token, kind) or (
                parentheses <= 0 and _begins_unknown_statement(previous, token)
            ):
                break
            parentheses += {"LPAR": 1, "RPAR": -1}.get(token.type, 0)
            words.append(token)
            self._index += 1
        return words

    def _as_keyword(self, token: Token, kind: BlockKind | None) -> Token:
        """The first word of a statement, replaced by the keyword that it was meant to be."""
        if token.text in KEYWORDS or token.type in ("QUERY", "REGION_KIND"):
            return token
        allowed = KEYWORDS if kind is None else ALLOWED[kind]
        meant = suggest(token.text, allowed) or suggest(token.text, KEYWORDS)
        words = ", ".join(f"`{word}`" for word in sorted(allowed))
        self._reporter.report(
            "unknown-keyword",
            token.span,
            f"no statement begins with {_quoted(token)}",
            hint=f"did you mean `{meant}`?" if meant else f"here may stand {words}",
        )
        if meant is None or meant == "query":
            return token
        terminal = "REGION_KIND" if meant in _REGIONS else meant.upper()
        return Token(terminal, meant, token.span, token.line)

    def _is_name_reserved(self, first: Token, token: Token) -> bool:
        """Whether a reserved word stands where a name must; reports it if so."""
        if token.text not in RESERVED or token.line != first.line:
            return False
        self._reporter.report(
            "reserved-name",
            token.span,
            f"`{token.text}` is a word of the language and cannot be a name",
            hint=f"choose another name, for example `my_{token.text}`",
        )
        return True

    def _peek(self) -> Token | None:
        """The token that comes next."""
        return self._tokens[self._index] if self._index < len(self._tokens) else None

    # ----------------------------------------------------------------------------- one statement

    def _parse_words(self, words: Sequence[Token]) -> tree.Statement:
        """The tree of one statement without its braces."""
        span = words[0].span.to(words[-1].span)
        broken = tree.Broken(span, words[0].text.split()[0], _declared_name(words))
        if words[0].type == "QUERY":
            return self._query(words) or tree.Broken(span, "query")
        if words[0].text not in KEYWORDS or self._is_too_deep(words):
            return broken
        parsed = self._parse_with_grammar(words)
        if parsed is None:
            return broken
        return _TreeBuilder(self._source).statement(parsed, span)

    def _parse_with_grammar(self, words: Sequence[Token]) -> lark.Tree[lark.Token] | None:
        """What the grammar makes of the tokens; None if it refuses one, which is then reported."""
        import lark

        parser = _grammar().parse_interactive("", start="statement")
        last: lark.Token | None = None
        for word in words:
            last = lark.Token(
                word.type, word.text, start_pos=word.span.start, end_pos=word.span.end
            )
            try:
                parser.feed_token(last)
            except lark.UnexpectedToken:
                self._report_unexpected(words, word, _accepted(parser))
                return None
        try:
            parsed = parser.feed_eof(last)  # type: ignore[no-untyped-call]
        except lark.UnexpectedToken:
            self._report_unexpected(words, None, _accepted(parser))
            return None
        return cast("lark.Tree[lark.Token]", parsed)

    def _query(self, words: Sequence[Token]) -> tree.Query | None:
        """A query: its name, an equals sign and the rest of the line."""
        span, text = words[0].span, words[0].text
        head, equals, query = text.partition("=")
        name = head.removeprefix("query").strip()
        if not equals or not name.isidentifier() or not query.strip():
            defect = "a name" if not name.isidentifier() else "`=`" if not equals else "a text"
            self._reporter.report(
                "query-malformed",
                span,
                f"a query needs {defect}",
                hint="write for example `query Reach = E<> Checker.Final_TR_Reached`",
            )
            return None
        start = span.start + text.index(name, len("query"))
        identifier = tree.Identifier(self._source.span(start, start + len(name)), name)
        return tree.Query(span, identifier, query.strip())

    def _is_too_deep(self, words: Sequence[Token]) -> bool:
        """Whether parentheses are nested too deep to walk the tree; reports it if so."""
        depth = 0
        for word in words:
            depth += {"LPAR": 1, "RPAR": -1, "LSQB": 1, "RSQB": -1}.get(word.type, 0)
            if depth > MAX_DEPTH:
                self._reporter.report(
                    "nesting-too-deep",
                    word.span,
                    f"parentheses are nested deeper than {MAX_DEPTH}",
                    hint="name a part of the expression with `let`",
                )
                return True
        return False

    # ---------------------------------------------------------------------------------- reporting

    def _report_stray(self, tokens: Sequence[Token]) -> None:
        """Reports what is no token of the language."""
        for token in tokens:
            if token.type == "UNCLOSED_COMMENT":
                self._reporter.report(
                    "unclosed-comment",
                    self._source.span(token.span.start, token.span.start + 2),
                    "this comment is never closed",
                    hint="end it with `*/`",
                )
            elif token.type == "UNCLOSED_STRING":
                self._reporter.report(
                    "unclosed-string",
                    token.span,
                    "this quote is never closed",
                    hint='end the path with `"` on the same line',
                )
            else:
                self._reporter.report(
                    "stray-character",
                    token.span,
                    f"unexpected character {_visible(token.text)}",
                    hint=_STRAY_HINTS.get(token.text),
                )

    def _report_misplaced(self, word: Token, kind: BlockKind) -> None:
        """Reports a statement that stands in the wrong braces."""
        homes = [home for home, allowed in ALLOWED.items() if word.text in allowed]
        where = "at the top of the file" if kind == "file" else f"in `{kind}`"
        place = " or ".join(
            "at the top of the file" if home == "file" else f"in the braces of `{home}`"
            for home in homes
        )
        self._reporter.report(
            "misplaced-statement",
            word.span,
            f"`{word.text}` may not stand {where}",
            hint=f"it belongs {place}",
        )

    def _report_unexpected(
        self, words: Sequence[Token], found: Token | None, accepts: Iterable[str]
    ) -> None:
        """Reports the first token of a statement that the grammar refuses; None is the end."""
        start, end = words[0].span.start, words[-1].span.end
        if any(start <= stray <= end for stray in self._stray):
            return  # What is left out because it is no token explains the gap.
        expected = _describe(set(accepts))
        at_end = self._peek()
        what = _quoted(found) if found else "the end" if at_end is None else _quoted(at_end)
        span = found.span if found else words[-1].span.behind()
        near = (
            {_TERMINAL_WORDS.get(t, t.lower()) for t in accepts} if isinstance(accepts, set) else ()
        )
        self._reporter.report(
            "unexpected-word",
            span,
            f"expected {expected}, found {what}" if found else f"expected {expected} before {what}",
            hint=(did_you_mean(found.text, near) if found else None) or _FORMS.get(words[0].text),
        )


def _accepted(parser: lark.parsers.lalr_interactive_parser.InteractiveParser) -> set[str]:
    """The terminals that a parser would take next."""
    return cast("set[str]", parser.accepts())  # type: ignore[no-untyped-call]


def begins_statement(token: Token, kind: BlockKind | None) -> bool:
    """Whether a token is a word that begins a statement; `radius` is one in a needle only."""
    if token.type == "QUERY":
        return True
    return token.text in KEYWORDS and (token.text != "radius" or kind == "needle")


def _begins_unknown_statement(previous: Token, token: Token) -> bool:
    """Whether a name that begins a line after a whole value can only be a misspelt keyword."""
    return (
        token.type == "NAME"
        and token.line > previous.line
        and previous.type in ("NAME", "NUMBER", "RATIO", "RPAR", "RSQB", "STRING", "TIMES", "APART")
        and not is_unit(token.text)
    )


def _declared_name(words: Sequence[Token]) -> str | None:
    """The name that a statement declares, if that much of it is right."""
    if len(words) > 1 and words[0].text in _NAMING and words[1].type == "NAME":
        return words[1].text
    return None


def _with_body(parsed: tree.Statement, body: tuple[tree.Statement, ...]) -> tree.Statement:
    """A statement with what stands in its braces."""
    if isinstance(parsed, tree.Section | tree.Loop | tree.Environment | tree.Broken):
        return replace(parsed, body=body)
    return parsed


_STRAY: Final = frozenset({"STRAY", "UNCLOSED_STRING", "UNCLOSED_COMMENT"})

_STRAY_HINTS: Final = {
    ";": "statements need no separator",
    "#": "comments begin with `//`",
    ".": "write a digit on both sides of a decimal point",
    "°": "write `deg`",
    "µ": "write `um`",
    "μ": "write `um`",
    "\N{MINUS SIGN}": "write the hyphen `-`",
    "\N{EN DASH}": "write the hyphen `-`",
    "\N{MULTIPLICATION SIGN}": "write `*`",
    "·": "write `*`",
    "^": "write a product, for example `r * r`",
    "'": 'write `"`',
    "“": 'write `"`',
    "”": 'write `"`',
    "\ufeff": "the file has a byte order mark inside its text: delete it",
}

_FORMS: Final = {
    "environment": "write `environment NAME { … }`",
    "needle": "write `needle { … }`",
    "motion": "write `motion { … }`",
    "for": "write for example `for i in 0..7 { … }`",
    "let": "write for example `let depth = 50 mm`",
    "include": 'write for example `include "needle.nsl"`',
    "target": "write for example `target T1 sphere (0, -50, 0) mm radius 10 mm`",
    "critical": "write for example `critical C1 sphere (0, -25, 0) mm radius 2 mm`",
    "detection": "write for example `detection D1 around C1 margin 3 mm`",
    "tip": "write for example `tip (0, 0, 0) mm`",
    "heading": "write for example `heading -y` or `heading (0, -1, 0)`",
    "bevel": "write for example `bevel +z` or `bevel (0, 0, 1)`",
    "radius": "write for example `radius 30 mm`",
    "speed": "write for example `speed 1 mm/s`",
    "step": "write for example `step 2 s`",
    "roll": "write for example `roll by 90, 180 deg at most 2 times at least 2 mm apart`",
    "tissue": "write `tissue static`",
    "resolution": "write for example `resolution 1000 per mm`",
    "safety": "write `safety sampled` or `safety swept`",
}

_TERMINAL_WORDS: Final = {
    "LPAR": "(",
    "RPAR": ")",
    "LSQB": "[",
    "RSQB": "]",
    "COMMA": ",",
    "EQUAL": "=",
    "RANGE": "..",
    "STRING": "a path in quotes",
    "NAME": "a name",
    "RATIO": "a unit",
}
_VALUE_TERMINALS: Final = frozenset({"NUMBER", "NAME", "LPAR", "SIGN"})
_OPERATORS: Final = frozenset({"SIGN", "SCALE", "RATIO"})


def _describe(terminals: set[str]) -> str:
    """The terminals that may stand at a place, in words: ``a value``, `` `margin` or a unit``."""
    rest = set(terminals)
    words: list[str] = []
    if rest >= _VALUE_TERMINALS:
        rest -= _VALUE_TERMINALS
        words.append("a value")
    elif "SCALE" in rest:
        # Behind a value nearly anything may go on; what must come is the useful part.
        if "RATIO" in rest:
            rest -= {"NAME"}
            words.append("a unit")
        rest -= _OPERATORS
    rest.discard("$END")
    words = (
        sorted(
            _TERMINAL_WORDS[t]
            if " " in _TERMINAL_WORDS.get(t, "")
            else f"`{_TERMINAL_WORDS.get(t, t.lower())}`"
            for t in rest
        )
        + words
    )
    return "the end of the statement" if not words else _either(words)


def _either(words: Sequence[str]) -> str:
    """Alternatives as a list: ``a, b or c``."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} or {words[-1]}"


def _quoted(token: Token) -> str:
    """A token as it is named in a message."""
    text = token.text if len(token.text) <= 30 else token.text[:27] + "..."
    return f"`{text}`"


def _visible(character: str) -> str:
    """A character as it is named in a message, also one that cannot be seen."""
    return f"`{character}`" if character.isprintable() else f"U+{ord(character):04X}"


class _TreeBuilder:
    """Turns lark's trees into ours."""

    def __init__(self, source: Source) -> None:
        self._source = source

    def statement(self, node: lark.Tree[lark.Token], span: Span) -> tree.Statement:
        """A statement of any kind."""
        keyword = node.data
        parts = node.children
        match keyword:
            case "environment":
                return tree.Environment(span, self._identifier(parts[0]), ())
            case "needle" | "motion":
                return tree.Section(span, keyword, ())
            case "loop":
                return tree.Loop(
                    span,
                    self._identifier(parts[0]),
                    self.expression(parts[1]),
                    self.expression(parts[3]),
                    (),
                )
            case "let":
                return tree.Let(span, self._identifier(parts[0]), self.expression(parts[1]))
            case "include":
                path = self._identifier(parts[0])
                return tree.Include(span, tree.Identifier(path.span, path.text[1:-1]))
            case "region":
                return self._region(node, span)
            case "roll":
                return self._roll(parts, span)
            case "tissue" | "safety":
                return tree.Choice(span, keyword, self._identifier(parts[0]))
            case "resolution":
                return tree.Resolution(span, self.expression(parts[0]), self._identifier(parts[1]))
            case "tip" | "heading" | "bevel" | "radius" | "speed" | "step":
                return tree.Setting(span, keyword, self.expression(parts[0]))
        raise AssertionError(f"the grammar has a statement that the tree has not: {keyword}")

    def _region(self, node: lark.Tree[lark.Token], span: Span) -> tree.Region:
        """A region with its shape."""
        kind, name, shape = node.children
        keyword = cast("Literal['target', 'critical', 'detection']", str(kind))
        shape = cast("lark.Tree[lark.Token]", shape)
        first, second = shape.children
        shape_span = self._span(shape)
        return tree.Region(
            span,
            keyword,
            self._region_name(name),
            tree.Sphere(shape_span, self.expression(first), self.expression(second))
            if shape.data == "sphere"
            else tree.Around(shape_span, self._region_name(first), self.expression(second)),
        )

    def _region_name(self, node: object) -> tree.RegionName:
        """A name with its indices."""
        node = cast("lark.Tree[lark.Token]", node)
        name, *indices = node.children
        return tree.RegionName(
            self._span(node), self._identifier(name), tuple(map(self.expression, indices))
        )

    def _roll(self, parts: Sequence[object], span: Span) -> tree.Roll:
        """Angles and limits, told apart by their nodes."""
        nodes = [cast("lark.Tree[lark.Token]", part) for part in parts]
        limits: dict[str, list[tree.Expression]] = {"at_most": [], "at_least": []}
        angles: list[tree.Expression] = []
        for node in nodes:
            if node.data in limits:
                limits[node.data].append(self.expression(node.children[0]))
            else:
                angles.append(self.expression(node))
        return tree.Roll(span, tuple(angles), tuple(limits["at_most"]), tuple(limits["at_least"]))

    def expression(self, node: object) -> tree.Expression:
        """An expression; levels of the grammar that add nothing vanish."""
        node = cast("lark.Tree[lark.Token]", node)
        children = node.children
        span = self._span(node)
        match node.data:
            case "sum" | "product":
                return self._chain(children, span)
            case "signed":
                *signs, last = children
                operand = self.expression(last)
                return (
                    tree.Signed(span, operand, sum(sign == "-" for sign in signs) % 2 == 1)
                    if signs
                    else operand
                )
            case "quantity":
                operand = self.expression(children[0])
                if len(children) == 1:
                    return operand
                unit = cast("lark.Tree[lark.Token]", children[1]).children[0]
                return tree.Measured(span, operand, self._identifier(unit))
            case "number":
                return tree.Number(span, float(cast(str, children[0])))
            case "name":
                return tree.Name(span, str(children[0]))
            case "call":
                function, *arguments = children
                return tree.Call(
                    span, self._identifier(function), tuple(map(self.expression, arguments))
                )
            case "vector":
                return tree.Vector(span, tuple(map(self.expression, children)))
            case "parenthesised":
                return self.expression(children[0])
        raise AssertionError(f"the grammar has an expression that the tree has not: {node.data}")

    def _chain(self, children: Sequence[object], span: Span) -> tree.Expression:
        """Operands and the operators between them."""
        first = self.expression(children[0])
        rest = tuple(
            (cast("Literal['+', '-', '*', '/']", str(operator)), self.expression(operand))
            for operator, operand in zip(children[1::2], children[2::2], strict=True)
        )
        return tree.Chain(span, first, rest) if rest else first

    def _identifier(self, token: object) -> tree.Identifier:
        """A token as a name with its place."""
        token = cast("lark.Token", token)
        start = cast(int, token.start_pos)
        return tree.Identifier(self._source.span(start, start + len(token)), str(token))

    def _span(self, node: lark.Tree[lark.Token]) -> Span:
        """The place of a node."""
        return self._source.span(node.meta.start_pos, node.meta.end_pos)
