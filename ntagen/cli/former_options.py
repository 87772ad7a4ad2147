"""What to write instead of an option that a command had before.

This is for one release: then this file goes, and commands are of click's own class again.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from ntagen.cli.settings import Setting, Words
from ntagen.errors import InputError

if TYPE_CHECKING:
    from ntagen.parameters import Parameter

_SWITCH = ("on", "off")


class Renamed(click.Command):
    """A command that knows the options which it had before: those of its settings, and `former`.

    Args:
        former: What replaces each other option that is gone; ``{}`` stands for its value.
    """

    def __init__(self, *args: Any, former: dict[str, str] | None = None, **keywords: Any) -> None:  # noqa: ANN401
        super().__init__(*args, **keywords)
        self._former = former or {}

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """The words that are left over, as click has it."""
        words = list(args)
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            option, value = error.option_name, _value_of(error.option_name, words)
            said = self._former.get(option)
            if said is None and (setting := self._setting_of(option)) is not None:
                value = "on" if setting.choices == _SWITCH else value
                said = f"write --set '{setting.words} {{}}'"
            if said is None:
                raise
            raise InputError(f"no such option: {option}; {said.format(value)}") from error

    def _setting_of(self, option: str) -> Setting | Parameter | None:
        """The setting whose option it was, if it was one."""
        said = option.removeprefix("--").replace("-", " ")
        types = [one.type for one in self.params]
        for one in (s for kind in types if isinstance(kind, Words) for s in kind.settings):
            # `--rank` was the option of `ranking`; all others had their words.
            if said in (one.words, one.words.removesuffix("ing")):
                return one
        return None


def _value_of(option: str, words: Sequence[str]) -> str:
    """The value that an option has on a command line."""
    for word, following in zip(words, (*words[1:], "…"), strict=True):
        name, equals, value = word.partition("=")
        if name == option:
            return value if equals else following
    return "…"
