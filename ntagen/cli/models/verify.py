"""`ntagen verify`: checks a trace, a certificate or a strategy."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

import click

from ntagen.cli.guard import doing
from ntagen.cli.loading import load_model, pointing_to_explanations
from ntagen.cli.options import (
    bounded,
    constant_option,
    forced_rule,
    include_option,
    overflow_rule,
    path_argument,
    priority_rule,
)
from ntagen.cli.terminal import echo, say_idle
from ntagen.files import EVIDENCE_BYTES, read_file

VIOLATED: Final = 1
"""Exit code of evidence that does not hold."""

NOT_COVERED: Final = 3
"""Exit code where the check does not cover the model or the query."""

_WITHOUT_RULES: Final = re.compile(rb'\s*\{\s*"format"\s*:\s*"ntagen-(trace|certificate)"')
"""The start of a file whose check does not depend on the rules of games."""


@click.command(
    "verify",
    epilog="Exit codes: 0 the evidence holds, 1 it does not, 2 the input is rejected, 3 the check "
    "does not cover the model or the query, or a limit came first.",
)
@path_argument("model_path", metavar="MODEL")
@path_argument("file", metavar="FILE")
@forced_rule(
    "For strategies: when the environment must move at a moment at which time cannot pass. Give "
    "the rule that the strategy was made with.  [default: tiga]"
)
@priority_rule(
    "For strategies: whether priorities of channels and processes count. Give the rule that the "
    "strategy was made with.  [default: ignore]"
)
@constant_option()
@include_option()
@overflow_rule()
@bounded
def command(
    model_path: Path,
    file: Path,
    forced: Any,  # noqa: ANN401  click gives a str where the engine wants literals
    priorities: Any,  # noqa: ANN401
    constants: dict[str, str],
    include: tuple[Path, ...],
    overflow: Any,  # noqa: ANN401
) -> int:
    """Check a trace, certificate or strategy independently of the search that found it.

    `ntagen check` writes FILE for MODEL, with --trace FILE.json, --certificate FILE or --strategy
    FILE.json; so does `ntagen play` with --log FILE.

    A trace is replayed with its exact times. The states, edges and zones in the file must be those
    of the run, and the run must show what the query asks. A play must end as the file says.

    A certificate is a set of states for an E<> that is not satisfied or an A[] that is. It must
    contain the initial state; no move and no delay may lead out of it; and it must not contain a
    state that E<> looks for or A[] forbids. States that differ only in meta variables count as
    different.

    A strategy is played against every move of its opponent, at every moment. Its owner must win.

    The output also says which parts of a file are not checked. Names that the format or the model
    does not have are refused.

    \b
    Examples:
      ntagen check model.xml --query "A[] not deadlock" --certificate safe.jsonl
      ntagen verify model.xml safe.jsonl
      ntagen check game.xml --query "control: A<> Main.Won" --strategy win.json
      ntagen verify game.xml win.json
    """  # noqa: D301  click wants the control character
    with pointing_to_explanations(True):
        with doing("loading the model"):
            loaded = load_model(model_path, include, overflow, constants)
        with doing(f"checking {file}"):
            data = read_file(file, EVIDENCE_BYTES)
            checked = loaded.model.verify(data, str(file), forced=forced, priorities=priorities)
    kind = _WITHOUT_RULES.match(data)
    if kind:
        idle = {"forced": "--forced", "priorities": "--priorities"}
        say_idle(idle, f"here: it is a rule for strategies, and the file is a {kind[1].decode()}")
    for line in checked.lines:
        echo(line)
    return {True: 0, False: VIOLATED, None: NOT_COVERED}[checked.holds]
