"""`ntagen verify`: does a trace, a certificate or a strategy do what it is said to?"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

import click

from ntagen.cli.effects import say_idle
from ntagen.cli.models import include_option, load_model, pointing_to_explanations
from ntagen.cli.rules import forced_rule, overflow_rule, priority_rule
from ntagen.cli.terminal import echo
from ntagen.errors import InputError
from ntagen.files import EVIDENCE_BYTES, read_file

VIOLATED: Final = 1
"""Exit code of evidence that does not hold."""

NOT_COVERED: Final = 3
"""Exit code where the check does not cover the model or the query."""

_WITHOUT_RULES: Final = re.compile(r'\s*\{\s*"format"\s*:\s*"ntagen-(trace|certificate)"')
"""How a file begins whose check does not hang on the rules of games."""


@click.command(
    "verify",
    epilog="Exit codes: 0 the evidence holds, 1 it does not, 2 the input is rejected, 3 the check "
    "does not cover the model or the query.",
)
@click.argument("model_path", metavar="MODEL", type=click.Path(path_type=Path))
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@forced_rule("For strategies: when the environment must move because time cannot pass.")
@priority_rule("For strategies: whether priorities of channels and processes count.")
@include_option()
@overflow_rule()
def command(
    model_path: Path,
    file: Path,
    forced: Any,  # noqa: ANN401  click gives a str where the engine wants literals
    priorities: Any,  # noqa: ANN401
    include: tuple[Path, ...],
    overflow: Any,  # noqa: ANN401
) -> int:
    """Check a trace, certificate or strategy, independently of the search that found it.

    FILE is what `ntagen check` wrote for MODEL with --certificate FILE, --trace FILE.json or
    --strategy FILE.json, or `ntagen play` with --log FILE. A trace is replayed with its exact
    times, and must show what its query asks about; the states, edges and zones that it shows must
    be those of the run. A play must end as it says. A certificate is a
    set of states for E<> (not satisfied) or A[] (satisfied): it must contain the initial state, no
    move and no delay may lead out of it, and it must not meet what is to be avoided; states that
    differ in meta variables alone count as different, so that it holds whichever of them are kept.
    A strategy is played against every move of its opponent, at every moment, and its owner must
    win. What is not checked of a file is said; names that the format or the model does not have
    are refused.

    \b
    Examples:
      ntagen check model.xml --query "A[] not deadlock" --certificate safe.jsonl
      ntagen verify model.xml safe.jsonl
      ntagen check game.xml --query "control: A<> Main.Won" --strategy win.json
      ntagen verify game.xml win.json
    """  # noqa: D301  click wants the control character
    with pointing_to_explanations(True):
        loaded = load_model(model_path, include, overflow)
        text = _read(file)
        checked = loaded.model.verify(text, str(file), forced=forced, priorities=priorities)
    kind = _WITHOUT_RULES.match(text)
    if kind:
        idle = {"forced": "--forced", "priorities": "--priorities"}
        say_idle(idle, f"here: it is a rule for strategies, and this is a {kind[1]}")
    for line in checked.lines:
        echo(line)
    return {True: 0, False: VIOLATED, None: NOT_COVERED}[checked.holds]


def _read(file: Path) -> str:
    try:
        return read_file(file, EVIDENCE_BYTES).decode()
    except UnicodeDecodeError as error:
        raise InputError(f"{file}: it is no text: {error.reason}") from None
