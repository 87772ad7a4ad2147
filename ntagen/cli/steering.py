"""The options of all settings that steer: one for each row of `ntagen.parameters`."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import click

from ntagen.cli.effects import say_idle
from ntagen.cli.terminal import echo
from ntagen.parameters import MEASURES, NEEDLE, PARAMETERS, Given, Parameter

if TYPE_CHECKING:
    from ntagen.drive.configure import Configuration
    from ntagen.drive.needles import Chosen


class _Value(click.ParamType[Given]):
    """The value of a setting, with or without its unit."""

    def __init__(self, parameter: Parameter) -> None:
        self._parameter = parameter
        self.name = parameter.words

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Given:
        from ntagen.drive.configure import COMMAND_LINE
        from ntagen.plan.rank import parse_ranking

        if isinstance(value, Given):
            return value
        if self._parameter.field == "ranking":
            return Given(self._parameter, parse_ranking(str(value)), COMMAND_LINE)
        try:
            return Given(self._parameter, self._parameter.parse(str(value)), COMMAND_LINE)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class _Option(click.Option):
    """An option whose help shows the default of the setting, which is looked up late."""

    parameter: Parameter

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        from ntagen.drive.configure import Configuration

        record = super().get_help_record(ctx)
        if record is None:
            return None
        default = self.parameter.shown(Configuration().value(self.parameter))
        return record[0], f"{record[1]}  [default: {default}]"


def steering_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Adds the options; the command gets the values on the command line as `given`."""
    return _with_options(command, PARAMETERS)


def needle_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Adds the options of a simulated needle only, in the same way."""
    return _with_options(command, [p for p in PARAMETERS if p.field.startswith(f"{NEEDLE}.")])


def sweeping_options(command: Callable[..., int | None]) -> Callable[..., int | None]:
    """Adds all options but the seed, in the same way: a sweep has many seeds."""
    return _with_options(command, [p for p in PARAMETERS if p.field != f"{NEEDLE}.seed"])


known_option = click.option(
    "--known",
    metavar="all|none|NAME,…",
    default="all",
    show_default=True,
    help="The critical regions that the driver knows at the start. It must feel the others.",
)
"""What the driver is told at the start."""


def _with_options(
    command: Callable[..., int | None], parameters: Sequence[Parameter]
) -> Callable[..., int | None]:
    @functools.wraps(command)
    def with_given(**values: object) -> int | None:
        found = [values.pop(_name(parameter)) for parameter in parameters]
        return command(given=tuple(one for one in found if isinstance(one, Given)), **values)

    decorated: Callable[..., int | None] = with_given
    for parameter in reversed(parameters):
        decorated = _option(parameter)(decorated)
    return decorated


def _option(
    parameter: Parameter,
) -> Callable[[Callable[..., int | None]], Callable[..., int | None]]:
    unit = MEASURES[parameter.kind].unit
    metavar = {"words": "CRITERION,…", "switch": "on|off"}.get(parameter.kind, unit.upper() or "N")

    class Its(_Option):
        pass

    Its.parameter = parameter
    return click.option(
        parameter.flag,
        _name(parameter),
        cls=Its,
        metavar=metavar,
        type=_Value(parameter),
        default=None,
        help=parameter.help,
    )


def _name(parameter: Parameter) -> str:
    """The name of the command's parameter."""
    return f"given_{parameter.field.replace('.', '_')}"


def say_idle_errors(needle: Chosen) -> None:
    """Tells which options about errors of a needle mean nothing to this one."""
    flags = {_name(one): one.flag for one in PARAMETERS if needle.ignores(one.field)}
    say_idle(flags, f"with {needle.kind}")


def show_settings(configuration: Configuration) -> None:
    """Prints all settings: words, value, origin."""
    rows = configuration.rows()
    widths = [max(len(row[i]) for row in rows) for i in range(2)]
    for words, value, origin in rows:
        echo(f"  {words:<{widths[0]}}  {value:<{widths[1]}}  {origin}")
