"""Which queries and tests notice that a model is wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from ntagen.checker import RejectedError, form_of
from ntagen.errors import InputError
from ntagen.mutation.operators import Mutant
from ntagen.suites import Case, Limits, replay

if TYPE_CHECKING:
    from ntagen.checker import Model as LoadedModel

Fate = Literal["killed", "survived", "invalid", "unknown"]
FATES: Final[tuple[Fate, ...]] = ("killed", "survived", "invalid", "unknown")

_DECIDED: Final = ("satisfied", "not satisfied")
_Result = tuple[str, object]
"""A verdict and a value."""


@dataclass(frozen=True, slots=True)
class Judged:
    """What became of a mutant.

    Attributes:
        mutant: The mutant.
        fate: ``killed``; ``survived``; ``invalid``: the engine does not accept it; ``unknown``: a
            limit came first, and nothing else killed it.
        queries: The queries that kill it: their answers differ from those of the model.
        tests: The names of the tests that kill it: it cannot do what they do.
        reason: The first thing that differs, or why it is invalid or unknown.
    """

    mutant: Mutant
    fate: Fate
    queries: tuple[str, ...] = ()
    tests: tuple[str, ...] = ()
    reason: str = ""


class Judge:
    """Judges mutants by the answers of the model, and by tests.

    Attributes:
        answers: The verdict and value of each query of the model that counts.
        left_out: Queries that do not count, each with the reason.
    """

    def __init__(
        self,
        model: LoadedModel,
        *,
        limits: Limits | None = None,
        constants: Mapping[str, str] | None = None,
        tests: Sequence[Case] = (),
    ) -> None:
        """Answers the queries of the model.

        Args:
            model: The model, with its constants set.
            limits: The limits of each query.
            constants: The values of these constants.
            tests: Tests of the model.

        Raises:
            InputError: Neither a query nor a test can kill anything, or a test is none of the
                model.
        """
        self._limits = limits or Limits()
        self._constants = constants or {}
        self._overflow = model.overflow
        self._tests = tests
        self.answers: dict[str, _Result] = {}
        self.left_out: dict[str, str] = {}
        for case in tests:
            if difference := replay(case, model):
                raise InputError(
                    f"{case.name} is no test of this model: {difference}\n"
                    "hint: make the suite of this model again, with `ntagen test`"
                )
        for query in [one.text for one in model.queries if one.text.strip()]:
            form = form_of(query)
            if form is None or form.is_statistical or form.is_learned or form.is_shield:
                self.left_out[query] = "only symbolic and control queries are compared"
                continue
            found = self._ask(model, query)
            if found[0] in _DECIDED:
                self.answers[query] = found
            else:
                self.left_out[query] = f"its verdict is {found[0]}"
        if not self.answers and not tests:
            raise InputError(
                "the model has no query with a verdict, so nothing can kill a mutant\n"
                "hint: add queries to the model, or give tests with --suite"
            )

    def judge(self, mutant: Mutant) -> Judged:
        """What becomes of a mutant."""
        try:
            model = mutant.model.load()
            if self._constants:
                model = model.with_constants(self._constants)
        except (RejectedError, InputError) as error:
            return Judged(mutant, "invalid", reason=str(error).partition("\n")[0])
        model.overflow = self._overflow
        found = {query: self._ask(model, query) for query in self.answers}
        undecided = [query for query, (verdict, _) in found.items() if verdict in _OPEN]
        queries = [
            query
            for query, result in found.items()
            if query not in undecided and result != self.answers[query]
        ]
        failed = {case.name: reason for case in self._tests if (reason := replay(case, model))}
        if queries or failed:
            reason = next(iter(failed.values()), "")
            if queries:
                reason = f"{queries[0]} is {_shown(found[queries[0]])}"
            return Judged(mutant, "killed", tuple(queries), tuple(failed), reason)
        if undecided:
            return Judged(mutant, "unknown", reason=f"no verdict on {undecided[0]}")
        return Judged(mutant, "survived")

    def _ask(self, model: LoadedModel, query: str) -> _Result:
        try:
            answer = model.check(
                query,
                trace=False,
                states=self._limits.states,
                timeout_s=self._limits.timeout_s,
                memory_bytes=self._limits.memory_bytes,
            )
        except RejectedError:
            return "refused", None
        return answer.verdict, repr(answer.value)


_OPEN: Final = ("unknown", "maybe")


def _shown(result: _Result) -> str:
    verdict, value = result
    return verdict if value in (None, "None") else f"{verdict}, {value}"
