"""The declarations of a model as an outline: templates have what they declare below them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from lsprotocol import types

from ntagen.checker.survey import Place, Survey, Symbol, SymbolKind
from ntagen.editor.texts import Text

_KINDS: Final[dict[SymbolKind, types.SymbolKind]] = {
    "constant": types.SymbolKind.Constant,
    "variable": types.SymbolKind.Variable,
    "clock": types.SymbolKind.Number,
    "channel": types.SymbolKind.Event,
    "type": types.SymbolKind.Struct,
    "field": types.SymbolKind.Field,
    "function": types.SymbolKind.Function,
    "parameter": types.SymbolKind.TypeParameter,
    "template": types.SymbolKind.Class,
    "process": types.SymbolKind.Module,
    "location": types.SymbolKind.EnumMember,
    "strategy": types.SymbolKind.Interface,
}


def outline(survey: Survey, file: int, text: Text) -> list[types.DocumentSymbol]:
    """The declarations and queries of a text, in their order."""
    numbers = list(survey.everywhere)
    for symbols in survey.scopes:
        if any(survey.symbols[one].kind in ("process", "strategy") for one in symbols):
            numbers += symbols
    shown = [(at, _symbol(survey, one, at, text)) for one, at in _in(survey, numbers, file)]
    for one in survey.queries:
        if one.at is not None and one.at.file == file:
            span = text.area(one.at.start, one.at.end)
            query = types.DocumentSymbol(one.text or "?", types.SymbolKind.Boolean, span, span)
            shown.append((one.at, query))
    return [one for _, one in sorted(shown, key=lambda pair: pair[0])]


def _in(survey: Survey, numbers: Iterable[int], file: int) -> list[tuple[Symbol, Place]]:
    """The symbols that a text declares, each once, with the places of their names."""
    symbols = [survey.symbols[one] for one in dict.fromkeys(numbers)]
    return [(one, one.at) for one in symbols if one.at is not None and one.at.file == file]


def _symbol(survey: Survey, one: Symbol, at: Place, text: Text) -> types.DocumentSymbol:
    below: list[types.DocumentSymbol] = []
    end = at.end
    if one.kind == "template" and one.members is not None:
        members = _in(survey, survey.groups[one.members], at.file)
        below = [_symbol(survey, member, its, text) for member, its in members]
        end = max([end, *_ends(survey, at)])
    return types.DocumentSymbol(
        one.name,
        _KINDS.get(one.kind, types.SymbolKind.Variable),
        text.area(at.start, end),
        text.area(at.start, at.end),
        detail=one.detail,
        children=below,
    )


def _ends(survey: Survey, template: Place) -> list[int]:
    """Where the areas end that begin with the name of a template."""
    return [
        area.at.end
        for area in survey.areas
        if area.at.file == template.file and area.at.start == template.start
    ]
