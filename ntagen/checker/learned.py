"""Learned strategies: what ``minE``, ``maxE``, ``minPr`` and ``maxPr`` find."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, Literal

import ntagen._checker as _checker
from ntagen.checker.errors import rejecting
from ntagen.errors import InputError
from ntagen.files import write_files

if TYPE_CHECKING:
    from ntagen.checker.learned_trees import Trees
    from ntagen.checker.picture.page import Svg

__all__ = ["LearnedStrategy"]

Language = Literal["c", "python"]

MOST_LEAVES: Final = 60
"""If no number is given, the picture of trees has at most this number of leaves."""

_LANGUAGES: Final[dict[str, Language]] = {".c": "c", ".py": "python"}
"""The languages by the ends of names of files."""


class LearnedStrategy:
    """A learned strategy: what each action is worth, by what is seen of a state.

    Attributes:
        query: The query that it answers, or that has loaded it.
        maximises: Whether the greatest value is the best.
        discrete: What it sees exactly, as expressions of the model.
        continuous: What it sees in intervals.
        actions: The moves of the controller, by their numbers; the last action is ``WAIT``.
        leaves: How many leaves its trees have.
    """

    def __init__(self, raw: _checker.LearnedStrategy) -> None:
        self._raw = raw
        self.query = raw.query
        self.maximises = raw.is_greatest
        discrete, continuous = raw.features()
        self.discrete = tuple(discrete)
        self.continuous = tuple(continuous)
        self.actions = tuple(raw.actions())
        self.leaves = raw.leaves

    def __repr__(self) -> str:
        return f"<LearnedStrategy with {self.leaves} leaves: {self.query}>"

    def decide(
        self, discrete: Sequence[float], continuous: Sequence[float], enabled: Sequence[bool]
    ) -> int | None:
        """The number of the best action: of those with the same value the first.

        Args:
            discrete: The values of `discrete`. A location is its number in its process.
            continuous: The values of `continuous`.
            enabled: For each of `actions` whether it is possible now.

        Returns:
            The number; ``None`` if learning has not seen these discrete values, or has tried none
            of the enabled actions.

        Raises:
            ValueError: There are too many or too few values.
        """
        return self._raw.decide(list(discrete), list(continuous), list(enabled))

    def decisions(
        self,
        x: str | None = None,
        y: str | None = None,
        *,
        at: Mapping[str, float | str] | None = None,
    ) -> Svg:
        """What it decides as a picture: a map over two features, or the worth of moves over one.

        Each combination of the exact values that are not drawn and have no value is a panel.

        Args:
            x: The feature to the right. By default both axes are the first ones on which decisions
                depend; with `x` alone the picture has no second one.
            y: The feature upwards.
            at: Values of other features: ``{"Gate": "Open", "n": 2}``, the location of a process by
                its name.

        Raises:
            InputError: There is no such feature, learning has not seen these values, there are too
                many states, or decisions depend on a feature that is not drawn and has no value.
        """
        # Imported here: few commands draw.
        from ntagen.checker.learned_map import decisions_chart

        axes = [one for one in (x, y) if one is not None]
        return decisions_chart(self._trees(), self.query, axes, at or {})

    def tree(self, *, at: Mapping[str, float | str] | None = None, limit: int = MOST_LEAVES) -> Svg:
        """What it decides as a picture: in each state a tree of questions with the best move.

        Parts that decide the same are one leaf.

        Args:
            at: Values of features, as for `decisions`.
            limit: How many leaves the picture may have.

        Raises:
            InputError: There is no such feature, learning has not seen these values, or there are
                more leaves.
        """
        from ntagen.checker.learned_map import tree_chart

        return tree_chart(self._trees(), self.query, at or {}, limit)

    def _trees(self) -> Trees:
        from ntagen.checker.learned_trees import Trees

        return Trees(self.json(), maximises=self.maximises)

    def json(self) -> str:
        """The strategy as JSON text, in the form that ``saveStrategy`` writes.

        Raises:
            RejectedError: Its trees are too deep for a file.
        """
        with rejecting():
            return self._raw.json()

    def code(self, language: Language, name: str = "strategy") -> str:
        """The strategy as a function that depends on nothing; the file says how to call it.

        Args:
            language: The language: C99, or Python.
            name: What the names in C begin with.

        Raises:
            InputError: This is no name in C.
        """
        if not (name.isascii() and name.isidentifier()):
            raise InputError(f"{name!r} is no name in C: use letters, digits and underscores")
        return self._raw.code(language, name)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the strategy to a file: as JSON, or as code to a file ``.c`` or ``.py``.

        The query ``strategy S = loadStrategy("FILE.json")`` reads it again. The file is written
        completely or not at all; a missing folder is made.

        Raises:
            InputError: The file cannot be written.
        """
        place = Path(path)
        write_files({place: self.file_text(place.suffix)})

    def file_text(self, suffix: str, name: str = "strategy") -> str:
        """What is written to a file whose name ends so.

        Args:
            suffix: ``.c`` or ``.py`` for code; every other file has JSON.
            name: What the names in C begin with.
        """
        language = _LANGUAGES.get(suffix)
        return f"{self.json()}\n" if language is None else self.code(language, name)

    def keep(self, name: str) -> None:
        """Makes the strategy available to later queries of the model: ``Pr[<=9](<> p) under S``.

        Args:
            name: The name of the strategy in such queries.
        """
        self._raw.keep(name)
