"""`ntagen check`: the answers to the queries of a model or an environment."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli import INTERNAL_ERROR
from ntagen.cli.against import answer_of, defence_notes
from ntagen.cli.answer_formats import FORMATS, Format, GitHub, JsonLines, JUnit, Sarif
from ntagen.cli.answer_rows import Human
from ntagen.cli.asked import is_used_by, queries_of, with_strategies
from ntagen.cli.effects import given_options, idle_options, say, unwritten
from ntagen.cli.evidence import Outputs, backed
from ntagen.cli.former_options import Renamed
from ntagen.cli.guard import current, doing, guarded
from ntagen.cli.joint import joint_answers
from ntagen.cli.models import (
    constant_option,
    external_option,
    include_option,
    load_model,
    pointing_to_explanations,
    show_warnings,
)
from ntagen.cli.options import SETTINGS, engine_options
from ntagen.cli.outcomes import Outcome, exit_code
from ntagen.cli.questions import answered, for_task, list_limits, most_plans
from ntagen.cli.rules import overflow_rule
from ntagen.cli.run_progress import progress_of, say_interrupted
from ntagen.cli.settings import settings_option
from ntagen.cli.signals import LimitReached
from ntagen.cli.spreading import Spreading
from ntagen.cli.terminal import echo
from ntagen.errors import InputError
from ntagen.files import require_apart

if TYPE_CHECKING:
    from ntagen.checker import Answer, QueryForm

_EXPECTED: Final = {"yes": "satisfied", "no": "not satisfied"}
"""What ``--expect`` says about all queries; ``file`` stands for what the file says of each."""


class _CheckCommand(Renamed):
    """The word after ``--expect`` belongs to it only if it is one of its values."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        joined: list[str] = []
        for word in args:
            if joined and joined[-1] == "--expect" and word in (*_EXPECTED, "file"):
                joined[-1] = f"--expect={word}"
            else:
                joined.append(word)
        return super().parse_args(
            ctx, ["--expect=file" if word == "--expect" else word for word in joined]
        )


