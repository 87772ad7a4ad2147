"""A plugin for pytest: models are test files, and each of their queries is a test.

pytest finds the plugin by its entry point. It collects a model that is named on the command line
(``pytest models/gate.xml``), and models that the option ``ntagen_models`` of the project names by
patterns; no other file. A test passes if the answer is as the file expects: see
`ntagen.checker.queries`. A failure shows what was expected, and the end of the trace.

A file of queries beside the model, ``gate.q`` for ``gate.xml``, is taken instead of the model's own
queries, as in ``ntagen check gate.xml gate.q``.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model
    from ntagen.checker.queries import Query

_SUFFIXES: Final = (".xml", ".xta", ".ta", ".nsl")

STEPS_SHOWN: Final = 12
"""A failure shows at most so many steps of the trace, the last ones."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the options of the project."""
    parser.addini(
        "ntagen_models",
        "patterns of models whose queries are tests, such as models/**/*.xml, from the root folder",
        type="args",
        default=[],
    )
    parser.addini(
        "ntagen_timeout_s",
        "a query fails if it takes more seconds; no limit by default",
        default="",
    )


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> ModelFile | None:
    """The tests of a file, if it is a model that is asked for."""
    if file_path.suffix.lower() not in _SUFFIXES or not _is_wanted(file_path, parent.config):
        return None
    file: ModelFile = ModelFile.from_parent(parent, path=file_path)
    return file


def _is_wanted(path: Path, config: pytest.Config) -> bool:
    """Whether a file is named on the command line, or by a pattern of the project."""
    folder = config.invocation_params.dir
    named = (Path(os.path.abspath(folder / word.partition("::")[0])) for word in config.args)
    if path in named:
        return True
    patterns = config.getini("ntagen_models")
    return any(path in config.rootpath.glob(pattern) for pattern in patterns)


def _timeout_s(config: pytest.Config) -> float | None:
    """The limit of a query in seconds; ``None`` without one."""
    text = config.getini("ntagen_timeout_s")
    try:
        return float(text) if text else None
    except ValueError:
        raise pytest.UsageError(
            f"ntagen_timeout_s is {text!r}; write a number of seconds, such as 60"
        ) from None


class ModelFile(pytest.File):
    """A model with its queries."""

    model: Model
    _defined: set[str]

    def collect(self) -> Iterator[QueryItem]:
        """A test for each query.

        Raises:
            CollectError: The model, or the file of queries beside it, is rejected.
        """
        from ntagen.errors import InputError
        from ntagen.loading import load_file

        self._defined = set()
        beside = self.path.with_suffix(".q")
        try:
            self.model = load_file(self.path).model
            queries = self.model.read_queries(beside) if beside.exists() else self.model.queries
        except (InputError, OSError) as error:
            raise self.CollectError(str(error)) from None
        self.queries = queries
        seen: Counter[str] = Counter()
        for query in queries:
            seen[query.text] += 1
            name = query.text if seen[query.text] == 1 else f"{query.text} #{seen[query.text]}"
            item: QueryItem = QueryItem.from_parent(self, name=name, query=query)
            yield item

    def answer(self, query: Query, *, is_refusal_all: bool = False) -> Answer:
        """The answer to a query, after those that define the strategies that it is about.

        Args:
            query: The query.
            is_refusal_all: Whether it only matters if the query is refused; there is no search.
        """
        from ntagen.checker import Options, form_of

        form = form_of(query.text)
        options = Options(
            folder=self.path.parent,
            strategy=form is not None and form.defines is not None,
            states=1 if is_refusal_all else None,
            timeout_s=_timeout_s(self.config),
        )
        if form is not None and form.uses is not None and form.uses not in self._defined:
            for other in self.queries:
                its = form_of(other.text)
                if its is not None and its.defines == form.uses:
                    self.answer(other)
                    break
        answer = self.model.answer(query.text, options)
        if form is not None and form.defines is not None and not is_refusal_all:
            self._defined.add(form.defines)
        return answer


class WrongAnswerError(Exception):
    """An answer is not as expected; the message is all that the user needs."""


class QueryItem(pytest.Item):
    """A query of a model: it passes if the answer is as expected."""

    parent: ModelFile

    def __init__(self, *, query: Query, **rest: object) -> None:
        super().__init__(**rest)  # type: ignore[arg-type]  # what `from_parent` gives
        self._query = query

    def runtest(self) -> None:
        """Asks the query.

        Raises:
            WrongAnswerError: The answer is not as expected, or a limit came first.
        """
        from ntagen.checker import RejectedError, expected_of, is_as_expected, remark_of

        expected = expected_of(self._query)
        try:
            answer = self.parent.answer(self._query, is_refusal_all=expected is None)
        except RejectedError as error:
            if expected is None or not is_as_expected(expected, "refused"):
                raise WrongAnswerError(f"the query is refused\n{error}") from None
            return
        if expected is None:
            pytest.skip("the file does not say what is expected")
        if is_as_expected(expected, answer.verdict, answer.value):
            return
        said = answer.verdict if answer.value is None else f"{answer.verdict}, {answer.value}"
        if answer.stop is not None:
            said = f"unknown, because of the {answer.limit_text}"
        lines = [f"{self._query.text} is {said}; expected: {expected}", *remark_of(self._query)]
        lines += [answer.message] if answer.message else []
        raise WrongAnswerError("\n".join([*lines, *answer.trace_lines(STEPS_SHOWN)]))

    def repr_failure(
        self,
        excinfo: pytest.ExceptionInfo[BaseException],
        style: object = None,
    ) -> str:
        """The message of a wrong answer, without the program's own stack."""
        if isinstance(excinfo.value, WrongAnswerError):
            return str(excinfo.value)
        return str(super().repr_failure(excinfo))

    def reportinfo(self) -> tuple[Path, int | None, str]:
        """Where the query stands."""
        line = self._query.line - 1 if self._query.line else None
        # pytest rewrites dots in a name that is the end of the test's address.
        return Path(self._query.path or self.path), line, f"query {self.name}"
