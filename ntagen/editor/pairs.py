"""Which files belong together: a model, and the file of queries that has its name beside it."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import PurePath
from typing import Final, Literal

from ntagen.values import dataclass

Kind = Literal["environment", "model", "queries"]

MODELS: Final = (".xml", ".xta", ".ta")
"""The endings of models. Of several with one name, the first has the queries."""

_NTA: Final = re.compile(r"\A\ufeff?(?:\s|<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*>)*<nta\b", re.DOTALL)

_QUERIES: Final = ".q"


@dataclass(frozen=True, slots=True)
class Pair:
    """Files that belong together, by their paths; at least one of them is there."""

    model: str | None
    queries: str | None

    @property
    def paths(self) -> tuple[str, ...]:
        """Those that are there."""
        return tuple(one for one in (self.model, self.queries) if one is not None)


def kind_of(path: str) -> Kind | None:
    """What a file is, by its ending."""
    ending = PurePath(path).suffix.lower()
    if ending in MODELS:
        return "model"
    return {".nsl": "environment", _QUERIES: "queries"}.get(ending)  # type: ignore[return-value]


def says_it_is_a_model(text: str) -> bool:
    """Whether a text in XML is a model: its first element is ``<nta>``."""
    return _NTA.match(text) is not None


def pair_of(path: str, is_there: Callable[[str], bool]) -> Pair:
    """The pair that a model or a file of queries is part of.

    Args:
        path: The file; it is there.
        is_there: Whether there is a file.
    """
    stem = str(PurePath(path).with_suffix(""))
    queries = stem + _QUERIES
    models = [stem + ending for ending in MODELS]
    if kind_of(path) == "queries":
        return Pair(next((one for one in models if one == path or is_there(one)), None), path)
    first = next((one for one in models if one == path or is_there(one)), path)
    return Pair(path, queries if first == path and is_there(queries) else None)
