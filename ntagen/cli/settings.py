"""``--set 'WORDS VALUE'``, which gives the rarer settings of a command, and ``--help-settings``."""

from __future__ import annotations

import difflib
import functools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import click

from ntagen.cli.options import Decorator
from ntagen.cli.terminal import echo
from ntagen.values import dataclass

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from ntagen.parameters import Parameter


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting that only the command line has; those of steering are in `ntagen.parameters`.

    Attributes:
        form: How it is written: its words, and the value.
        type: What reads a value.
        help: What it is, as a sentence.
        name: The name of the value for the command; by default the words.
    """

    form: str
    type: click.ParamType[Any] | Callable[[str], Any]
    help: str
    name: str = ""

    @property
    def field(self) -> str:
        """The name of the value."""
        return self.name or self.words.replace(" ", "_")

    @property
    def words(self) -> str:
        """Its words before the value."""
        return self.form.rpartition(" ")[0]

    @property
    def choices(self) -> Sequence[str]:
        """Its values, if they are few."""
        return ("on", "off") if self.type is click.BOOL else getattr(self.type, "choices", ())

    def option(self) -> Decorator:
        """The same as an option of its own."""
        words, _, value = self.form.partition(" ")
        return click.option(f"--{words}", metavar=value, type=self.type, help=self.help)


class Words(click.ParamType[str]):
    """The text of a setting; a shell completes its words."""

    name = "settings"

    def __init__(self, settings: Sequence[Setting | Parameter]) -> None:
        self.settings = settings

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """The settings that begin so, and those of few values with each of them."""
        from click.shell_completion import CompletionItem

        return [
            CompletionItem(words, help=one.help)
            for one in self.settings
            for words in (one.words, *(f"{one.words} {choice}" for choice in one.choices))
            if words.startswith(incomplete)
        ]


def set_option(settings: Sequence[Setting | Parameter], about: str, **more: Any) -> Decorator:  # noqa: ANN401
    """The option ``--set``; `about` is the start of its help, and `more` is for click."""
    return click.option(
        "--set",
        "settings",
        metavar="'WORDS VALUE'",
        type=Words(settings),
        multiple=True,
        help=f"{about} You can give this option several times.",
        **more,
    )


def help_option(show: Callable[[click.HelpFormatter], None]) -> Decorator:
    """The option ``--help-settings``; `show` writes the settings."""

    def list_settings(ctx: click.Context, _option: click.Parameter, wanted: bool) -> None:
        if not wanted or ctx.resilient_parsing:
            return
        formatter = ctx.make_formatter()
        show(formatter)
        echo(formatter.getvalue().rstrip())
        ctx.exit()

    return click.option(
        "--help-settings",
        is_flag=True,
        is_eager=True,
        expose_value=False,
        callback=list_settings,
        help="Print all settings that --set takes, with units and defaults, and exit.",
    )


def settings_option(settings: Sequence[Setting], example: str) -> Decorator:
    """Adds ``--set`` and ``--help-settings``; the command gets what is given as `settings`.

    Args:
        settings: What can be set.
        example: One of them with a value.
    """

    def show(formatter: click.HelpFormatter) -> None:
        with formatter.section("Settings"):
            formatter.write_dl([(one.form, one.help) for one in settings])

    about = f"Change a rarer setting, for example --set {example!r}; --help-settings lists them."
    read = functools.partial(_read, settings)
    add = set_option(settings, about, callback=read)

    def decorate(command: Callable[..., int | None]) -> Callable[..., int | None]:
        return add(help_option(show)(command))

    return decorate


def _read(
    settings: Sequence[Setting], ctx: click.Context, _: click.Parameter, texts: Sequence[str]
) -> dict[str, Any]:
    """The values on the command line, by the names of the settings.

    Raises:
        click.UsageError: A text is no setting, or stands there twice, or its value is wrong.
    """
    values: dict[str, Any] = {}
    for text in map(str.strip, texts):
        matching = [one for one in settings if f"{text} ".startswith(f"{one.words} ")]
        if not matching:
            near = difflib.get_close_matches(text.rpartition(" ")[0], [s.words for s in settings])
            hint = f"did you mean {near[0]!r}?" if near else "--help-settings lists them"
            raise click.UsageError(f"there is no setting {text!r}; {hint}")
        one = max(matching, key=lambda row: len(row.words))
        if one.field in values:
            raise click.UsageError(f"the setting {one.words!r} is given twice")
        try:
            kind, value = click.types.convert_type(one.type), text.removeprefix(one.words).strip()
            values[one.field] = kind.convert(value or kind.fail("no value"), None, ctx)
        except click.BadParameter as error:
            raise click.UsageError(f"--set {one.form!r}: {error.message}") from error
    return values
