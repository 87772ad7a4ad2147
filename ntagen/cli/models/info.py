"""`ntagen info`: shows what is in a model or an environment."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Final, TypeVar

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.guard import doing
from ntagen.cli.loading import load_model, pointing_to_explanations
from ntagen.cli.options import bounded, include_option, path_argument
from ntagen.cli.terminal import echo, print_table

if TYPE_CHECKING:
    from ntagen.checker import Model
    from ntagen.checker.facts import (
        Channel,
        Clock,
        Process,
        StoredPart,
        StoredState,
        Template,
        Variable,
    )

    _Part = TypeVar("_Part", bound=Process | Clock | Channel)

ROWS_SHOWN: Final = 40
"""A table shows at most this many rows; the JSON object has all."""


@click.command(
    "info",
    cls=Renamed,
    former={"--svg": "`ntagen plot MODEL --as templates` draws them"},
    epilog="Exit codes: 0 done, 2 the input is wrong, 3 stopped by a limit.",
)
@path_argument("path", metavar="MODEL")
@click.option("--json", "as_json", is_flag=True, help="Print everything as one JSON object.")
@click.option(
    "--state",
    "with_stored",
    is_flag=True,
    help="Also show what a search stores of a state: the bits of each part, and what is left out.",
)
@include_option()
@bounded
def command(path: Path, as_json: bool, with_stored: bool, include: tuple[Path, ...]) -> None:
    """Show what is in a model: templates, processes, variables, clocks, channels, features.

    MODEL is an environment (.nsl) or a UPPAAL model (.xml, .xta).

    \b
    Examples:
      ntagen info model.xml
      ntagen info model.xml --json | jq .features
      ntagen info model.xml --state

    For an environment, it also shows each region (its volume, its bounds, and its distance from
    the straight way between the tip and the middle of the last target; negative if it is in the
    way), how far rounding may move the model's path, and all settings of `ntagen drive` and where
    each comes from.

    \b
    The JSON object has "format": "ntagen-model", "version": 1, and
      templates  as written: name, parameters, locations (id, name, kind, initial, invariant,
                 rate), branch_points (id), edges (source, target, controllable, select, guard,
                 sync, update, weight); with position, nails, color and labels (where each is)
      processes  name, template, priority, and the numbers of their locations and edges
      variables  name, process (null if global), type, dimensions, meta, words
      clocks     name, process, hybrid
      channels   name, broadcast, urgent, priority
      features   names of what the model uses beyond plain timed automata
      scalar_sets  size, whether symmetry reduction applies (reduced), else why not (obstacle) and
                 where (place, at)
      state      words (of 32 bits) of the discrete state: location_, variable_ and meta_words;
                 with --state also stored_bits, the padding_bits to whole words, constant_words
                 (not stored, since nothing writes them), reset_words (they have their initial value
                 wherever nothing may still read them, unless the query does), all null if only
                 random runs have a meaning; and parts: kind (location, variable, or left out: those
                 that only random runs know), name, process, meta, words, stored_bits,
                 constant_words, reset_words, and live_locations (of all processes: where any of
                 the latter may still be read)
      queries    text, comment, expect (the verdict that the file states, or null)
      warnings, load_seconds
      settings   of an environment: by their words, field, value, shown and origin
      regions    of an environment: name, kind, shape, volume_mm3, low_mm and high_mm (bounds),
                 from_straight_way_mm; null is infinite
      resolution_per_mm, resolution_origin ("file" or "chosen"), path_error_mm (a bound of the
                 distance between the model's path and the exact one; null if none is known),
                 depth_mm (down to which it holds), circle_error_mm (the bound on a single circle,
                 down to the targets), least_margin_mm: of an environment
    """  # noqa: D301  click wants the control character
    with pointing_to_explanations(not as_json), doing("loading the model"):
        loaded = load_model(path, include)
    model, task = loaded.model, loaded.task
    if as_json:
        with doing("describing the model"):
            text = model.facts_json(with_stored=with_stored)
        if task is not None:
            from ntagen.cli.needle.task_facts import task_facts

            text = json.dumps(json.loads(text) | task_facts(task))
        echo(text)
        return
    _show(path, model)
    if with_stored:
        with doing("finding out what is stored"):
            stored = model.stored_state()
        _show_stored(model, stored)
    if task is not None:
        from ntagen.cli.needle.steering import show_settings
        from ntagen.cli.needle.task_facts import task_lines
        from ntagen.drive.configure import configure

        for line in task_lines(task, ROWS_SHOWN):
            echo(line)
        echo("settings of ntagen drive, and where they come from:")
        show_settings(configure(task.given, task.scene))


def _show(path: Path, model: Model) -> None:
    echo(
        f"{path}: {_count(len(model.processes), 'process', 'processes')} of "
        f"{_count(len(model.templates), 'template')}, "
        f"{_count(len(model.variables), 'variable')}, {_count(len(model.clocks), 'clock')}, "
        f"{_count(len(model.channels), 'channel')}; loaded in {1000 * model.load_seconds:.1f} ms"
    )
    words = [f"{model.state.location_words} for locations"]
    words.append(f"{model.state.variable_words} for variables")
    if model.state.meta_words:
        words.append(f"{model.state.meta_words} for meta variables")
    echo(
        f"state: {_count(model.state_words, 'word')} of 32 bits ({', '.join(words)}), "
        f"and a zone of {_count(len(model.clocks), 'clock')}"
    )
    features = ", ".join(feature.replace("-", " ") for feature in model.features)
    echo(f"features: {features or 'plain timed automata'}")
    for one in model.scalar_sets:
        if one.reduced:
            reduction = "symmetry reduction exchanges its members"
        else:
            where = "" if one.place is None else f", at {one.place}: {one.at}"
            reduction = f"no symmetry reduction: {one.obstacle}{where}"
        echo(f"scalar set of {_count(one.size, 'member')}: {reduction}")
    _show_table(_template_rows(model.templates), "template", "locations", "edges", "features")
    _show_table(_families(model.processes, _process_cells), "process", "template", "priority")
    _show_table(_variable_rows(model.variables), "variable", "type", "words")
    _show_table(_families(model.clocks, _clock_cells), "clock", "kind")
    _show_table(_families(model.channels, _channel_cells), "channel", "kind", "priority")
    _show_table(([query.text, query.comment] for query in model.queries), "query", "comment")


def _show_table(rows: Iterable[Sequence[str]], *headings: str) -> None:
    """Prints a table after a blank line; without rows it prints nothing."""
    shown = list(rows)
    if not shown:
        return
    # Columns that say nothing are left out.
    used = [
        i
        for i, heading in enumerate(headings)
        if any(row[i] and (heading, row[i]) != ("priority", "0") for row in shown)
    ]
    cells = [[row[i] for i in used] for row in shown[:ROWS_SHOWN]]
    if len(shown) > ROWS_SHOWN:
        cells.append([f"… {len(shown) - ROWS_SHOWN} more (all of them: --json)"])
    echo()
    numbers = ("locations", "edges", "words", "bits", "priority")
    print_table([headings[i] for i in used], cells, numbers)


def _template_rows(templates: Sequence[Template]) -> Iterable[list[str]]:
    for template in templates:
        kinds = [location.kind for location in template.locations]
        notes = [f"{kinds.count(kind)} {kind}" for kind in ("committed", "urgent") if kind in kinds]
        if template.branch_points:
            notes.append(_count(len(template.branch_points), "branch point"))
        uncontrollable = sum(not edge.controllable for edge in template.edges)
        if uncontrollable:
            notes.append(_count(uncontrollable, "uncontrollable edge"))
        heading = f"{template.name}({', '.join(template.parameters)})"
        numbers = [str(len(template.locations)), str(len(template.edges))]
        yield [heading if template.parameters else template.name, *numbers, ", ".join(notes)]


def _families(parts: Iterable[_Part], cells: Callable[[_Part], list[str]]) -> Iterable[list[str]]:
    """A row for neighbours that differ only in the indexes of their names."""

    def kind(part: _Part) -> tuple[str, list[str]]:
        return _family(part.name), cells(part)

    for (_, found), group in groupby(parts, kind):
        yield [_joined([one.name for one in group]), *found]


def _process_cells(process: Process) -> list[str]:
    return [process.template, str(process.priority)]


def _clock_cells(clock: Clock) -> list[str]:
    return ["hybrid: left out" if clock.hybrid else ""]


def _channel_cells(channel: Channel) -> list[str]:
    words = ["urgent"] * channel.urgent + ["broadcast" if channel.broadcast else "binary"]
    return [" ".join(words), str(channel.priority)]


def _variable_rows(variables: Sequence[Variable]) -> Iterable[list[str]]:
    for (_, text), group in groupby(variables, lambda one: (_family(one.name), _type(one))):
        members = list(group)
        names = _joined([variable.name for variable in members])
        yield [names, text, str(sum(variable.words for variable in members))]


def _show_stored(model: Model, stored: StoredState) -> None:
    """Shows what a search stores of a state, the largest parts first."""
    if stored.stored_bits is None:
        echo("\nstored state: none, because only random runs of this model have a meaning")
        return
    _show_table(_stored_rows(model, stored.parts), "stored", "type", "words", "bits", "remark")
    size = f"a stored state takes at most {stored.stored_bits} of {32 * stored.words} bits"
    if stored.padding_bits:
        size = f"{size}, and {stored.padding_bits} of padding"
    sentence = [size]
    if stored.constant_words:
        some = f"{stored.constant_words} of {_count(stored.words, 'word')}"
        sentence.append(f"nothing writes {some}, which {_are(stored.constant_words)} not stored")
    if stored.reset_words:
        some = f"{_count(stored.reset_words, 'word')} {_are(stored.reset_words)} reset"
        sentence.append(
            f"{some} where not read, unless the query reads {_them(stored.reset_words)}"
        )
    echo(f"\n{'; '.join(sentence)}")


def _stored_rows(model: Model, parts: Sequence[StoredPart]) -> Iterable[list[str]]:
    """A row for neighbours that differ only in the indexes of their names; most bits first."""
    locations = sum(process.location_count for process in model.processes)
    types = ["location"] * len(model.processes) + [_type(one) for one in model.variables]
    types += [""] * (len(parts) - len(types))
    found = []

    def kind(pair: tuple[StoredPart, str]) -> tuple[str, str, str]:
        part, text = pair
        return _family(part.name), text, _remark(part, locations)

    for (_, text, remark), group in groupby(zip(parts, types, strict=True), kind):
        members = [part for part, _ in group]
        words = sum(part.words for part in members)
        bits = sum(part.stored_bits for part in members)
        names = _joined([part.name or "variables that only random runs know" for part in members])
        found.append((bits, words, [names, text, str(words), str(bits), remark]))
    found.sort(key=lambda row: row[:2], reverse=True)
    return [cells for _, _, cells in found]


def _remark(part: StoredPart, locations: int) -> str:
    """What is not stored or compared of a part of a state, and why."""
    remarks = ["meta: not compared"] * part.meta
    constant, reset = part.constant_words, part.reset_words
    if constant:
        remarks.append(f"{_some(constant, part)}not stored: nothing writes {_them(constant)}")
    if reset and part.live_locations:
        where = f"live in {part.live_locations} of {_count(locations, 'location')}"
        remarks.append(f"{_some(reset, part)}reset where not read ({where})")
    elif reset:
        remarks.append(f"{_some(reset, part)}always reset: nothing reads {_them(reset)}")
    return "; ".join(remarks)


def _some(words: int, part: StoredPart) -> str:
    """How many of its words it is about, if not about all."""
    return "" if words == part.words else f"{_count(words, 'word')} "


def _are(number: int) -> str:
    return "is" if number == 1 else "are"


def _them(number: int) -> str:
    return "it" if number == 1 else "them"


def _type(variable: Variable) -> str:
    sizes = "".join(f"[{size}]" for size in variable.dimensions)
    meta = "meta " if variable.meta else ""
    kind = variable.type.replace("int[-2147483648,2147483647]", "int32_t")
    return f"{meta}{kind}{' array ' if sizes else ''}{sizes}"


def _family(name: str) -> str:
    """The name without its indexes: the same for all members of a process set or an array."""
    return re.sub(r"\([^)]*\)|\[[^\]]*\]", "…", name)


def _joined(names: Sequence[str]) -> str:
    """The names of a family in one cell: ``go[0] … go[5]``."""
    return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]} ({len(names)})"


def _count(number: int, singular: str, plural: str | None = None) -> str:
    return f"{number} {singular if number == 1 else plural or singular + 's'}"
