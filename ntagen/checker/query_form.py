"""What a query asks for, by its text alone, without a model."""

from __future__ import annotations

from typing import Final

from ntagen import _checker
from ntagen.values import dataclass

_GAMES: Final = ("control", "control_t*", "E<> control")


@dataclass(frozen=True, slots=True)
class QueryForm:
    """What a query asks for.

    Attributes:
        kind: How its kind is written: ``E<>``, ``A[]``, ``E[]``, ``A<>``, ``-->``, ``sup``,
            ``inf``, ``bounds``, ``control``, ``control_t*``, ``E<> control``, ``saveStrategy``,
            ``loadStrategy``, ``Pr``, ``E``, ``simulate`` (statistical queries), or ``unsupported``.
        defines: The name of the strategy that it defines, or ``None``.
        uses: The name of the strategy that it is asked under, or that it saves, or ``None``.
        is_observed: Whether it is a game in which the controller sees observations only.
    """

    kind: str
    defines: str | None
    uses: str | None
    is_observed: bool

    @property
    def is_statistical(self) -> bool:
        """Whether random runs answer it."""
        return self.kind in ("Pr", "E", "simulate")

    @property
    def is_game(self) -> bool:
        """Whether it asks who wins a game."""
        return self.kind in _GAMES


def form_of(query: str) -> QueryForm | None:
    """The form of a query; ``None`` if the text is no query."""
    form = _checker.form_of_query(query)
    return None if form is None else QueryForm(*form)
