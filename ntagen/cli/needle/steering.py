"""The settings of steering on the command line: ``--set``, and options of the most used ones."""

from __future__ import annotations

import functools
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import click

from ntagen.cli.options import Decorator, gathered
from ntagen.cli.settings import help_option, set_option
from ntagen.cli.terminal import aligned, echo, say
from ntagen.parameters import BY_WORDS, MEASURES, PARAMETERS, PARTS, Given, Parameter

if TYPE_CHECKING:
    from ntagen.drive.configure import Configuration
    from ntagen.drive.needles import Chosen


def settings_options(*own: str, without: Collection[str] = (), listed: bool = True) -> Decorator:
    """Adds ``--set`` and ``--help-settings``; the command gets the values as `given`.

    Args:
        own: The settings, by their words, that also have an option of their own.
        without: The settings, by their words, that mean nothing to the command.
        listed: Whether there is a ``--help-settings``.
    """
    settings = [one for one in PARAMETERS if one.words not in without]
    about = (
        "Change a setting, in the words of drive { … } in ENV.nsl, for example "
        "--set 'initial push 4 mm'."
    )
    options = {"settings": set_option(settings, about)}
    for one in map(BY_WORDS.__getitem__, own):
        name, unit = one.option.removeprefix("--"), MEASURES[one.kind].unit
        options[name] = click.option(one.option, name, metavar=unit.upper() or "N", help=one.help)
    add = gathered("given", options, functools.partial(_read, own))
    if not listed:
        return add
    show = help_option(functools.partial(_list, settings))
    return lambda command: add(show(command))


def _read(own: Sequence[str], **values: Any) -> tuple[Given, ...]:  # noqa: ANN401  click's values
    """The settings on the command line; the values of own options are in the order of `own`."""
    texts = values.pop("settings")
    pairs = zip(own, values.values(), strict=True)
    said = [*texts, *(f"{words} {value}" for words, value in pairs if value is not None)]
    if not said:
        return ()
    from ntagen.drive.configure import COMMAND_LINE
    from ntagen.nsl.driving import read_settings

    return read_settings(said, COMMAND_LINE)


def _list(settings: Sequence[Parameter], formatter: click.HelpFormatter) -> None:
    """Writes the settings, part by part."""
    from ntagen.drive.configure import Configuration

    usual = Configuration()
    formatter.write_text(
        "Write a setting as --set 'pull 4 mm', or in the braces drive { … } of a task. The command "
        "line also takes a number without its unit."
    )
    for part, heading in PARTS.items():
        with formatter.section(heading):
            formatter.write_dl(
                [
                    (one.form, f"{one.help}  [default: {one.shown(usual.value(one))}]")
                    for one in settings
                    if one.part == part
                ]
            )


known_option = click.option(
    "--known",
    metavar="all|none|NAME,…",
    default="all",
    show_default=True,
    help="The critical regions that the driver knows at the start. It must feel the others.",
)
"""What the driver is told at the start."""


def say_idle_settings(given: Sequence[Given], words: Collection[str], why: str) -> None:
    """Prints a note for each of the settings with these words that the command line gives.

    The reason follows the words "has no effect".
    """
    idle = [one.parameter.spelling for one in given if one.parameter.words in words]
    say([f"{option} has no effect {why}" for option in idle])


def say_idle_errors(needle: Chosen, given: Sequence[Given]) -> None:
    """Tells which errors of a needle on the command line mean nothing to this one."""
    idle = {one.words for one in PARAMETERS if needle.ignores(one.field)}
    say_idle_settings(given, idle, f"with {needle.kind}")


def show_settings(configuration: Configuration) -> None:
    """Prints all settings: words, value, origin."""
    for line in aligned(configuration.rows()):
        echo(f"  {line}")
