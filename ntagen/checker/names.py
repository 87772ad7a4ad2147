"""What the names of a model stand for at a place, from a survey of it.

Places count as those of the survey do. All is told from it, and the texts are not looked at.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Sequence

from ntagen.checker.survey import MODEL, Area, Place, Survey, Symbol


class Names:
    """The names of a survey, by their places.

    Attributes:
        survey: The survey.
    """

    def __init__(self, survey: Survey) -> None:
        self.survey = survey
        declared = [(one.at, number) for number, one in enumerate(survey.symbols) if one.at]
        self._named = sorted([*declared, *((one.at, one.symbol) for one in survey.uses)])

    @property
    def has_own(self) -> bool:
        """Whether the texts declare or use any name."""
        return bool(self._named)

    def at(self, file: int, offset: int) -> tuple[Symbol, Place] | None:
        """The symbol whose name stands at a place, or ends there, and the name's place."""
        found = self.number_at(file, offset)
        return None if found is None else (self.survey.symbols[found[0]], found[1])

    def number_at(self, file: int, offset: int) -> tuple[int, Place] | None:
        """The same with the number of the symbol."""
        index = bisect_right(self._named, Place(file, offset, 1 << 62), key=lambda one: one[0])
        # A name that begins at the place comes before one that ends there.
        for place, symbol in reversed(self._named[max(0, index - 2) : index]):
            if place.file == file and place.start <= offset <= place.end:
                return symbol, place
        return None

    def places(self, symbol: int, *, with_declaration: bool) -> list[Place]:
        """Where the name of a symbol stands, in the order of the texts."""
        declared = self.survey.symbols[symbol].at
        return [
            place
            for place, number in self._named
            if number == symbol and (with_declaration or place != declared)
        ]

    def is_read(self, file: int, offset: int) -> bool:
        """Whether a place is in a part of a text in which names of its own may be used."""
        return any(self._around(file, offset))

    def usable(self, file: int, offset: int) -> dict[str, Symbol]:
        """The symbols that may be used at a place by their names, the innermost ones last."""
        survey = self.survey
        numbers = list(survey.everywhere)
        for area in self._around(file, offset):
            numbers += survey.scopes[area.scope]
        if self._is_asked(file, offset):
            numbers += self._processes()
        found: dict[str, Symbol] = {}
        for number in numbers:
            symbol = survey.symbols[number]
            # Of two with one name the inner one counts, and stands where it belongs.
            found.pop(symbol.name, None)
            found[symbol.name] = symbol
        return found

    def members(self, file: int, offset: int, chain: Sequence[str]) -> list[Symbol]:
        """What may follow a dot behind names, such as ``P.`` or ``r.inner.``, at a place."""
        symbol = self.usable(file, offset).get(chain[0])
        for name in chain[1:]:
            symbol = next((one for one in self._group(symbol) if one.name == name), None)
        return list(self._group(symbol))

    def _around(self, file: int, offset: int) -> Iterator[Area]:
        for area in self.survey.areas:
            if area.at.file == file and area.at.start <= offset <= area.at.end:
                yield area

    def _group(self, symbol: Symbol | None) -> Iterator[Symbol]:
        if symbol is not None and symbol.members is not None:
            for number in self.survey.groups[symbol.members]:
                yield self.survey.symbols[number]

    def _is_asked(self, file: int, offset: int) -> bool:
        """Whether a place is where queries are: one that is being typed is in no area yet."""
        return file != MODEL or any(
            one.at is not None and one.at.file == file and one.at.start <= offset <= one.at.end
            for one in self.survey.queries
        )

    def _processes(self) -> Iterator[int]:
        """What the system declares, which all queries may use."""
        for symbols in self.survey.scopes:
            if any(self.survey.symbols[one].kind == "process" for one in symbols):
                yield from symbols