@click.command(
    "check",
    cls=_CheckCommand,
    former={
        "--shortest": "write --set 'trace shortest'",
        "--fastest": "write --set 'trace fastest'",
        "--controller": "write --strategy {}",
    },
    epilog="Exit codes: 0 every query is satisfied (with --expect: as expected), 1 some are not, "
    "2 the input is rejected (the other queries are still answered), 3 stopped by a limit (the "
    "answer, its check, or what should be written), or the verdict is maybe, 4 run-time error in "
    "the model, 70 internal error (also if a strategy or "
    "trace fails its check), 130 interrupted (the counters so far are printed; random runs until "
    "then are an answer, with 3), 141 nobody reads the output any more, 143 ended by SIGTERM.",
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
    "--expect",
    metavar="[yes|no|file]",
    type=click.Choice(["yes", "no", "file"]),
    help="Compare the answers with what is expected: each as the file says (--expect), or all "
    "satisfied (--expect yes), or none (--expect no). A file says it by <expect> or <result> in "
    "XML, or by a comment of the query such as // EXPECT:T or // false.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(FORMATS),
    help="How answers are printed: for people (human), one JSON object on a line for each query "
    "(json), annotations of GitHub Actions (github), or a report for CI (junit, sarif).  "
    "[default: human]",
)
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="The same as --format json.",
)
@click.option(
    "--trace",
    metavar="FILE|-",
    help="Write the trace that shows why: a witness or a counterexample. - is standard output. "
    "With several queries, FILE has the trace of the last query that has one.",
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
    "environment prevents it. FILE.json is JSON for tools, FILE.c is a controller in C99 without "
    "dependencies, any other FILE is text as UPPAAL TIGA prints it; - is standard output. With "
    "several control queries, FILE has the last strategy.",
)
@click.option(
    "--plans",
    metavar="FILE.json|FILE.jsonl|-",
    help="Write all plans of a control query to FILE, or list them (-); with several, FILE has "
    "those of the last. Plans of an environment are also ranked, certified and marked if they hold "
    "in exact kinematics. FILE.jsonl has one plan on each line, in the order of the model: it is "
    "written while the plans are certified, and millions of them take no memory.",
)
@engine_options
@settings_option(SETTINGS, "levels Queue.length")
@overflow_rule()
@constant_option()
@include_option()
@external_option()
@guarded
def command(
    model_path: Path,
    second_path: Path | None,
    asked: tuple[str, ...],
    query_file: Path | None,
    expect: str | None,
    form: str | None,
    as_json: bool,
    trace: str | None,
    certificate: Path | None,
    strategy: str | None,
    plans: str | None,
    given: dict[str, Any],
    settings: dict[str, Any],
    overflow: Any,  # noqa: ANN401  click gives a str where the engine wants literals
    constants: dict[str, str],
    include: tuple[Path, ...],
    allow_external: tuple[Path, ...],
) -> int:
    """Answer the queries of a model or an environment.

    MODEL is an environment (.nsl) or a UPPAAL model (.xml, .xta).

    \b
    Examples:
      ntagen check examples/paper.nsl --plans plans.json
      ntagen check many.nsl --plans plans.jsonl --timeout 10min
      ntagen check model.xml --query "E<> Gate.Open" --trace -
      ntagen check model.xml model.q --json --timeout 60s
      ntagen check model.xml --expect
      ntagen check model.xml --expect --format junit > report.xml
      ntagen check game.xml --query "control: A<> Main.Won" --verify --strategy -
      ntagen check game.xml --query "control: A[] not Main.Lost" --strategy safe.c
      ntagen check game.xml --query "{Gate.Shut, x >= 2} control: A<> Main.Won" --strategy -
      ntagen check game.xml --query "strategy Safe = control: A[] not Main.Lost" \\
                            --query "control: A<> Main.Won under Safe" --strategy -
      ntagen check model.xml --query "bounds{Gate.Open}: x"
      ntagen check model.xml --query "E<> Gate.Open" --trace open.json --set "trace fastest"
      ntagen check model.xml --query "A[] not deadlock" --certificate safe.jsonl
      ntagen check model.xml --query "Pr[<=10](<> Queue.Full)" --set "relative 0.1"
      ntagen check model.xml --query "Pr[<=10](<> Queue.Full)" --set "levels Queue.length"
      ntagen check model.xml --query "Pr[<=10](<> Queue.Full)" --set "dask tcp://head:8786"

    \b
    A trace is a run with exact times, which an independent replay has checked. Each step says when
    it is, its edges, and only what it changes. A file that ends in .json has all states, and the
    symbolic ones too.
    FILE.xtr and FILE.xml are traces as UPPAAL writes them.

    \b
    The value of sup and inf is a number, or "inf" if the clock has no limit. The value of bounds is
    the pair of both. For several items it is the list of their values. It is null if no reachable
    state satisfies the condition. If a clock comes near the value but never reaches it, the message
    says so.
    """  # noqa: D301  click wants the control character
    from ntagen.checker import Interrupted, Options
    from ntagen.verifyta.statistical import of_model

    is_human = _is_human(form, as_json=as_json)
    _require_one_output(
        {"--strategy": strategy, "--plans": plans, "--trace": trace},
        "" if is_human else "--json" if as_json else f"--format {form}",
    )
    if second_path and query_file:
        raise click.UsageError(f"two files of queries: {query_file} and {second_path}; give one")
    settings = dict(settings)
    joint, criteria = settings.pop("joint", False), _criteria(settings.pop("ranking", None))
    dask = settings.pop("dask", None)
    outputs = Outputs(trace, certificate, strategy, plans, criteria)
    query_path = query_file or second_path
    inputs = {"model": model_path} | ({"queries": query_path} if query_path else {})
    require_apart(outputs.wanted(), inputs)
    verify = given["verify"]
    options = Options(
        plans="all" if plans else "none",
        trace=verify or trace is not None or "wanted_trace" in settings,
        certificate=certificate is not None,
        **{name: value for name, value in given.items() if value is not None},
        **most_plans(plans) | settings,
    )
    shown = _format("json" if as_json else form or "human", trace_is_written=trace is not None)
    outcomes: list[Outcome] = []
    guard = current()
    with _rejections_in(shown, model_path), pointing_to_explanations(is_human):
        with doing("loading the model"):
            loaded = load_model(model_path, include, overflow, constants, allow_external)
        shown_already = len(loaded.model.warnings)
        todo = with_strategies(loaded.model, queries_of(loaded.model, asked, query_path))
        if loaded.task is not None:
            # The generated model is no file of the user's.
            todo = [replace(query, place=None) for query in todo]
        show_warnings(loaded.model.warnings[shown_already:])
        if expect == "file" and not any(query.expected is not None for query in todo):
            raise InputError(_NOTHING_EXPECTED)
    _say_idle_options(
        [query.form for query in todo if query.form], is_environment=loaded.task is not None
    )
    spreading = Spreading(dask, todo, options, _why_not_spread(joint, allow_external))
    shown.loaded(model_path, loaded.model)
    together = joint_answers(loaded.model, todo, options, quiet=not is_human) if joint else {}
    for number, query in enumerate(todo):
        guard.next_query()
        is_used = is_used_by(query, todo[number + 1 :])
        options = replace(options, timeout_s=guard.left_s())
        outputs = replace(outputs, limits=list_limits(options, quiet=not is_human))
        wanted = replace(
            options,
            strategy=is_used or outputs.wants_strategy,
            folder=query.folder,
            **of_model(query.options, given_options()),
            **for_task(options, loaded.task, query),
        )
        expected = _EXPECTED.get(expect, query.expected) if expect else None
        outcome = Outcome(query, None, is_compared=expect is not None, expected=expected)
        try:
            if number in together:
                answer, found = _unless_wrong(together[number]), None
            else:
                with (
                    doing(f"the search for the answer to {query.text.strip()}"),
                    spreading.source(loaded.model, query, wanted) as source,
                    progress_of(query.text, query.form, quiet=not is_human) as reports,
                ):
                    wanted = replace(wanted, **reports, **source)
                    answer, found = answered(loaded, query, wanted, overflow)
            guard.has_answer()
        except Interrupted as interrupted:
            # The runs until then say something, and that is what the user gets.
            outcomes.append(replace(outcome, answer=interrupted.answer))
            say_interrupted(query.text, len(todo) - number - 1)
            shown.one(outcomes[-1])
            break
        except LimitReached as reached:
            outcomes.append(_shown(shown, outcome.stopped(reached)))
            continue
        except InputError as error:
            # The other queries may be right, and the user wants their answers.
            outcomes.append(replace(outcome, refusal=_with_severity(str(error))))
            shown.one(outcomes[-1])
            continue
        if answer.verified is False:
            echo("\n".join([query.text, *answer.verification]), err=True)
            return INTERNAL_ERROR
        show_warnings(answer.warnings)
        outcome = backed(replace(outcome, answer=answer), outputs, loaded, verify=verify)
        if found is not None:
            notes = (*outcome.notes, *defence_notes(found, plans))
            outcome = replace(outcome, answer=answer_of(found), notes=notes)
            outputs.written.add("--plans")
        outcomes.append(_shown(shown, outcome))
    shown.end(outcomes)
    _say_unwritten(outputs, outcomes)
    return exit_code(outcomes)


