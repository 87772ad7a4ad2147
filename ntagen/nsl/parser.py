"""Parses a text to a typed tree, and reports all syntax errors in one run.

The steps:

1. lark's lexer cuts the text into tokens. Other characters are reported and left out.
2. The tokens are cut into statements: at braces, and at the words that begin a statement. All of
   these words are reserved, so that the cut is right even after a statement with a mistake.
3. Each statement is parsed alone by the grammar (`environment.lark`, LALR). A mistake is reported
   at the first token that cannot stand at its place. That statement becomes a `Broken`; it does
   not affect the others.

A first word that is nearly a keyword is reported and then replaced by it. Otherwise a misspelt
``needle`` would make everything in its braces look wrong.

Cost: linear in the length of the text. The depth of the tree is at most `MAX_DEPTH`, so recursion
over it is safe.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter, did_you_mean, suggest
from ntagen.nsl.grammar import UnexpectedTokenError, read_statement
from ntagen.nsl.lexer import tokenise
from ntagen.nsl.quantity import is_unit
from ntagen.nsl.source import Source
from ntagen.nsl.tokens import (
    ALLOWED,
    BLOCKS,
    KEYWORDS,
    NAMING,
    PHRASES,
    REGIONS,
    RESERVED,
    STRAY,
    BlockKind,
    Token,
    begins_statement,
    keyword_of,
)
from ntagen.nsl.wording import (
    STRAY_HINTS,
    TERMINAL_WORDS,
    UNCLOSED,
    describe,
    form_of,
    quoted,
    solid_in,
    visible,
)

MAX_DEPTH: Final = 40
"""How deep parentheses may be nested in an expression, and braces in a file."""


def parse(source: Source, reporter: Reporter, kind: BlockKind | None = "file") -> tree.File:
    """The tree of a source; syntax errors go to the reporter.

    Args:
        source: The text.
        reporter: Collects the mistakes.
        kind: The braces in which the text stands. None allows all statements, as in an include.

    Returns:
        The tree of all that could be read.
    """
    if foreign := _foreign(source):
        name, message, hint = foreign
        reporter.report_file(name, source.path, message, hint=hint)
        return tree.File(source, ())
    tokens = [t for t in tokenise(source, kind) if isinstance(t, Token)]
    return _Parser(source, tokens, reporter).file(kind)


def _foreign(source: Source) -> tuple[str, str, str] | None:
    """What is wrong with a text of another kind: the defect, the message, and a hint.

    XML is a UPPAAL model, and so is a file whose name says it. What begins with a brace or a
    bracket and a quote, as JSON does, is no statement of the language.
    """
    text = source.text.lstrip()
    if text.startswith("<") or source.path.lower().endswith((".xta", ".ta")):
        hint = "`ntagen check` answers its queries, and `ntagen info` shows what is in it"
        return "uppaal-model", "this is a UPPAAL model, and not an environment", hint
    if text[:1] in ("{", "[") and text[1:].lstrip().startswith(('"', "{", "[")):
        hint = "give the environment or the model that the file comes from"
        return "json-file", "this is JSON, and not an environment", hint
    return None


class _Parser:
    """Cuts the tokens of one source into statements and parses each."""

    def __init__(self, source: Source, tokens: list[Token], reporter: Reporter) -> None:
        self._source = source
        self._reporter = reporter
        self._stray = [t for t in tokens if t.type in STRAY]
        self._stray_starts = [t.span.start for t in self._stray]
        self._report_stray()
        self._tokens = [t for t in tokens if t.type not in STRAY]
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
        """The statements up to a closing brace, which is not taken, or the end of the tokens."""
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
        is_phrase = words[0].type in PHRASES.values()
        is_allowed = kind is None or (keyword in ALLOWED[kind] and kind not in PHRASES)
        # A word of other braces can be a name here.
        is_name = keyword in KEYWORDS and words[0].type == "NAME"
        is_misplaced = keyword in KEYWORDS and not is_phrase and (is_name or not is_allowed)
        if is_misplaced:
            self._report_misplaced(words[0], None if is_allowed else kind)
        if is_name:
            parsed: tree.Statement = tree.Broken(words[0].span.to(words[-1].span), keyword)
        else:
            parsed = self._parse_words(words)
        if keyword in BLOCKS:
            body = tuple(self._body(words, depth))
        else:
            body = tuple(self._superfluous_braces(words, depth, isinstance(parsed, tree.Broken)))
        if is_misplaced:
            return tree.Broken(parsed.span, keyword, _declared_name(words))
        return _with_body(parsed, body)

    def _body(self, words: Sequence[Token], depth: int) -> Iterator[tree.Statement]:
        """The statements in the braces of a statement that has braces."""
        keyword, brace = words[0].text, self._peek()
        if brace is not None and brace.text == "{":
            yield from self._braces(BLOCKS[keyword], depth)
            return
        self._reporter.report(
            "missing-brace", words[-1].span.behind(), f"`{{` is missing after `{keyword}`"
        )
        if self._missing_closing < 0:
            # There is an extra closing brace, so only the opening one was forgotten.
            self._missing_closing += 1
            yield from self._block(BLOCKS[keyword], depth + 1)
            self._close(words[-1])

    def _superfluous_braces(
        self, words: Sequence[Token], depth: int, is_reported: bool
    ) -> Iterator[tree.Statement]:
        """The statements in braces after a statement that must not have braces."""
        brace = self._peek()
        if brace is None or brace.text != "{" or brace.line > words[-1].line:
            return
        if not is_reported:
            self._reporter.report(
                "missing-brace",
                brace.span,
                f"`{words[0].text}` has no braces",
                hint="write its properties on one line",
            )
        yield from self._braces(None, depth)

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
        """Goes to the brace that closes the block, without parsing the block."""
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
        # The words of a needle begin after its brace, even if that was forgotten. The radius of a
        # sphere is not a statement, even in a needle.
        if first.text in ("needle", "motion"):
            kind = BLOCKS[first.text]
        elif first.text in REGIONS:
            kind = None
        parentheses = 0
        while (token := self._peek()) is not None and token.type != "BRACE":
            previous = words[-1]
            if len(words) == 1 and first.text in NAMING and self._is_name_reserved(first, token):
                token = Token("NAME", token.text, token.span, token.line)
            elif begins_statement(token, kind) or (
                parentheses <= 0 and self._begins_unknown_statement(previous, token)
            ):
                break
            parentheses += {"LPAR": 1, "RPAR": -1}.get(token.type, 0)
            words.append(token)
            self._index += 1
        return words

    def _as_keyword(self, token: Token, kind: BlockKind | None) -> Token:
        """The first word of a statement; a misspelt keyword is reported and replaced."""
        if token.text in KEYWORDS or token.type in ("QUERY", "REGION_KIND", *PHRASES.values()):
            return token
        allowed = KEYWORDS if kind is None else ALLOWED[kind]
        begun = [words for words in allowed if words.startswith(f"{token.text} ")]
        meant = (
            (begun[0] if len(begun) == 1 else None)
            or suggest(self._phrase() if kind == "drive" else token.text, allowed)
            or suggest(token.text, KEYWORDS)
        )
        others = ", ".join(f"`{word}`" for word in sorted(allowed))
        others = f"possible words here: {others}"
        if kind == "drive":
            others = "`ntagen drive --help-settings` prints all settings"
        self._reporter.report(
            "unknown-keyword",
            token.span,
            f"no statement begins with {quoted(token)}",
            hint=f"did you mean `{meant}`?" if meant else others,
        )
        if meant is None or meant == "query" or " " in meant:
            return token
        terminal = "REGION_KIND" if meant in REGIONS else meant.upper()
        if kind is not None and kind in PHRASES and meant in allowed:
            terminal = PHRASES[kind]
        return Token(terminal, meant, token.span, token.line)

    def _phrase(self) -> str:
        """The words from here on, up to a value or the end of the line: settings have several."""
        line = self._tokens[self._index].line
        words: list[str] = []
        while (token := self._peek(len(words))) is not None:
            if token.line != line or not token.text[0].isalpha():
                break
            words.append(token.text)
        return " ".join(words)

    def _begins_unknown_statement(self, previous: Token, token: Token) -> bool:
        """Whether a name that begins a line can only be a misspelt keyword.

        This is so if a whole value stands before it, or if the next token cannot continue a value.
        """
        if token.type != "NAME" or token.line <= previous.line or is_unit(token.text):
            return False
        following = self._peek(1)
        return previous.type in _VALUE_ENDS or (
            following is not None
            and following.line == token.line
            and following.type in ("NAME", "NUMBER")
            and not is_unit(following.text)
        )

    def _is_name_reserved(self, first: Token, token: Token) -> bool:
        """Whether a reserved word stands in the place of a name; if so, reports it."""
        if token.text not in RESERVED - {"sphere", "around", "in"} or token.line != first.line:
            return False
        self._reporter.report(
            "reserved-name",
            token.span,
            f"`{token.text}` is a word of the language and cannot be a name",
            hint=f"choose another name, for example `my_{token.text}`",
        )
        return True

    def _peek(self, distance: int = 0) -> Token | None:
        """The next token, or the one `distance` tokens after it."""
        index = self._index + distance
        return self._tokens[index] if index < len(self._tokens) else None

    # ----------------------------------------------------------------------------- one statement

    def _parse_words(self, words: Sequence[Token]) -> tree.Statement:
        """The tree of one statement without its braces."""
        span = words[0].span.to(words[-1].span)
        broken = tree.Broken(span, keyword_of(words[0]), _declared_name(words))
        if words[0].type == "QUERY":
            return self._query(words) or tree.Broken(span, "query")
        is_known = words[0].text in KEYWORDS or words[0].type in PHRASES.values()
        if not is_known or self._is_too_deep(words):
            return broken
        try:
            parsed = read_statement(words)
        except UnexpectedTokenError as error:
            self._report_unexpected(words, error.token, error.expected)
            return broken
        return broken if self._has_gap(words) else parsed

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
        if len(words) > 1:
            self._report_unexpected(words, words[1], ())
        start = span.start + text.index(name, len("query"))
        identifier = tree.Identifier(self._source.span(start, start + len(name)), name)
        return tree.Query(span, identifier, query.strip())

    def _is_too_deep(self, words: Sequence[Token]) -> bool:
        """Whether parentheses are nested too deep for recursion; if so, reports it."""
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

    def _has_gap(self, words: Sequence[Token]) -> bool:
        """Whether characters that are not tokens were left out of a statement, or after it."""
        start, end = words[0].span.start, words[-1].span.end
        if self._is_stray_between(start, end):
            return True
        index = bisect_left(self._stray_starts, end)
        return (
            index < len(self._stray)
            and self._stray_starts[index] == end
            and self._stray[index].text not in _SEPARATORS
        )

    def _is_stray_between(self, start: int, end: int) -> bool:
        """Whether characters that are not tokens stand between two places."""
        return bisect_left(self._stray_starts, start) < bisect_left(self._stray_starts, end)

    # ---------------------------------------------------------------------------------- reporting

    def _report_stray(self) -> None:
        """Reports characters that are not tokens of the language."""
        for token in self._stray:
            span, hint = token.span, STRAY_HINTS.get(token.text[0])
            kind, message = "stray-character", f"unexpected {visible(token.text)}"
            if token.type in UNCLOSED:
                kind, message, hint = UNCLOSED[token.type]
            if token.type == "UNCLOSED_COMMENT":
                span = self._source.span(span.start, span.start + 2)
            self._reporter.report(kind, span, message, hint=hint)

    def _report_misplaced(self, word: Token, kind: BlockKind | None) -> None:
        """Reports a statement that stands in the wrong braces; None is any."""
        homes = [home for home, allowed in ALLOWED.items() if word.text in allowed]
        where = "here" if kind is None else f"in `{kind}`"
        where = "at the top of the file" if kind == "file" else where
        place = " or ".join(
            "at the top of the file" if home == "file" else f"in the braces of `{home}`"
            for home in homes
        )
        self._reporter.report(
            "misplaced-statement",
            word.span,
            f"`{word.text}` cannot stand {where}",
            hint=f"it belongs {place}",
        )

    def _report_unexpected(
        self, words: Sequence[Token], found: Token | None, accepts: Iterable[str]
    ) -> None:
        """Reports the first token of a statement that the grammar refuses; None is the end."""
        following = self._peek() if found is None else found
        start = words[0].span.start
        end = following.span.start if following else len(self._source.text)
        if self._is_stray_between(start, end):
            return  # Characters that were left out are the mistake, and reported already.
        expected = describe(set(accepts))
        what = "the end" if following is None else quoted(following)
        words_near = [TERMINAL_WORDS.get(terminal, terminal.lower()) for terminal in accepts]
        hint = did_you_mean(found.text, words_near) if found else None
        self._reporter.report(
            "unexpected-word",
            found.span if found else words[-1].span.behind(),
            f"expected {expected}{', found' if found else ' before'} {what}",
            hint=hint or form_of(solid_in(words)),
        )


_VALUE_ENDS: Final = frozenset(
    {"NAME", "NUMBER", "RATIO", "PERCENT", "RPAR", "RSQB", "STRING", "TIMES", "APART"}
)
_SEPARATORS: Final = frozenset({";", ","})


def _declared_name(words: Sequence[Token]) -> str | None:
    """The name that a statement declares, if that part of it is right."""
    if len(words) > 1 and words[0].text in NAMING and words[1].type == "NAME":
        return words[1].text
    return None


def _with_body(parsed: tree.Statement, body: tuple[tree.Statement, ...]) -> tree.Statement:
    """A statement with the statements in its braces."""
    if isinstance(parsed, tree.Section | tree.Device | tree.Loop | tree.Environment | tree.Broken):
        return replace(parsed, body=body)
    return parsed
