"""Makes a draft of the scene: reads includes, unrolls loops, resolves names and units.

A `Draft` has the values in the file, each with its place. A value with a mistake is None, and the
mistake is reported. `ntagen.nsl.build` checks later whether the values fit together.

Cost: one step for each statement and each round of a loop; rounds are limited by `MAX_ROUNDS`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from ntagen.nsl import tree
from ntagen.nsl.content import NUMBERS, VECTORS, ContentResolver
from ntagen.nsl.diagnostics import Reporter
from ntagen.nsl.draft import Draft
from ntagen.nsl.driving import CHOICES, DriverResolver
from ntagen.nsl.evaluate import CONSTANTS, FUNCTIONS, Definition, Evaluator, Scope
from ntagen.nsl.parser import MAX_DEPTH, parse
from ntagen.nsl.quantity import Quantity, is_unit, scalar
from ntagen.nsl.reading import located, read_source
from ntagen.nsl.source import Source
from ntagen.nsl.tokens import ALLOWED, BLOCKS, BlockKind
from ntagen.parameters import BY_WORDS

MAX_ROUNDS: Final = 10_000
"""All loops of an environment together make at most this many rounds."""

MAX_LOOP_STATEMENTS: Final = 100_000
"""All these rounds together execute at most this many statements."""

_ONCE: Final = frozenset(
    {
        "needle",
        "motion",
        "roll",
        "spin",
        "wait",
        "push",
        "resolution",
        "transform",
        "drive",
        *NUMBERS,
        *VECTORS,
        *CHOICES,
        *BY_WORDS,
    }
)
_ONCE_IN_DEVICE: Final = frozenset({"insert", "roll"})


def resolve(source: Source, reporter: Reporter, folders: Sequence[str | Path] = ()) -> Draft | None:
    """The draft of a file; None if it has no environment. Mistakes go to the reporter.

    Args:
        source: The file.
        reporter: Collects the mistakes.
        folders: Folders below which included files may lie, besides the folder of the file.
    """
    return _Resolver(reporter, folders).file(source)


class _Resolver:
    """Goes through the statements of a file and of the files that it includes."""

    def __init__(self, reporter: Reporter, folders: Sequence[str | Path]) -> None:
        self._reporter = reporter
        self._folders = [os.path.realpath(folder) for folder in folders]
        self._evaluator = Evaluator(reporter)
        self._driver = DriverResolver(reporter, self._evaluator)
        self._content = ContentResolver(reporter, self._evaluator, self._driver, self._folders)
        self._draft: Draft | None = None
        self._open_files: list[str] = []
        self._included: set[str] = set()
        self._rounds = 0
        self._loop_statements = 0
        self._loop_depth = 0

    def file(self, source: Source) -> Draft | None:
        """The draft of the whole file."""
        file = parse(source, self._reporter)
        self._folders.append(os.path.realpath(os.path.dirname(source.path)))
        self._open_files.append(os.path.realpath(source.path))
        if not file.statements and not self._reporter.has_errors:
            self._reporter.report_file(
                "file-empty",
                source.path,
                "the file describes nothing",
                hint="begin with `environment NAME { … }`",
            )
            return None
        self._statements(file.statements, Scope(), "file")
        if self._draft is None and file.statements:
            self._reporter.report_file(
                "environment-missing",
                source.path,
                "the file has no environment",
                hint="begin with `environment NAME { … }`",
            )
        return self._draft

    def _statements(
        self, statements: Sequence[tree.Statement], scope: Scope, place: BlockKind
    ) -> None:
        """Goes through statements in their order."""
        for statement in statements:
            if isinstance(statement, tree.Broken):
                self._broken(statement, scope)
            elif statement.keyword not in ALLOWED[place]:
                self._misplaced(statement, place)
            else:
                self._statement(statement, scope, place)

    def _misplaced(self, statement: tree.Statement, place: BlockKind) -> None:
        """Reports a statement of an included file that cannot stand at the place of the include."""
        where = "at the top of a file" if place == "file" else f"in `{place}`"
        self._reporter.report(
            "misplaced-statement",
            statement.span,
            f"`{statement.keyword}` cannot be included {where}",
            hint="move the include, or the statement",
        )

    def _broken(self, statement: tree.Broken, scope: Scope) -> None:
        """Notes what a statement with a mistake would have declared, and checks its braces."""
        name, keyword = statement.name, statement.keyword
        if self._draft is not None:
            self._draft.has_gaps = True
            self._draft.seen.setdefault(keyword, statement.span)
        if keyword == "let" and name is not None:
            scope[name] = Definition(None, statement.span)
        elif keyword == "environment" and self._draft is None:
            self._draft = Draft(statement.span, name or "?", has_gaps=True)
            self._statements(statement.body, scope.new_child(), "environment")
        elif keyword in ("needle", "motion", "drive", "device"):
            self._statements(statement.body, scope, BLOCKS[keyword])
        elif keyword == "for" and name is not None:
            self._round(statement.body, scope, tree.Identifier(statement.span, name), None)
        elif name is not None and self._draft is not None:
            self._draft.broken_names.add(name)

    def _statement(self, statement: tree.Statement, scope: Scope, place: BlockKind) -> None:
        """Resolves a statement that is at a right place."""
        if self._is_repeated(statement):
            return
        match statement:
            case tree.Let():
                self._let(statement, scope)
            case tree.Include():
                self._include(statement, scope, place)
            case tree.Environment():
                self._environment(statement, scope)
            case tree.Section(keyword=keyword, body=body):
                self._statements(body, scope, keyword)
            case tree.Device():
                if self._draft is not None and self._driver.device(statement, self._draft):
                    self._statements(statement.body, scope, "device")
            case tree.Loop():
                self._loop(statement, scope)
            case _ if self._draft is not None:
                is_in_loop = self._loop_depth > 0
                self._content.add(statement, scope, self._draft, is_in_loop=is_in_loop)

    def _is_repeated(self, statement: tree.Statement) -> bool:
        """Whether a statement that may occur only once is repeated; if so, reports it."""
        is_axis = isinstance(statement, tree.Axis)
        if self._draft is None or statement.keyword not in (_ONCE_IN_DEVICE if is_axis else _ONCE):
            return False
        key = f"{'axis ' if is_axis else ''}{statement.keyword}"
        first = self._draft.seen.setdefault(key, statement.span)
        if first is statement.span:
            return False
        self._reporter.repeated(statement.span, statement.keyword, f"the first is at {first.place}")
        return True

    # ------------------------------------------------------------------------------- composition

    def _environment(self, statement: tree.Environment, scope: Scope) -> None:
        """Resolves the environment; a second one is reported and left out."""
        if self._draft is not None:
            self._reporter.report(
                "environment-repeated",
                statement.span,
                f"`{statement.name.text}` is the second environment of this file",
                hint="write one file for each; share what they have in common with `include`",
                notes=(f"the first is at {self._draft.span.place}",),
            )
            return
        folders = tuple(self._folders)
        self._draft = Draft(statement.name.span, statement.name.text, folders=folders)
        self._statements(statement.body, scope.new_child(), "environment")

    def _include(self, statement: tree.Include, scope: Scope, place: BlockKind) -> None:
        """Resolves the statements of another file as if they stood here; a file counts once."""
        span = statement.path.span
        found = located(statement.path.text, span, self._folders, self._reporter, "include")
        if found is None:
            return
        path, key = found
        if key in self._open_files:
            chain = [os.path.basename(p) for p in self._open_files[self._open_files.index(key) :]]
            self._reporter.report(
                "include-cycle",
                span,
                f"`{path}` includes itself",
                notes=(" includes ".join([*chain, chain[0]]),),
                hint="move the parts that both files need into a third file",
            )
            return
        if key in self._included:
            return
        if len(self._open_files) > MAX_DEPTH:
            self._reporter.report(
                "nesting-too-deep", span, f"includes are nested deeper than {MAX_DEPTH}"
            )
            return
        self._included.add(key)
        source = read_source(path, self._reporter, included_at=span)
        if source is None:
            if self._draft is not None:
                self._draft.has_gaps = True
            return
        self._reporter.enter(path)
        self._open_files.append(key)
        file = parse(source, self._reporter, kind=None)
        self._statements(file.statements, scope, place)
        self._open_files.pop()

    def _loop(self, statement: tree.Loop, scope: Scope) -> None:
        """Resolves the body once for each number from the first to the last."""
        first = self._evaluator.whole(statement.first, scope, "the first number of a loop").value
        last = self._evaluator.whole(statement.last, scope, "the last number of a loop").value
        is_free = self._is_name_free(statement.variable, scope)
        if first is not None and last is not None and first > last:
            self._reporter.report(
                "loop-empty",
                statement.first.span.to(statement.last.span),
                f"the loop makes no round: {first} is greater than {last}",
                hint=f"write {last}..{first}",
            )
            return
        is_known = first is not None and last is not None and is_free
        if first is None or last is None or not is_free:
            # One round without a value shows the other mistakes of the body.
            first, last = 0, 0
        rounds = last - first + 1
        statements = rounds * len(statement.body)
        is_long = self._rounds + rounds > MAX_ROUNDS
        if is_long or self._loop_statements + statements > MAX_LOOP_STATEMENTS:
            limit = f"{MAX_ROUNDS:,} rounds" if is_long else f"{MAX_LOOP_STATEMENTS:,} statements"
            self._reporter.report(
                "loop-too-long",
                statement.first.span.to(statement.last.span),
                f"with this loop there are more than {limit} in loops",
                hint="describe fewer and larger regions",
            )
            if self._draft is not None:
                self._draft.has_gaps = True
            rounds, statements = 1, 0
        self._rounds += rounds
        self._loop_statements += statements
        for number in range(first, first + rounds):
            value = scalar(float(number)) if is_known else None
            self._round(statement.body, scope, statement.variable, value)

    def _round(
        self,
        body: Sequence[tree.Statement],
        scope: Scope,
        variable: tree.Identifier,
        value: Quantity | None,
    ) -> None:
        """Resolves the body of a loop with a value of its variable."""
        inner = scope.new_child({variable.text: Definition(value, variable.span)})
        self._loop_depth += 1
        self._statements(body, inner, "for")
        self._loop_depth -= 1

    # ------------------------------------------------------------------------------------- names

    def _let(self, statement: tree.Let, scope: Scope) -> None:
        """A constant."""
        value = self._evaluator.evaluate(statement.value, scope)
        if self._is_name_free(statement.name, scope):
            scope[statement.name.text] = Definition(value, statement.name.span)

    def _is_name_free(self, name: tree.Identifier, scope: Scope) -> bool:
        """Whether a constant or a loop's variable can have this name; if not, reports it."""
        text = name.text
        if text in CONSTANTS or text in FUNCTIONS or is_unit(text):
            what = (
                "a unit" if is_unit(text) else "a function" if text in FUNCTIONS else "a constant"
            )
            self._reporter.report(
                "reserved-name",
                name.span,
                f"`{text}` is {what} of the language and cannot be defined",
                hint=f"choose another name, for example `my_{text}`",
            )
            return False
        if text in scope:
            self._reporter.report(
                "duplicate-name",
                name.span,
                f"`{text}` is defined already",
                hint="choose another name",
                notes=(f"the first definition is at {scope[text].span.place}",),
            )
            return False
        return True
