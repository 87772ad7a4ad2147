"""What to write instead of an option that a setting of steering had before ``--set``.

This is for one release: then this file goes, and commands are of click's own class again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import click

from ntagen.cli.steering import Words
from ntagen.errors import InputError
from ntagen.parameters import Parameter


class SteeringCommand(click.Command):
    """A command with ``--set`` that knows the options which it had before."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The words that are left over, as click has it."""
        words = list(args)
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            types = [one.type for one in self.params]
            settings = [s for one in types if isinstance(one, Words) for s in one.settings]
            setting = _had_option(error.option_name, settings)
            if setting is None:
                raise
            text = f"{setting.words} {_value_of(error.option_name, words)}"
            said = f"no such option: {error.option_name}; write --set '{text}'"
            raise InputError(said) from error


def _had_option(option: str, settings: Iterable[Parameter]) -> Parameter | None:
    """The setting whose option it was, if it was one."""
    said = option.removeprefix("--").replace("-", " ")
    for one in settings:
        # `--rank` was the option of `ranking`; all others had their words.
        if option == one.option or said in (one.words, one.words.removesuffix("ing")):
            return one
    return None


def _value_of(option: str, words: Sequence[str]) -> str:
    """The value that an option has on a command line."""
    for word, following in zip(words, (*words[1:], "…"), strict=True):
        name, equals, value = word.partition("=")
        if name == option:
            return value if equals else following
    return "…"
