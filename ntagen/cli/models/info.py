"""`ntagen info`: shows what is in a model or an environment."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.guard import doing
from ntagen.cli.limits import bounded
from ntagen.cli.loading import include_option, load_model, pointing_to_explanations
from ntagen.cli.terminal import echo, safe, table_console

if TYPE_CHECKING:
    from rich.table import Table

    from ntagen.checker import Model
    from ntagen.checker.facts import Channel, Clock, Process, Template, Variable
    from ntagen.drive.configure import Configuration
    from ntagen.nsl import Task

ROWS_SHOWN: Final = 40
"""A table shows at most this many rows; the JSON object has all."""


@click.command(
    "info",
    cls=Renamed,
    former={"--svg": "`ntagen plot MODEL --as templates` draws them"},
    epilog="Exit codes: 0 done, 2 the input is wrong, 3 stopped by a limit.",
)
@click.argument("path", metavar="MODEL", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print everything as one JSON object.")
@include_option()
@bounded
def command(path: Path, as_json: bool, include: tuple[Path, ...]) -> None:
    """Show what is in a model: templates, processes, variables, clocks, channels, features.

    MODEL is an environment (.nsl) or a UPPAAL model (.xml, .xta).

    \b
    Examples:
      ntagen info model.xml
      ntagen info model.xml --json | jq .features

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
      state      words (of 32 bits) of the discrete state: location_, variable_ and meta_words
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
    model, configuration = loaded.model, None
    if loaded.task is not None:
        from ntagen.drive.configure import configure

        configuration = configure(loaded.task.given, loaded.task.scene)
    if as_json:
        with doing("describing the model"):
            text = model.facts_json()
        if loaded.task is not None and configuration is not None:
            from ntagen.cli.needle.precision import precision_facts
            from ntagen.cli.needle.region_rows import region_facts

            more = {
                **precision_facts(loaded.task.scene),
                "spins": list(loaded.task.scene.limits.spins),
                "settings": _settings(configuration),
                "regions": region_facts(loaded.task.scene),
            }
            text = json.dumps(json.loads(text) | more)
        echo(text)
        return
    _show(path, model)
    if loaded.task is not None and configuration is not None:
        _show_task(loaded.task, configuration)


def _settings(configuration: Configuration) -> dict[str, dict[str, object]]:
    """The settings for JSON, by their words: value in the unit of the log, and origin."""
    from ntagen.parameters import PARAMETERS

    return {
        parameter.words: {
            "field": parameter.field,
            "value": configuration.value(parameter),
            "shown": parameter.shown(configuration.value(parameter)),
            "origin": configuration.origin(parameter),
        }
        for parameter in PARAMETERS
    }


def _show_task(task: Task, configuration: Configuration) -> None:
    """Prints regions, devices and settings of an environment."""
    from ntagen.cli.needle.precision import precision_line, spins_line
    from ntagen.cli.needle.region_rows import region_rows
    from ntagen.cli.needle.steering import show_settings

    kinds = [region.kind for region in task.scene.regions]
    counts = [f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds)]
    echo(f"\nregions: {', '.join(counts)}")
    for row in region_rows(task.scene, ROWS_SHOWN):
        echo(f"  {row}")
    echo(precision_line(task.scene))
    if (spins := spins_line(task.scene)) is not None:
        echo(spins)
    for device in (task.device, task.tracker):
        if device is not None:
            echo(str(device))
    echo("settings of ntagen drive, and where they come from:")
    show_settings(configuration)


def _show(path: Path, model: Model) -> None:
    console = table_console()

    def say(line: str) -> None:
        console.print(safe(line), soft_wrap=True)

    say(
        f"{path}: {_count(len(model.processes), 'process', 'processes')} of "
        f"{_count(len(model.templates), 'template')}, "
        f"{_count(len(model.variables), 'variable')}, {_count(len(model.clocks), 'clock')}, "
        f"{_count(len(model.channels), 'channel')}; loaded in {1000 * model.load_seconds:.1f} ms"
    )
    words = [f"{model.state.location_words} for locations"]
    words.append(f"{model.state.variable_words} for variables")
    if model.state.meta_words:
        words.append(f"{model.state.meta_words} for meta variables")
    say(
        f"state: {_count(model.state_words, 'word')} of 32 bits ({', '.join(words)}), "
        f"and a zone of {_count(len(model.clocks), 'clock')}"
    )
    features = ", ".join(feature.replace("-", " ") for feature in model.features)
    say(f"features: {features or 'plain timed automata'}")
    for one in model.scalar_sets:
        if one.reduced:
            reduction = "symmetry reduction exchanges its members"
        else:
            where = "" if one.place is None else f", at {one.place}: {one.at}"
            reduction = f"no symmetry reduction: {one.obstacle}{where}"
        say(f"scalar set of {_count(one.size, 'member')}: {reduction}")
    for table in _tables(model):
        console.print()
        console.print(table)


