"""Renames a name of a model, where that changes nothing else.

The new texts are looked at, too: each name in them must stand for the same as before.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Awaitable, Callable, Sequence

from ntagen.checker.names import Names
from ntagen.checker.survey import Place, Survey, Texts
from ntagen.values import dataclass
from ntagen.xta import is_name


class RenamingError(Exception):
    """A name cannot be changed so; the message says why, and what to do."""


@dataclass(frozen=True, slots=True)
class Renaming:
    """A name that can be changed.

    Attributes:
        names: The names of the texts.
        texts: The texts.
        symbol: The number of the symbol.
        places: Where its name stands.
    """

    names: Names
    texts: Texts
    symbol: int
    places: tuple[Place, ...]

    @property
    def name(self) -> str:
        """The name as it is."""
        return self.names.survey.symbols[self.symbol].name


def renaming_at(names: Names, texts: Texts, file: int, offset: int) -> Renaming:
    """The name at a place, which can be changed.

    Raises:
        RenamingError: There is none, or not all of its places are known.
    """
    found = names.number_at(file, offset)
    if found is None:
        raise RenamingError("no name stands here")
    number, _ = found
    symbol = names.survey.symbols[number]
    if symbol.at is None:
        raise RenamingError(f"the language declares {symbol.name}, so it has no other name")
    for one in names.survey.mistakes:
        if one.is_of_form:
            raise RenamingError(
                f"there are mistakes of form, behind which names may be missed: {one.message}"
            )
    places = names.places(number, with_declaration=True)
    return Renaming(names, texts, number, tuple(places))


async def renamed(
    renaming: Renaming, name: str, look: Callable[[Texts], Awaitable[Survey]]
) -> Texts:
    """The texts with another name.

    Args:
        renaming: What is renamed.
        name: The new name.
        look: Surveys the new texts.

    Raises:
        RenamingError: The new name is none, or something would mean something else.
    """
    if not is_name(name):
        raise RenamingError(
            f"{name or 'an empty text'} is no name: a name has letters, digits and _, does not"
            " begin with a digit, and is no word of the language"
        )
    texts = renaming.texts
    after = Texts(
        texts.path,
        _replaced(texts.model, 0, renaming.places, name),
        texts.queries_path,
        _replaced(texts.queries, 1, renaming.places, name),
    )
    _require_same(renaming, name, await look(after), after)
    return after


def _replaced(text: str, file: int, places: Sequence[Place], name: str) -> str:
    parts, last = [], 0
    for place in places:
        if place.file == file:
            parts += [text[last : place.start], name]
            last = place.end
    return "".join([*parts, text[last:]])


def _require_same(renaming: Renaming, name: str, after: Survey, texts: Texts) -> None:
    """Refuses texts in which a name stands for something else than before.

    Raises:
        RenamingError: One does.
    """
    before = renaming.names.survey
    moved = _Moved(renaming.places, len(name) - len(renaming.name))
    expected = {(moved(one.at), one.symbol) for one in before.uses}
    found = {(one.at, one.symbol) for one in after.uses}
    wrong = sorted(expected ^ found)
    if wrong:
        place = wrong[0][0]
        line = texts.of(place.file).count("\n", 0, place.start) + 1
        where = f"line {line} of {texts.path if place.file == 0 else texts.queries_path}"
        other = next((one for one in wrong if one[0] == place and one in found), None)
        if other is None or len(after.symbols) != len(before.symbols):
            raise RenamingError(f"{name} already means something else: see {where}")
        symbol = after.symbols[other[1]]
        raise RenamingError(f"{name} would mean `{symbol.detail}` on {where}")
    known = sorted(one.code for one in before.mistakes if one.severity == "error")
    errors = [one for one in after.mistakes if one.severity == "error"]
    if sorted(one.code for one in errors) != known:
        fresh = next((one for one in errors if one.code not in known), errors[-1:] and errors[-1])
        reason = fresh.message if fresh else "a mistake would go away"
        raise RenamingError(f"{name} cannot be the name here: {reason}")


class _Moved:
    """Where places are after a renaming."""

    def __init__(self, places: Sequence[Place], longer: int) -> None:
        self._starts = [[one.start for one in places if one.file == file] for file in (0, 1)]
        self._longer = longer

    def __call__(self, place: Place) -> Place:
        starts = self._starts[place.file]
        start = place.start + self._longer * bisect_left(starts, place.start)
        end = place.end + self._longer * bisect_left(starts, place.end)
        return Place(place.file, start, end)
