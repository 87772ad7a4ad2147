"""The operators that make mutants."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from ntagen import build
from ntagen.errors import InputError
from ntagen.mutation.conditions import (
    comparisons,
    negations,
    other_signs,
    parts,
    with_bound,
    with_sign,
    without_comments,
)

if TYPE_CHECKING:
    from ntagen.checker import Model as LoadedModel


@dataclass(frozen=True, slots=True)
class Mutant:
    """A model with one mistake.

    Attributes:
        name: Its name, such as ``target-3``.
        operator: The operator that made it.
        place: Where the mistake is: ``Lamp: Off -> On``.
        change: What it is: ``guard x < 5 becomes x < 6``.
        model: The model with the mistake.
    """

    name: str
    operator: str
    place: str
    change: str
    model: build.Model


@dataclass(frozen=True, slots=True)
class _Site:
    """A template in which mistakes are made, and the names that it knows."""

    template: build.Template
    clocks: tuple[str, ...]
    channels: tuple[tuple[str, bool], ...]
    """Global channels, and whether each is an array."""


_Change = Callable[[build.Template], None]
_Found = tuple[str, str, _Change]
"""Place, what is changed, and what does it in the template of the copy."""


def _place(template: build.Template, index: int) -> str:
    return f"{template.name}: {template.edges[index].shown_name}"


def _edge_text(name: str, index: int, text: str) -> _Change:
    return lambda template: setattr(template.edges[index], name, text)


def _becomes(what: str, old: str, new: str) -> str:
    return f"{what} {' '.join(old.split()) or 'none'} becomes {' '.join(new.split()) or 'none'}"


def _guard_bound(site: _Site) -> Iterator[_Found]:
    for index, edge in enumerate(site.template.edges):
        for one in comparisons(edge.guard):
            for change in (1, -1):
                new = with_bound(edge.guard, one, change, site.clocks)
                what = _becomes("guard", edge.guard, new)
                yield _place(site.template, index), what, _edge_text("guard", index, new)


def _guard_sign(site: _Site) -> Iterator[_Found]:
    for index, edge in enumerate(site.template.edges):
        for one in comparisons(edge.guard):
            for sign in other_signs(edge.guard[slice(*one.sign)]):
                new = with_sign(edge.guard, one, sign)
                what = _becomes("guard", edge.guard, new)
                yield _place(site.template, index), what, _edge_text("guard", index, new)


def _guard_negation(site: _Site) -> Iterator[_Found]:
    for index, edge in enumerate(site.template.edges):
        if not edge.guard.strip():
            continue
        guards = negations(edge.guard, site.clocks)

        def change(
            template: build.Template, index: int = index, guards: list[str] = guards
        ) -> None:
            edge = template.edges[index]
            edge.guard = guards[0]
            for number, guard in enumerate(guards[1:], start=1):
                another = copy.copy(edge)
                another.guard = guard
                template.edges.insert(index + number, another)

        what = _becomes("guard", edge.guard, " or ".join(guards))
        yield _place(site.template, index), what, change


def _invariant_bound(site: _Site) -> Iterator[_Found]:
    for index, location in enumerate(site.template.locations):
        for one in comparisons(location.invariant):
            for change in (1, -1):
                new = with_bound(location.invariant, one, change, site.clocks)
                what = _becomes("invariant", location.invariant, new)
                place = f"{site.template.name}.{location.shown_name}"

                def set_invariant(
                    template: build.Template, index: int = index, new: str = new
                ) -> None:
                    template.locations[index].invariant = new

                yield place, what, set_invariant


def _end_moved(end: str, index: int, number: int) -> _Change:
    return lambda template: setattr(template.edges[index], end, template.locations[number])


def _moved(end: str) -> Callable[[_Site], Iterator[_Found]]:
    """Gives an end of each edge to each other location."""

    def operator(site: _Site) -> Iterator[_Found]:
        for index, edge in enumerate(site.template.edges):
            now = getattr(edge, end)
            if not isinstance(now, build.Location):
                continue
            for number, other in enumerate(site.template.locations):
                if other is now:
                    continue

                def move(
                    template: build.Template, index: int = index, number: int = number
                ) -> None:
                    setattr(template.edges[index], end, template.locations[number])

                what = f"{end} {now.shown_name} becomes {other.shown_name}"
                yield _place(site.template, index), what, move

    return operator


def _action(site: _Site) -> Iterator[_Found]:
    for index, edge in enumerate(site.template.edges):
        known = re.fullmatch(r"\s*([A-Za-z_]\w*)(.*)([!?])\s*", edge.sync, re.DOTALL)
        if not known:
            continue
        kinds = [is_array for name, is_array in site.channels if name == known[1]]
        for name, is_array in site.channels:
            if name != known[1] and is_array in kinds:
                new = f"{name}{known[2]}{known[3]}"
                what = _becomes("sync", edge.sync, new)
                yield _place(site.template, index), what, _edge_text("sync", index, new)


def _reset(site: _Site) -> Iterator[_Found]:
    """Takes a reset of a clock away, or adds one where there is none."""
    for index, edge in enumerate(site.template.edges):
        if isinstance(edge.target, build.BranchPoint):
            continue
        updates = [one for one in parts(without_comments(edge.update), ",") if one.strip()]
        for clock in site.clocks:
            kept = [one for one in updates if not re.match(rf"\s*{clock}\b[^=]*:?=(?!=)", one)]
            if len(kept) == len(updates):
                kept = [f"{clock} = 0", *updates]
            new = ",".join(kept)
            what = _becomes("update", edge.update, new)
            yield _place(site.template, index), what, _edge_text("update", index, new)


def _sink(site: _Site) -> Iterator[_Found]:
    for index, edge in enumerate(site.template.edges):
        if not isinstance(edge.target, build.Location):
            continue

        def sink(template: build.Template, index: int = index) -> None:
            template.edges[index].target = template.location()

        yield _place(site.template, index), f"{edge.target.shown_name} becomes a sink", sink


def _edge_dropped(index: int) -> _Change:
    def drop(template: build.Template) -> None:
        del template.edges[index]

    return drop


def _drop(site: _Site) -> Iterator[_Found]:
    for index, edge in enumerate(site.template.edges):
        if isinstance(edge.source, build.Location) and isinstance(edge.target, build.Location):
            yield _place(site.template, index), "edge dropped", _edge_dropped(index)


_MAKERS: Final[dict[str, tuple[Callable[[_Site], Iterator[_Found]], str]]] = {
    "guard-bound": (_guard_bound, "adds or subtracts 1 at a bound of a guard"),
    "guard-sign": (_guard_sign, "replaces a comparison in a guard: < by <= and by >="),
    "guard-negation": (_guard_negation, "negates a guard"),
    "invariant-bound": (_invariant_bound, "adds or subtracts 1 at a bound of an invariant"),
    "target": (_moved("target"), "leads an edge to another location"),
    "source": (_moved("source"), "takes an edge from another location"),
    "action": (_action, "synchronises on another channel"),
    "reset": (_reset, "takes the reset of a clock away, or adds one"),
    "sink": (_sink, "leads an edge to a new location without a way out"),
    "drop-edge": (_drop, "takes an edge away"),
}

OPERATORS: Final[dict[str, str]] = {name: about for name, (_, about) in _MAKERS.items()}
"""What each operator does, by name. ``guard-bound`` and ``drop-edge`` are not in the paper."""


def mutants(
    written: build.Model,
    loaded: LoadedModel,
    operators: Sequence[str] = (),
    templates: Sequence[str] = (),
    most: int | None = None,
) -> Iterator[Mutant]:
    """The mutants of a model, one after the other.

    Args:
        written: The model as values.
        loaded: The same model in the engine, which knows its clocks and channels.
        operators: The names of operators; none are all.
        templates: In which templates mistakes are made; none are all.
        most: At most so many mutants of each operator, evenly spread over all that it makes.

    Raises:
        InputError: There is no such operator or template.
    """
    _require(operators, OPERATORS, "operator")
    known = [one.name for one in written.templates]
    _require(templates, known, "template")
    sites = [
        (number, _site(one, loaded))
        for number, one in enumerate(written.templates)
        if not templates or one.name in templates
    ]
    for operator in [name for name in OPERATORS if not operators or name in operators]:
        found = [(number, one) for number, site in sites for one in _MAKERS[operator][0](site)]
        for index in _spread(len(found), most):
            number, (place, change, make) = found[index]
            model = copy.deepcopy(written)
            make(model.templates[number])
            yield Mutant(f"{operator}-{index}", operator, place, change, model)


def _require(names: Sequence[str], known: Sequence[str] | dict[str, str], what: str) -> None:
    for name in names:
        if name not in known:
            raise InputError(f"there is no {what} {name}\nhint: there are {', '.join(known)}")


def _spread(count: int, most: int | None) -> list[int]:
    if most is None or most >= count:
        return list(range(count))
    return [index * count // most for index in range(most)]


def _site(template: build.Template, loaded: LoadedModel) -> _Site:
    """The clocks that a template uses: its own, and the global ones that it names."""
    texts = [one.invariant for one in template.locations]
    texts += [text for edge in template.edges for text in (edge.guard, edge.update)]
    used = set(re.findall(r"[A-Za-z_]\w*", " ".join(texts)))
    processes = [one.name for one in loaded.processes if one.template == template.name]
    clocks: dict[str, None] = {}
    for clock in loaded.clocks:
        owner = clock.process
        name = clock.name.removeprefix(f"{owner}.").partition("[")[0]
        if (owner is None or owner in processes) and name in used:
            clocks[name] = None
    channels = {
        (one.name.partition("[")[0], "[" in one.name): None
        for one in loaded.channels
        if "." not in one.name
    }
    return _Site(template, tuple(clocks), tuple(channels))
