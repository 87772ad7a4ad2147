"""Notes about the command line on standard error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import click

from ntagen.cli.terminal import echo


def given_options() -> list[str]:
    """The names of the parameters and settings that stand on the command line."""
    context = click.get_current_context()
    source = click.core.ParameterSource.COMMANDLINE
    given = [name for name in context.params if context.get_parameter_source(name) is source]
    return [*given, *context.params.get("settings", ())]


def say_idle(options: Mapping[str, str], why: str) -> None:
    """Prints a note for each of these options that stands on the command line.

    Args:
        options: The options, by the name of their parameters.
        why: The reason, which follows the words "has no effect".
    """
    given = given_options()
    say([f"{option} has no effect {why}" for name, option in options.items() if name in given])


def say(notes: Sequence[str]) -> None:
    """Prints notes about the command line to standard error."""
    for note in notes:
        echo(f"note: {note}", err=True)
