"""`ntagen plan --optimise`: learns a policy, and says how it compares with the best plan."""

from __future__ import annotations

import json
import time
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.needle.odds import Wanted
from ntagen.cli.terminal import echo, echo_message
from ntagen.errors import InputError
from ntagen.files import read_file, write_files

if TYPE_CHECKING:
    from ntagen.nsl import Task
    from ntagen.plan.policy import Aim, Policy
    from ntagen.plan.steering import Mean, Steered
    from ntagen.scene import Scene

DEFAULT_RUNS: Final = 100_000
"""A policy is learned from this number of runs. A tenth of it compares it with the plan."""

_WORDS: Final = {
    "probability": "reaches the target, and touches nothing",
    "miss": "misses the target by",
    "cut": "cuts",
}
_NONE: Final = 1
_STOPPED: Final = 3


def optimise(
    task: Task,
    aim: Aim,
    wanted: Wanted,
    budget_s: float | None,
    output: Path | None,
    *,
    as_json: bool,
) -> int:
    """Learns a policy, prints what it is worth, and writes it; the exit code."""
    from ntagen.drive.best_policy import BUDGET_S, best_policy, sampling_of

    runs = DEFAULT_RUNS if wanted.runs is None else wanted.runs
    start_s = time.monotonic()
    sampling = sampling_of(runs, wanted.seed)
    best, steered = best_policy(task, aim, sampling, BUDGET_S if budget_s is None else budget_s)
    if steered is None:
        return _say_none(best.verdict, as_json=as_json)
    seconds = time.monotonic() - start_s
    if output is not None:
        write_files({output: steered.policy.text()})
    if steered.policy.is_silent:
        _warn_silent(steered, aim)
    if as_json:
        echo(json.dumps(_record(steered, aim, seconds)))
        return 0
    _show(steered, aim, wanted.seed, seconds)
    if output is not None:
        echo(f"policy written to {output}")
    return 0


def load_policy(path: Path, scene: Scene) -> Policy:
    """The policy of a file for a task.

    Raises:
        InputError: There is none for it in the file.
    """
    from ntagen.plan.policy import MOST_BYTES, read_policy

    try:
        return read_policy(read_file(path, MOST_BYTES), scene)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _say_none(verdict: str, *, as_json: bool) -> int:
    is_proved = verdict == "none"
    if as_json:
        echo(json.dumps({"verdict": verdict}))
    elif is_proved:
        echo("no plan: it is proved that the model has none that holds, so there is no policy")
    else:
        echo("unknown: the budget ended before a plan was found, or proved not to exist")
        echo("hint: give more time with --within")
    return _NONE if is_proved else _STOPPED


def _record(steered: Steered, aim: Aim, seconds: float) -> dict[str, object]:
    return {
        "verdict": "found",
        "optimised": aim,
        "plan": str(steered.plan),
        "is_silent": steered.policy.is_silent,
        "is_better": steered.aims[aim].verdict == "better",
        "guard": asdict(steered.guard),
        "aims": {name: asdict(one) for name, one in steered.aims.items()},
        "learning_runs": steered.learning_runs,
        "seconds": seconds,
    }


def _show(steered: Steered, aim: Aim, seed: int, seconds: float) -> None:
    chosen = steered.aims[aim]
    echo(f"the best plan: {steered.plan}")
    echo(
        f"a policy was learned around it from {steered.learning_runs:,} runs with seed {seed} "
        f"in {seconds:.1f} s"
    )
    echo(
        f"{chosen.runs:,} tissues that learning has not seen, the same for both; each interval "
        f"holds at {chosen.confidence:.4g} confidence:"
    )
    for name, one in steered.aims.items():
        mark = " (optimised)" if name == aim else ""
        echo(f"  {_WORDS[name]}{mark}")
        echo(f"    the plan:   {span(one.plan, name)}")
        echo(f"    the policy: {span(one.policy, name)}")
        echo(f"    difference: {span(signed(one.difference, name), name, sign='+')}, {one.verdict}")


def _warn_silent(steered: Steered, aim: Aim) -> None:
    guard = steered.guard
    difference = span(signed(guard.difference, aim), aim, sign="+")
    echo_message(
        f"warning: what was learned is not better than the plan in {guard.runs:,} other tissues: "
        f"difference {difference}\n"
        "note: so the policy is silent: it never differs from the plan\n"
        "hint: drive without a policy, or learn from more --runs"
    )


def signed(gain: Mean, aim: str) -> Mean:
    """The policy's value less the plan's, of a gain."""
    if aim == "probability":
        return gain
    return replace(gain, value=-gain.value, lower=-gain.upper, upper=-gain.lower)


def span(mean: Mean, aim: str, sign: str = "") -> str:
    """A mean and its interval, in the unit of what is optimised."""
    value, upper = (amount(one, aim, sign) for one in (mean.value, mean.upper))
    return f"{value} (from {_number(mean.lower, aim, sign)} to {upper})"


def amount(value: float, aim: str, sign: str = "") -> str:
    """A number in the unit of what is optimised."""
    return _number(value, aim, sign) + (" %" if aim == "probability" else " mm")


def _number(value: float, aim: str, sign: str) -> str:
    return f"{100.0 * value if aim == 'probability' else value:{sign}.4g}"
