"""`ntagen play`: one side of a game is played by a strategy, the other by the user."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.guard import doing
from ntagen.cli.loading import load_model, pointing_to_explanations
from ntagen.cli.models.queries import queries_of
from ntagen.cli.models.session import Session
from ntagen.cli.options import (
    constant_option,
    forced_rule,
    include_option,
    overflow_rule,
    path_argument,
    path_option,
    priority_rule,
)
from ntagen.cli.progress import shown_progress
from ntagen.cli.terminal import echo, say_idle
from ntagen.errors import InputError
from ntagen.files import require_apart

if TYPE_CHECKING:
    from ntagen.checker import Model

_SEARCH_FIRST: Final = "`ntagen check --strategy FILE.json` has it; then play --strategy FILE.json"

DEFEATED: Final = 1
"""Exit code where the strategy did not keep its promise."""


@click.command(
    "play",
    cls=Renamed,
    former=dict.fromkeys(("--states", "--memory", "--timeout"), _SEARCH_FIRST),
    epilog="Exit codes: 0 done, 1 the strategy lost or has no next move, 2 the input is "
    "rejected, 3 stopped by a limit, 4 run-time error in the model.",
)
@path_argument("model_path", metavar="MODEL")
@path_option(
    "--strategy",
    "strategy_path",
    metavar="FILE.json",
    help="The strategy to play against, as `ntagen check --strategy` writes it.",
)
@click.option(
    "--query",
    "asked",
    metavar="TEXT|NAME",
    help="A control query, or the name of a query of the model. The winner's strategy is "
    "synthesised first. If that takes long, let `ntagen check --strategy` do it, with limits.  "
    "[default: the model's only control query]",
)
@click.option(
    "--auto",
    "steps",
    type=click.IntRange(1),
    help="Choose your moves at random, for at most this many steps.",
)
@click.option(
    "--seed",
    type=int,
    default=0,
    help="For --auto: the same seed gives the same play.  [default: 0]",
)
@path_option(
    "--log",
    metavar="FILE",
    help="When the play ends, write it as a trace; `ntagen verify MODEL FILE` checks it.",
)
@forced_rule()
@priority_rule("Whether priorities of channels and processes count.  [default: ignore]")
@overflow_rule()
@constant_option()
@include_option()
def command(
    model_path: Path,
    strategy_path: Path | None,
    asked: str | None,
    steps: int | None,
    seed: int,
    log: Path | None,
    forced: Any,  # noqa: ANN401  click gives a str where the engine wants literals
    priorities: Any,  # noqa: ANN401
    overflow: Any,  # noqa: ANN401
    constants: dict[str, str],
    include: tuple[Path, ...],
) -> int:
    """Play a timed game against a strategy.

    MODEL is an environment (.nsl) or a UPPAAL model (.xml, .xta). The strategy plays for its owner,
    and you play the other side: if the controller can win, you are the environment; if it cannot,
    you are the controller.

    \b
    Examples:
      ntagen play game.xta --query "control: A<> Gate.Open"
      ntagen check game.xta --query "control: A<> Gate.Open" --strategy open.json
      ntagen play game.xta --strategy open.json --log play.json
      ntagen play game.xta --strategy open.json --auto 1000 --seed 7

    \b
    Each state lists your moves with the delays after which they are possible. The strategy acts by
    itself, as soon as it no longer waits. If both sides can move at the same instant, the
    environment is first. Type:
      2          make move 2, as soon as it is possible
      2 3/2      make move 2 after a delay of 3/2
      Enter, w   only wait, until the strategy acts or something is decided
      w 1/2      only wait for 1/2
      +1, +1 2   let a strategy that allows several moves make its move 1 (after 2)
      u  r       undo, restart
      s  m       show the whole state, all moves
      ?  q       help, quit
    """  # noqa: D301  click wants the control character
    if strategy_path and asked:
        raise InputError("give either --strategy or --query: the file says which query it answers")
    if steps is None:
        say_idle({"seed": "--seed"}, "without --auto")
    inputs = {"model": model_path} | ({"strategy": strategy_path} if strategy_path else {})
    require_apart({"--log": log}, inputs)
    with pointing_to_explanations(True):
        with doing("loading the model"):
            model = load_model(model_path, include, overflow, constants).model
        if strategy_path:
            with doing("loading the strategy"):
                strategy = model.load_strategy(strategy_path, forced, priorities)
        else:
            query = _query(model, asked)
            quiet = steps is not None
            with doing("the search for a strategy"), shown_progress(query, quiet=quiet) as report:
                strategy = model.synthesize(
                    query, forced=forced, priorities=priorities, progress=report
                )
        session = Session(strategy)
    try:
        if steps is None:
            session.converse(_reader())
        else:
            from ntagen.checker.play import Chance

            session.play_at_random(steps, Chance(seed))
    finally:
        if log is not None:
            session.write(log)
    return DEFEATED if session.is_defeated else 0


def _query(model: Model, asked: str | None) -> str:
    """The query with the name `asked`, `asked` itself as a query, or the model's only game."""
    if asked is not None:
        return queries_of(model, (asked,), None)[0].text
    queries = queries_of(model, (), None) if model.queries else []
    games = [query for query in queries if query.form and query.form.is_game]
    if len(games) == 1:
        return games[0].text
    shown = "".join(f"\n  {query.text}" for query in games)
    raise InputError(
        f"the model has {len(games) or 'no'} control queries{':' if games else ''}{shown}\n"
        "hint: give a control query with --query, or a strategy file with --strategy"
    )


def _reader() -> Callable[[], str | None]:
    """A function that gives the next line of the user, or ``None`` at the end of the input."""

    def typed() -> str | None:
        try:
            return input("> ")
        except EOFError:
            echo("")
            return None

    def piped() -> str | None:
        line = sys.stdin.readline()
        if line:
            # Printed, so that the output can be read without the input.
            echo(f"> {line.rstrip()}")
        return line.rstrip() if line else None

    return typed if sys.stdin.isatty() else piped