def _say_unwritten(outputs: Outputs, outcomes: Sequence[Outcome]) -> None:
    """Says which outputs no answer gave; where a limit came first, its note has said it."""
    if not any(one.stop for one in outcomes):
        say(unwritten(outputs.wanted(), outputs.written))


def _shown(shown: Format, outcome: Outcome) -> Outcome:
    """An outcome that is shown; if a limit ends that, at least what has become of it."""
    try:
        with doing("printing the answer"):
            shown.one(outcome)
        return outcome
    except LimitReached as reached:
        stopped = outcome.stopped(reached)
        shown.one(stopped)
        return stopped


_NOTHING_EXPECTED: Final = (
    "no query says what is expected\n"
    "hint: write // false above a query of a .q file, or give --expect yes or --expect no"
)


def _is_human(form: str | None, *, as_json: bool) -> bool:
    """Whether answers are printed for people."""
    if as_json and form not in (None, "json"):
        raise click.UsageError(f"--json and --format {form} exclude each other; give one")
    return not as_json and form in (None, "human")


def _require_one_output(targets: Mapping[str, str | None], option_given: str) -> None:
    """Refuses options that write to standard output beside answers for programs."""
    for option, target in targets.items():
        if option_given and target == "-":
            raise click.UsageError(
                f"{option_given} and {option} - both write to standard output; give {option} a FILE"
            )


def _why_not_spread(joint: bool, allow_external: Sequence[Path]) -> str:
    """Why no cluster can make the runs of these queries; empty if one can."""
    if joint:
        return "queries that are answered jointly share their runs"
    return "libraries are loaded by this machine only" if allow_external else ""


def _unless_wrong(answer: Answer | InputError) -> Answer:
    """An answer that was found together with others.

    Raises:
        InputError: One of the queries is wrong.
    """
    if isinstance(answer, InputError):
        raise answer
    return answer


def _format(name: str, *, trace_is_written: bool) -> Format:
    """How answers are printed."""
    if name == "human":
        return Human(trace_is_written=trace_is_written)
    formats: dict[str, Callable[[], Format]] = {
        "json": JsonLines,
        "github": GitHub,
        "junit": JUnit,
        "sarif": Sarif,
    }
    return formats[name]()


@contextlib.contextmanager
def _rejections_in(shown: Format, path: Path) -> Iterator[None]:
    """Also puts the rejection of a model or a list of queries into the output."""
    try:
        yield
    except (InputError, LimitReached) as error:
        shown.refused(path, str(error))
        raise


def _with_severity(rejection: str) -> str:
    """A rejection with "error: " before it, unless its first line has the word already."""
    first = rejection.partition("\n")[0]
    return rejection if re.search(r"\berror\b", first) else f"error: {rejection}"


def _criteria(text: str | None) -> tuple[str, ...]:
    """The ranking on the command line; empty without one."""
    if text is None:
        return ()
    from ntagen.plan.rank import parse_ranking

    return parse_ranking(text)


def _say_idle_options(queries: Sequence[QueryForm], *, is_environment: bool) -> None:
    """Says which options of the command line have no effect."""
    values = click.get_current_context().params
    say(idle_options(given_options(), values, queries, ranks=is_environment))
