"""`ntagen plan`: the best plans of a task within a budget of time."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.loading import load_task
from ntagen.cli.needle.odds import Wanted, odds_lines, odds_options, rate, with_odds
from ntagen.cli.options import include_option, output_option, path_argument
from ntagen.cli.quantities import duration
from ntagen.cli.terminal import echo, say_idle
from ntagen.files import require_apart, write_files

if TYPE_CHECKING:
    from ntagen.drive.settings import Settings
    from ntagen.plan.anytime import Best
    from ntagen.plan.chance import Rated
    from ntagen.plan.policy import Aim
    from ntagen.scene import Scene

BUDGET_S: Final = 2.0

STOPPED: Final = 3
"""Exit code if the budget ended before a plan was found, or proved not to exist."""


@click.command(
    "plan",
    cls=Renamed,
    former={"--among": "write --best {}"},
    epilog="Exit codes: 0 a plan was found, 1 it is proved that there is none, 2 the input is "
    "rejected, 3 the budget ended before either, 4 run-time error in the model.",
)
@path_argument("source", metavar="ENV.nsl")
@click.option(
    "--best",
    "count",
    metavar="N",
    default=1,
    show_default=True,
    type=click.IntRange(min=1),
    help="How many plans to find. With --rank probability, that many are compared, or 10 if only "
    "the best one is asked for.",
)
@click.option(
    "--within",
    "budget_s",
    metavar="TIME",
    default=None,
    type=duration,
    help="The search ends after about this time. It ends sooner if no plan can be better.  "
    "[default: 2s; with --optimise: 20s]",
)
@click.option(
    "--rank",
    "ranking",
    metavar="CRITERION,…",
    default=None,
    help="How plans are ranked, the most important criterion first: clearance, reserve, rolls, "
    "length, target.  [default: as drive { … } says, else clearance,rolls,length] With "
    "tissue stochastic, `probability` may come first: the best plans by the other criteria (or by "
    "reserve,length,rolls) are ranked by how likely they reach the target.",
)
@click.option(
    "--optimise",
    "aim",
    type=click.Choice(["probability", "miss", "cut"]),
    help="With tissue stochastic: learn a policy around the best plan, which says at each "
    "measurement whether to roll now. It is the best for the probability that the tip reaches the "
    "target and touches nothing, for the miss at the end, or for the length that is cut, where a "
    "failure costs the length of the plan once more.",
)
@odds_options
@output_option(
    "FILE.json",
    "Write the best plans with their certificates; with --optimise: the policy, for `ntagen drive "
    "--policy`.",
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print a line each time that more is known, a JSON object, and nothing else.",
)
@include_option()
def command(
    source: Path,
    count: int,
    budget_s: float | None,
    ranking: str | None,
    aim: Aim | None,
    wanted: Wanted,
    output: Path | None,
    as_json: bool,
    include: tuple[Path, ...],
) -> int:
    """Find the best plans of a task: the first one at once, then better ones.

    Unlike `ntagen check --plans`, this does not list all plans: their number grows with the power
    of the number of rolls. For each criterion of the ranking it says how good a plan can be,
    and whether the best plan is that good.

    \b
    Examples:
      ntagen plan examples/paper.nsl
      ntagen plan examples/paper.nsl --best 10 --within 5s -o plans.json
      ntagen plan examples/paper.nsl --rank length,clearance
      ntagen plan examples/chance/chance.nsl --rank probability --best 5
      ntagen plan examples/chance/chance.nsl --optimise probability -o t.policy.json

    \b
    In a tissue with chance (tissue stochastic), random runs say of the best plans how likely the
    tip reaches the target with nothing touched, how likely it touches a critical region, and how
    near it comes to one in the mean, each with its interval. The plan is done open loop.

    \b
    Each JSON object has verdict (found, none, unknown), seconds, engine_seconds, looked_at (plans),
    limits (of each criterion: no plan is better), is_complete (no plan that is not listed is as
    good as the last one), plans (as in the file of -o), is_final. Where runs were made, each of the
    last plans has chance: reach, touch, clearance_mm (value, lower, upper, confidence, runs), and
    is_apart (whether it is less probable than the best one).

    \b
    With --optimise there is one JSON object: verdict, optimised, plan, is_silent (the policy is not
    better than the plan, so it never differs from it), is_better, guard (what decided that), aims
    (for each aim plan, policy and difference, with value, lower, upper), learning_runs, seconds.
    """  # noqa: D301  click wants the control character
    from ntagen.drive.configure import configure
    from ntagen.drive.settings import engine_for
    from ntagen.plan.anytime import best_plans
    from ntagen.plan.rank import split_ranking

    if output is not None:
        require_apart({"-o": output}, {"source": source})
    by_odds, criteria = (False, None) if ranking is None else split_ranking(ranking)
    task = load_task(source, include)
    if aim is not None:
        from ntagen.cli.needle.optimise import optimise

        say_idle({"count": "--best", "ranking": "--rank"}, "with --optimise")
        return optimise(task, aim, wanted, budget_s, output, as_json=as_json)
    wanted = wanted.checked(task.scene, count, by_odds=by_odds)
    settings = configure(task.given, task.scene).settings
    settings = settings if criteria is None else replace(settings, ranking=criteria)
    engine = replace(engine_for(settings), ranking=settings.ranking)
    shown: Best | None = None
    found: tuple[Rated, ...] = ()
    for best in best_plans(
        task.scene,
        engine,
        clock=time.monotonic,
        count=wanted.looked_for,
        budget_s=BUDGET_S if budget_s is None else budget_s,
    ):
        if not as_json:
            _show_better(best, shown)
        shown = best
        if best.is_final:
            found = rate(best.candidates, task.scene, wanted)
            kept = [one.candidate for one in found] or best.candidates
            shown = replace(best, candidates=tuple(kept[:count]))
        if as_json:
            echo(json.dumps(_record(shown, task.scene, settings, found)))
    if shown is None:
        raise AssertionError("the last value is always given")
    if output is not None and shown.candidates:
        document = _document(shown, task.scene, settings, found)
        write_files({output: json.dumps(document, indent=1) + "\n"})
    if not as_json:
        _show_final(shown, task.scene, settings, count, (found, wanted))
        if output is not None and shown.candidates:
            echo(f"plans written to {output}")
    return {"found": 0, "none": 1, "unknown": STOPPED}[shown.verdict]


def _document(
    best: Best, scene: Scene, settings: Settings, found: tuple[Rated, ...]
) -> dict[str, object]:
    from ntagen.plan.document import document

    plans = document(scene, best.candidates, settings.ranking, settings.margins)
    return with_odds(plans, found[: len(best.candidates)])


def _record(
    best: Best, scene: Scene, settings: Settings, found: tuple[Rated, ...]
) -> dict[str, object]:
    from ntagen.plan.anytime import goodness

    return {
        "verdict": best.verdict,
        "seconds": best.seconds,
        "engine_seconds": best.engine_seconds,
        "looked_at": best.looked_at,
        "limits": {name: goodness(name, limit) for name, limit in best.limits.items()},
        "is_complete": best.is_complete,
        "plans": _document(best, scene, settings, found)["plans"],
        "is_final": best.is_final,
    }


def _show_better(best: Best, before: Best | None) -> None:
    """Prints a plan that is better than the one before."""
    from ntagen.plan.wording import clearance_of

    last = before.candidates[:1] if before is not None else ()
    if best.candidates[:1] == last:
        return
    plan, certificate = best.candidates[0].plan, best.candidates[0].certificate
    rolls = "1 roll" if certificate.roll_count == 1 else f"{certificate.roll_count} rolls"
    facts = [clearance_of(certificate), rolls, f"{certificate.length_mm:g} mm long"]
    word = "better" if last else "found"
    echo(f"{1000 * best.seconds:6.0f} ms  {word}: {', '.join(filter(None, facts))}: {plan}")


def _show_final(
    best: Best,
    scene: Scene,
    settings: Settings,
    count: int,
    by_odds: tuple[tuple[Rated, ...], Wanted],
) -> None:
    """Prints the best plans, and how good plans can be."""
    from ntagen.plan.wording import bounded, judged, ranked_by, required

    found, wanted = by_odds

    spent = f"{best.seconds:.2f} s, {1000 * best.engine_seconds:.0f} ms of it in the engine"
    if best.verdict == "none":
        echo(f"no plan: it is proved that the model has none that holds ({spent})")
        echo(required(settings.margins))
        return
    if best.verdict == "unknown":
        echo(f"unknown: the budget ended before a plan was found, or proved not to exist ({spent})")
        echo("hint: give more time with --within")
        return
    if wanted.by_odds:
        order = ranked_by(settings.ranking).removeprefix("best first: ")
        echo(f"compared: the {len(found)} best plans {order}")
    else:
        for line in bounded(best, settings.ranking, scene):
            echo(line)
    if count > 1 and not wanted.by_odds:
        echo(f"{ranked_by(settings.ranking)}:")
        for place, candidate in enumerate(best.candidates, start=1):
            verdict = judged(candidate.certificate, settings.margins)
            echo(f"  {place:>3}. {verdict}  {candidate.plan}")
        if not best.is_complete:
            echo("there may be others that are as good as the last of them")
    for line in odds_lines(found, count, by_odds=wanted.by_odds):
        echo(line)
    plans = "1 plan" if best.looked_at == 1 else f"{best.looked_at} plans"
    echo(f"{plans} looked at in {spent}")
