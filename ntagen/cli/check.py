"""`ntagen check`: the answers to the queries of a model or an environment."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli import INTERNAL_ERROR
from ntagen.cli.against import answer_of, defence_notes
from ntagen.cli.asked import Asked, is_used_by, queries_of
from ntagen.cli.effects import given_options, idle_options, say, unwritten
from ntagen.cli.evidence import Outputs, write_evidence
from ntagen.cli.models import (
    include_option,
    load_model,
    pointing_to_explanations,
    rank_option,
    show_warnings,
    with_pointer,
)
from ntagen.cli.options import engine_options
from ntagen.cli.progress import shown_progress
from ntagen.cli.questions import answered, for_task, list_limits, most_plans
from ntagen.cli.rules import overflow_rule
from ntagen.cli.terminal import Styled, echo
from ntagen.errors import InputError
from ntagen.files import require_apart

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model, QueryForm

STOPPED: Final = 3
"""Exit code after a limit or a ``maybe``."""

MODEL_ERROR: Final = 4
"""Exit code after a run-time error in the model."""

_MARK: Final = {
    "satisfied": ("yes", "green"),
    "not satisfied": ("no", "red"),
    "maybe": ("maybe", "yellow"),
    "unknown": ("stopped", "yellow"),
    "error": ("error", "red"),
}


REJECTED_MARK: Final = ("refused", "red")
"""The mark of a query that is rejected while others are answered."""


@click.command(
    "check",
    epilog="Exit codes: 0 every query is satisfied, 1 some are not, 2 the input is rejected "
    "(the other queries are still answered), 3 stopped by a limit, or the verdict is maybe, "
    "4 run-time error in the model, 70 internal error (also if a strategy or trace fails its "
    "check), 130 interrupted (the counters so far are printed), 143 ended by SIGTERM.",
)
@click.argument("model_path", metavar="MODEL", type=click.Path(path_type=Path))
@click.argument("second_path", metavar="[FILE.q]", required=False, type=click.Path(path_type=Path))
@click.option(
    "--query",
    "asked",
    metavar="TEXT|NAME",
    multiple=True,
    help="A query, or the name of a query of the model. You can give this option several times.  "
    "[default: all queries of the model]",
)
@click.option(
    "--queries",
    "query_file",
    metavar="FILE.q",
    type=click.Path(path_type=Path),
    help="A file of queries; they are answered instead of the model's own. You can also write the "
    "file after MODEL, without --queries.",
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print one line for each query, a JSON object, and nothing else.",
)
@click.option(
    "--trace",
    metavar="FILE|-",
    help="Write the trace that shows why: a witness or a counterexample. - is standard output. "
    "With several queries, FILE has the trace of the last query that has one.",
)
@click.option(
    "--shortest",
    "wanted_trace",
    flag_value="shortest",
    help="Write the trace with the fewest transitions. If a run never ends, its loop counts once.",
)
@click.option(
    "--fastest",
    "wanted_trace",
    flag_value="fastest",
    help="Write the trace that takes the least time. Not for E[], A<> and -->: their runs do not "
    "end.",
)
@click.option(
    "--certificate",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Write the set of all reached states, for `ntagen verify`. Only an E<> that is not "
    "satisfied and an A[] that is satisfied have one. With several of them, FILE has that of the "
    "last.",
)
@click.option(
    "--strategy",
    metavar="FILE|-",
    help="Write the winner's strategy of a control query: how the controller wins, or how the "
    "environment prevents it. FILE.json is JSON for tools; any other FILE is text as UPPAAL TIGA "
    "prints it; - is standard output. With several control queries, FILE has the last strategy.",
)
@click.option(
    "--controller",
    metavar="FILE.c",
    type=click.Path(path_type=Path),
    help="Write the same strategy as a controller in C99, in one file without dependencies.",
)
@click.option(
    "--plans",
    metavar="FILE.json|FILE.jsonl|-",
    help="Write all plans of a control query to FILE, or list them (-); with several, FILE has "
    "those of the last. Plans of an environment are also ranked, certified and marked if they hold "
    "in exact kinematics. FILE.jsonl has one plan on each line, in the order of the model: it is "
    "written while the plans are certified, and millions of them take no memory.",
)
@rank_option("plans of an environment")
@engine_options
@overflow_rule()
@include_option()
def command(
    model_path: Path,
    second_path: Path | None,
    asked: tuple[str, ...],
    query_file: Path | None,
    as_json: bool,
    trace: str | None,
    wanted_trace: Any,  # noqa: ANN401  click gives a str where the engine wants literals
    certificate: Path | None,
    strategy: str | None,
    controller: Path | None,
    plans: str | None,
    ranking: str | None,
    given: dict[str, Any],
    overflow: Any,  # noqa: ANN401
    include: tuple[Path, ...],
) -> int:
    """Answer the queries of a model or an environment.

    MODEL is an environment (.nsl) or a UPPAAL model (.xml, .xta).

    \b
    Examples:
      ntagen check examples/paper.nsl --plans plans.json
      ntagen check many.nsl --plans plans.jsonl --timeout 10min
      ntagen check model.xml --query "E<> Gate.Open" --trace -
      ntagen check model.xml model.q --json --timeout 60s
      ntagen check game.xml --query "control: A<> Main.Won" --verify --strategy -
      ntagen check game.xml --query "control: A[] not Main.Lost" --controller safe.c
      ntagen check game.xml --query "{Gate.Shut, x >= 2} control: A<> Main.Won" --strategy -
      ntagen check game.xml --query "strategy Safe = control: A[] not Main.Lost" \\
                            --query "control: A<> Main.Won under Safe" --strategy -
      ntagen check model.xml --query "bounds{Gate.Open}: x"
      ntagen check model.xml --query "E<> Gate.Open" --fastest --trace open.json
      ntagen check model.xml --query "A[] not deadlock" --certificate safe.jsonl

    \b
    A trace has two parts: symbolic states as UPPAAL prints them, and a run with exact times, which
    an independent replay has checked. A file that ends in .json has both parts as JSON.

    \b
    The value of sup and inf is a number, or "inf" if the clock has no limit. The value of bounds is
    the pair of both. For several items it is the list of their values. It is null if no reachable
    state satisfies the condition. If a clock comes near the value but never reaches it, the message
    says so.
    """  # noqa: D301  click wants the control character
    from ntagen.checker import Options

    for option, target in (("--strategy", strategy), ("--plans", plans)):
        if as_json and target == "-":
            raise click.UsageError(
                f"--json and {option} - both write to standard output; give {option} a FILE"
            )
    if second_path and query_file:
        raise click.UsageError(f"two files of queries: {query_file} and {second_path}; give one")
    criteria = _criteria(ranking)
    outputs = Outputs(trace, certificate, strategy, controller, plans, criteria)
    query_path = query_file or second_path
    inputs = {"model": model_path} | ({"queries": query_path} if query_path else {})
    require_apart(outputs.wanted(), inputs)
    verify = given["verify"]
    options = Options(
        plans="all" if plans else "none",
        trace=verify or trace is not None or wanted_trace is not None,
        wanted_trace=wanted_trace or "any",
        certificate=certificate is not None,
        **given | most_plans(plans),
    )
    worst = 0
    with pointing_to_explanations(not as_json):
        loaded = load_model(model_path, include, overflow)
        shown_already = len(loaded.model.warnings)
        todo = queries_of(loaded.model, asked, query_path)
        show_warnings(loaded.model.warnings[shown_already:])
        _say_idle_options(
            [query.form for query in todo if query.form], is_environment=loaded.task is not None
        )
        if not as_json:
            _header(model_path, loaded.model)
        for number, query in enumerate(todo):
            is_used = is_used_by(query, todo[number + 1 :])
            outputs = replace(outputs, limits=list_limits(options, quiet=as_json))
            wanted = replace(
                options,
                strategy=is_used or outputs.wants_strategy,
                folder=query.folder,
                **for_task(options, loaded.task, query),
            )
            try:
                with shown_progress(query.text, quiet=as_json) as report:
                    answer, found = answered(
                        loaded, query, replace(wanted, progress=report), overflow
                    )
            except InputError as error:
                if len(todo) == 1:
                    raise
                # The other queries may be right, and the user wants their answers.
                echo(str(error) if as_json else with_pointer(str(error)), err=True)
                if not as_json:
                    _line(REJECTED_MARK, query)
                worst = InputError.exit_code
                continue
            if answer.verified is False:
                echo("\n".join([query.text, *answer.verification]), err=True)
                return INTERNAL_ERROR
            show_warnings(answer.warnings)
            covered = answer.verification if verify else ()
            notes = [*covered, *write_evidence(answer, query, outputs, loaded.task)]
            list_stop = outputs.stops.get(query.text)
            if found is not None:
                answer = answer_of(found)
                notes += defence_notes(found, plans)
                outputs.written.add("--plans")
            if as_json:
                echo(json.dumps(_record(answer, query, list_stop)))
            else:
                _row(answer, query, notes, trace_is_written=trace is not None)
            severity = max(_severity(answer), STOPPED if list_stop else 0)
            worst = max(worst, severity, key=_SEVERITIES.index)
    say(unwritten(outputs.wanted(), outputs.written))
    return worst


def _criteria(text: str | None) -> tuple[str, ...]:
    """The ranking on the command line; empty without one."""
    from ntagen.plan.rank import parse_ranking

    return () if text is None else parse_ranking(text)


def _say_idle_options(queries: Sequence[QueryForm], *, is_environment: bool) -> None:
    """Says which options of the command line have no effect."""
    values = click.get_current_context().params
    say(idle_options(given_options(), values, queries, ranks=is_environment))


_SEVERITIES: Final = (0, 1, STOPPED, MODEL_ERROR, InputError.exit_code)
"""Exit codes of single answers; the one that is last in this order decides."""


def _severity(answer: Answer) -> int:
    codes = {"satisfied": 0, "not satisfied": 1, "maybe": STOPPED, "unknown": STOPPED}
    return codes.get(answer.verdict, MODEL_ERROR)


def _record(answer: Answer, query: Asked, list_stop: str | None) -> dict[str, object]:
    """The answer as the JSON object that the command line promises."""
    return {
        "query": query.text,
        "name": query.name,
        "verdict": answer.verdict,
        "value": answer.value,
        "message": answer.message,
        "wrapped": None if answer.wrapped is None else asdict(answer.wrapped),
        "stop": answer.stop or list_stop,
        "explored": answer.explored,
        "stored": answer.stored,
        "seconds": answer.seconds,
        "load_seconds": answer.load_seconds,
        "peak_bytes": answer.peak_bytes,
        "plans": answer.plan_count,
    }


def _header(path: Path, model: Model) -> None:
    echo(f"{path}: loaded in {1000 * model.load_seconds:.1f} ms")


def _line(mark: tuple[str, str], query: Asked) -> None:
    """Prints the first line of a query's row: the verdict in its colour, and the query."""
    label = f"{query.name}: {query.text}" if query.name else query.text
    echo("  ", Styled(f"{mark[0]:<8}", fg=mark[1], bold=True), label)