def _tables(model: Model) -> list[Table]:
    """The tables that have rows."""
    tables = [
        _table("template", _template_rows(model.templates), "locations", "edges", "features"),
        _table("process", _process_rows(model.processes), "template", "priority"),
        _table("variable", _variable_rows(model.variables), "type", "words"),
        _table("clock", _clock_rows(model.clocks), "kind"),
        _table("channel", _channel_rows(model.channels), "kind", "priority"),
        _table("query", [[query.text, query.comment] for query in model.queries], "comment"),
    ]
    return [table for table in tables if table.row_count]


def _table(first: str, rows: Iterable[Sequence[str]], *columns: str) -> Table:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    shown = list(rows)
    headings = [first, *columns]
    # Columns without any entry are left out.
    used = [i for i in range(len(headings)) if i == 0 or any(row[i] for row in shown)]
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1), show_edge=False)
    for i in used:
        is_number = headings[i] in {"locations", "edges", "words", "priority"}
        table.add_column(headings[i], justify="right" if is_number else "left", overflow="fold")
    for row in shown[:ROWS_SHOWN]:
        table.add_row(*(Text(safe(row[i])) for i in used))
    if len(shown) > ROWS_SHOWN:
        table.add_row(Text(f"… {len(shown) - ROWS_SHOWN} more (all of them: --json)"))
    return table


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


def _process_rows(processes: Sequence[Process]) -> Iterable[list[str]]:
    has_priorities = any(process.priority for process in processes)

    def kind(process: Process) -> tuple[str, str, int]:
        return _family(process.name), process.template, process.priority

    for (_, template, priority), group in groupby(processes, kind):
        names = [process.name for process in group]
        yield [_joined(names), template, str(priority) if has_priorities else ""]


def _variable_rows(variables: Sequence[Variable]) -> Iterable[list[str]]:
    for (_, text), group in groupby(variables, lambda one: (_family(one.name), _type(one))):
        members = list(group)
        names = _joined([variable.name for variable in members])
        yield [names, text, str(sum(variable.words for variable in members))]


def _type(variable: Variable) -> str:
    sizes = "".join(f"[{size}]" for size in variable.dimensions)
    meta = "meta " if variable.meta else ""
    kind = variable.type.replace("int[-2147483648,2147483647]", "int32_t")
    return f"{meta}{kind}{' array ' if sizes else ''}{sizes}"


def _clock_rows(clocks: Sequence[Clock]) -> Iterable[list[str]]:
    for (_, hybrid), group in groupby(clocks, lambda one: (_family(one.name), one.hybrid)):
        names = [clock.name for clock in group]
        yield [_joined(names), "hybrid: left out" if hybrid else ""]


def _channel_rows(channels: Sequence[Channel]) -> Iterable[list[str]]:
    has_priorities = any(channel.priority for channel in channels)

    def kind(channel: Channel) -> tuple[str, str, int]:
        words = ["urgent"] * channel.urgent + ["broadcast" if channel.broadcast else "binary"]
        return _family(channel.name), " ".join(words), channel.priority

    for (_, words, priority), group in groupby(channels, kind):
        names = [channel.name for channel in group]
        yield [_joined(names), words, str(priority) if has_priorities else ""]


def _family(name: str) -> str:
    """The name without its indexes: the same for all members of a process set or an array."""
    return re.sub(r"\([^)]*\)|\[[^\]]*\]", "…", name)


def _joined(names: Sequence[str]) -> str:
    """The names of a family in one cell: ``go[0] … go[5]``."""
    return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]} ({len(names)})"


def _count(number: int, singular: str, plural: str | None = None) -> str:
    return f"{number} {singular if number == 1 else plural or singular + 's'}"
