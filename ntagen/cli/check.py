"""`ntagen check`: the answers to the queries of a model or an environment."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli import INTERNAL_ERROR, with_severity
from ntagen.cli.former_options import Renamed
from ntagen.cli.guard import current, doing, guarded
from ntagen.cli.loading import load_model, pointing_to_explanations, show_warnings
from ntagen.cli.models.answer_formats import FORMATS
from ntagen.cli.models.answer_rows import Format
from ntagen.cli.models.evidence import Outputs, Questions, backed
from ntagen.cli.models.idle_options import idle_options, unwritten
from ntagen.cli.models.options import SETTINGS, engine_options
from ntagen.cli.models.outcomes import Outcome, exit_code
from ntagen.cli.models.plan_lists import LINES, ListLimits
from ntagen.cli.models.policies import NamedAgent, follow_agents, policy_option
from ntagen.cli.models.queries import is_used_by, queries_of, with_strategies
from ntagen.cli.models.spread_runs import Spreading, joint_answers
from ntagen.cli.options import (
    constant_option,
    external_option,
    include_option,
    overflow_rule,
    path_argument,
    path_option,
)
from ntagen.cli.progress import progress_of, say_interrupted
from ntagen.cli.settings import settings_option
from ntagen.cli.signals import LimitReached
from ntagen.cli.terminal import echo, given_options, say
from ntagen.errors import InputError
from ntagen.files import require_apart
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Answer, Options
    from ntagen.cli.models.queries import Asked
    from ntagen.loading import Loaded

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
@path_argument("model_path", metavar="MODEL")
@path_argument("second_path", metavar="[FILE.q]", required=False)
@click.option(
    "--query",
    "asked",
    metavar="TEXT|NAME",
    multiple=True,
    help="A query, or the name of a query of the model. You can give this option several times.  "
    "[default: all queries of the model]",
)
@path_option(
    "--queries",
    "query_file",
    metavar="FILE.q",
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
    type=click.Choice(list(FORMATS)),
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
@path_option(
    "--certificate",
    metavar="FILE",
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
@policy_option()
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
    policies: tuple[NamedAgent, ...],
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
      ntagen check game.xml --policy Agent=PPO:agent.zip --query "Pr[<=10](<> Main.Won) under Agent"
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
    is_human = _is_human(form, as_json=as_json)
    _require_one_output(
        {"--strategy": strategy, "--plans": plans, "--trace": trace},
        "" if is_human else "--json" if as_json else f"--format {form}",
    )
    if second_path and query_file:
        raise click.UsageError(f"two files of queries: {query_file} and {second_path}; give one")
    settings = dict(settings)
    joint, dask = settings.pop("joint", False), settings.pop("dask", None)
    criteria = _criteria(settings.pop("ranking", None))
    outputs = Outputs(trace, certificate, strategy, plans, criteria)
    query_path = query_file or second_path
    inputs = {"model": model_path} | ({"queries": query_path} if query_path else {})
    require_apart(outputs.wanted(), inputs)
    options = _options(outputs, given, settings)
    printed = FORMATS["json" if as_json else form or "human"]
    shown = printed(model_path, trace_is_written=trace is not None)
    with _rejections_in(shown), pointing_to_explanations(is_human):
        with doing("loading the model"):
            loaded = load_model(model_path, include, overflow, constants, allow_external)
        todo = _queries(loaded, asked, query_path, [one.name for one in policies])
        if expect == "file" and not any(query.expected is not None for query in todo):
            raise InputError(_NOTHING_EXPECTED)
        forms = [query.form for query in todo if query.form]
        with doing("loading policies"):
            say(follow_agents(loaded.model, policies, forms))
    questions = _questions_about(loaded)
    values = click.get_current_context().params | settings
    named = given_options()
    say(idle_options(named, values, forms, ranks=questions.ranks_plans))
    spreading = Spreading(dask, todo, options, _why_not_spread(joint, allow_external, policies))
    shown.loaded(loaded.model)
    together = (
        joint_answers(loaded.model, todo, options, named, quiet=not is_human) if joint else {}
    )
    run = _Run(questions, options, named, outputs, spreading, shown, expect, not is_human)
    try:
        outcomes = run.outcomes(todo, together)
    except _WrongEvidenceError as wrong:
        echo(str(wrong), err=True)
        return INTERNAL_ERROR
    shown.end(outcomes)
    if not any(one.stop for one in outcomes):
        # Where a limit came first, its note has said it.
        say(unwritten(outputs.wanted(), outputs.written))
    return exit_code(outcomes)


def _questions_about(loaded: Loaded) -> Questions:
    """How the queries of what is loaded are asked: of a task, as those of its plans."""
    if loaded.task is None:
        return Questions(loaded.model)
    from ntagen.cli.needle.task_questions import TaskQuestions

    return TaskQuestions(loaded.model, loaded.task)


def _options(outputs: Outputs, given: dict[str, Any], settings: dict[str, Any]) -> Options:
    """How all queries are to be answered."""
    from ntagen.checker import Options

    wants_trace = given["verify"] or outputs.trace is not None or "wanted_trace" in settings
    options = Options(
        plans="all" if outputs.plans else "none",
        trace=wants_trace,
        certificate=outputs.certificate is not None,
        **{name: value for name, value in given.items() if value is not None},
    )
    if outputs.plans and Path(outputs.plans).suffix == LINES:
        # Any number of them, if they are written on lines: they take no memory.
        options = replace(options, max_plans=sys.maxsize)
    return replace(options, **settings)


def _queries(
    loaded: Loaded, asked: Sequence[str], path: Path | None, policies: Collection[str]
) -> list[Asked]:
    """The queries to answer; prints the warnings about them."""
    shown_already = len(loaded.model.warnings)
    todo = with_strategies(loaded.model, queries_of(loaded.model, asked, path), policies)
    show_warnings(loaded.model.warnings[shown_already:])
    # The generated model is no file of the user's.
    return [replace(one, place=None) for one in todo] if loaded.task else todo


class _WrongEvidenceError(Exception):
    """A strategy or a trace has failed its check."""


@dataclass(frozen=True, slots=True)
class _Run:
    """How queries are answered, one after the other."""

    questions: Questions
    options: Options
    given: Collection[str]
    """The options and settings on the command line, which win over those of a file."""
    outputs: Outputs
    spreading: Spreading
    shown: Format
    expect: str | None
    quiet: bool

    def _expected(self, query: Asked) -> Outcome:
        """The outcome without an answer, with what is expected."""
        expected = _EXPECTED.get(self.expect, query.expected) if self.expect else None
        return Outcome(query, None, is_compared=self.expect is not None, expected=expected)

    def outcomes(
        self, queries: Sequence[Asked], known: Mapping[int, Answer | InputError]
    ) -> list[Outcome]:
        """What becomes of the queries; those of random runs that are ended are the last.

        Args:
            queries: The queries.
            known: Answers that were found together, by the places of their queries.

        Raises:
            _WrongEvidenceError: The evidence for an answer failed its check.
        """
        from ntagen.checker import Interrupted

        found: list[Outcome] = []
        for number, query in enumerate(queries):
            later = queries[number + 1 :]
            try:
                found.append(self._outcome(query, known.get(number), is_used_by(query, later)))
            except Interrupted as interrupted:
                # The runs until then say something, and that is what the user gets.
                found.append(replace(self._expected(query), answer=interrupted.answer))
                say_interrupted(query.text, len(later))
                self.shown.one(found[-1])
                break
        return found

    def _outcome(self, query: Asked, known: Answer | InputError | None, is_used: bool) -> Outcome:
        """What becomes of a query, which is shown at once.

        Args:
            query: The query.
            known: Its answer, if it was found together with others.
            is_used: Whether a later query is under its strategy.

        Raises:
            Interrupted: The user has ended random runs.
            _WrongEvidenceError: The evidence for the answer failed its check.
        """
        guard = current()
        guard.next_query()
        outcome, left_s = self._expected(query), guard.left_s()
        limits = ListLimits(left_s, self.options.memory_bytes, quiet=self.quiet)
        outputs = replace(self.outputs, limits=limits)
        try:
            answer = self._answer(query, known, is_used, left_s)
            guard.has_answer()
        except LimitReached as reached:
            return _shown(self.shown, outcome.stopped(reached))
        except InputError as error:
            # The other queries may be right, and the user wants their answers.
            outcome = replace(outcome, refusal=with_severity(str(error)))
            self.shown.one(outcome)
            return outcome
        if answer.verified is False:
            raise _WrongEvidenceError("\n".join([query.text, *answer.verification]))
        show_warnings(answer.warnings)
        outcome = replace(outcome, answer=answer)
        outcome = backed(outcome, outputs, self.questions, verify=self.options.verify)
        return _shown(self.shown, self.questions.completed(outcome, outputs))

    def _answer(
        self, query: Asked, known: Answer | InputError | None, is_used: bool, left_s: float | None
    ) -> Answer:
        """The answer to a query.

        Raises:
            InputError: The query is wrong.
            LimitReached: A limit came first.
        """
        if isinstance(known, InputError):
            raise known
        if known is not None:
            return known
        fields: dict[str, Any] = {"timeout_s": left_s, "folder": query.folder}
        fields["strategy"] = is_used or self.outputs.strategy is not None
        if query.options:
            from ntagen.verifyta.options import of_model

            fields |= of_model(query.options, self.given)
        fields |= self.questions.options(query, self.options)
        wanted = replace(self.options, **fields)
        model = self.questions.model
        with (
            doing(f"the search for the answer to {query.text.strip()}"),
            self.spreading.source(model, query, wanted) as source,
            progress_of(query.text, query.form, quiet=self.quiet) as reports,
        ):
            return self.questions.answer(query, replace(wanted, **reports, **source))


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


def _why_not_spread(
    joint: bool, allow_external: Sequence[Path], policies: Sequence[NamedAgent]
) -> str:
    """Why no cluster can make the runs of these queries; empty if one can."""
    if joint:
        return "queries that are answered jointly share their runs"
    if policies:
        return "policies decide on this machine only"
    return "libraries are loaded by this machine only" if allow_external else ""


@contextlib.contextmanager
def _rejections_in(shown: Format) -> Iterator[None]:
    """Also puts the rejection of a model or a list of queries into the output."""
    try:
        yield
    except (InputError, LimitReached) as error:
        shown.refused(str(error))
        raise


def _criteria(text: str | None) -> tuple[str, ...]:
    """The ranking on the command line; empty without one."""
    if text is None:
        return ()
    from ntagen.plan.rank import parse_ranking

    return parse_ranking(text)