def _row(answer: Answer, query: Asked, notes: Sequence[str], *, trace_is_written: bool) -> None:
    _line(_MARK[answer.verdict], query)
    facts = [f"{answer.explored} states explored", f"{answer.stored} stored"]
    facts.append(f"{1000 * answer.seconds:.1f} ms")
    facts.append(f"{answer.peak_bytes / 2**20:.1f} MiB")
    if answer.stop:
        facts.insert(0, f"stopped by the {answer.limit_text}")
    wrapped = []
    if answer.wrapped is not None and answer.verdict != "error":
        where = f"first at {answer.wrapped}"
        wrapped = [f"a result does not fit into 32 bits and wraps round, {where}"]
    way = [] if trace_is_written else _way_to_failure(answer)
    shown = [f"value: {json.dumps(answer.value)}"] if answer.value is not None else []
    for line in [
        *shown,
        ", ".join(facts),
        *([answer.message] if answer.message else []),
        *wrapped,
        *way,
        *notes,
    ]:
        echo(f"          {line}")


MOVES_SHOWN: Final = 12
"""The last transitions before a run-time error that are shown; ``--trace`` shows all."""


def _way_to_failure(answer: Answer) -> list[str]:
    """The trace to a run-time error in short: transitions, and the state in which it happens."""
    text = answer.trace_json() if answer.verdict == "error" else None
    trace = json.loads(text) if text is not None else {}
    if not trace.get("states"):
        return []
    moves, last = trace["transitions"], trace["states"][-1]
    steps = "step" if len(moves) == 1 else "steps"
    lines = [f"the way there, {len(moves)} {steps} (--trace - shows all states):"]
    if len(moves) > MOVES_SHOWN:
        lines.append(f"  … {len(moves) - MOVES_SHOWN} before")
    first = max(0, len(moves) - MOVES_SHOWN)
    lines += [f"  {first + 1 + i:>3}. {_move(move)}" for i, move in enumerate(moves[first:])]
    places = [f"{process}.{location}" for process, location in last["locations"].items()]
    values = [f"{name}={value}" for name, value in last["variables"].items()]
    lines.append("in the state")
    lines.append("  " + " ".join([*places, *values, *last["zone"]]))
    if "failing" in trace:
        lines += ["in the step", f"  {_move(trace['failing'])}"]
    return lines


def _move(edges: Sequence[dict[str, Any]]) -> str:
    """A transition on one line: the edges that are taken together."""
    return "  |  ".join(_edge(edge) for edge in edges)


def _edge(edge: dict[str, Any]) -> str:
    select = [f"{name}={value}" for name, value in edge["select"].items()]
    labels = "; ".join(
        label for label in (", ".join(select), edge["guard"], edge["sync"], edge["update"]) if label
    )
    arrow = f"{edge['process']}.{edge['source']} -> {edge['target']}"
    return f"{arrow}  {{ {labels} }}" if labels else arrow
