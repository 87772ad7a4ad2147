"""`ntagen drive`: steers a needle to the target, and logs the run."""

from __future__ import annotations

import contextlib
import functools
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.loading import load_task
from ntagen.cli.needle.answering_tissue import (
    Wanted,
    course_of,
    course_options,
    guarantee_of,
    maker,
    picks_at_random,
    say_idle_options,
)
from ntagen.cli.needle.operator import SignalledOperator, signalled_operator
from ntagen.cli.needle.optimise import load_policy
from ntagen.cli.needle.report import lines, report, summary
from ntagen.cli.needle.resume import (
    FoundTeller,
    Resumed,
    new_log,
    require_terminal,
    resume_option,
    resumed_of,
    tell_past,
)
from ntagen.cli.needle.runs import Run, exit_code, log_of, moved_by
from ntagen.cli.needle.steering import (
    known_option,
    say_idle_errors,
    say_idle_settings,
    settings_options,
    show_settings,
)
from ntagen.cli.needle.tracker import (
    opened,
    registration_option,
    tracker_option,
    tracking_of,
)
from ntagen.cli.options import include_option, path_argument, path_option
from ntagen.cli.signals import TERMINATED
from ntagen.cli.terminal import echo, given_options, say, say_idle
from ntagen.drive.states import State
from ntagen.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from ntagen.drive.configure import Configuration
    from ntagen.drive.device import LiveSensor, WatchedActuator
    from ntagen.drive.outcome import Driven
    from ntagen.drive.records import Journal
    from ntagen.nsl import Task
    from ntagen.parameters import Given
    from ntagen.plan.synthesise import Synthesiser

_EPILOG: Final = """\
Exit codes: 0 target reached, 1 no strategy, 2 the input is wrong, 3 time-out or another limit,
4 no strategy that holds in exact kinematics, or nothing is guaranteed any more
(--only-guaranteed), 5 device fault, 6 no strategy that ends in time, 7 pulled back to the entry
(--resume), 70 internal error, 130 interrupted, 143 ended by SIGTERM."""


@click.command(
    "drive",
    cls=Renamed,
    former={
        "--baud": "write --needle grbl:PORT,baud={}",
        "--by": "write --strategy none for plans",
    },
    epilog=_EPILOG,
)
@path_argument("environment", metavar="[ENV.nsl]", required=False)
@resume_option
@click.option(
    "--needle",
    default="virtual",
    show_default=True,
    help="Which needle to steer. Three are simulations: virtual bends exactly as planned, phantom "
    "drifts, lags and is measured as real needles are, and grbl+sim is a phantom behind an "
    "emulated stepper controller. grbl:PORT is a real needle behind a controller with the axes "
    "that the task describes (grbl:PORT,baud=9600 says how fast the port is); grbl alone takes the "
    "port from the task, too. PLUGIN:ARGUMENT is a real needle of another package "
    "(docs/plugins.md).",
)
@click.option(
    "--confirm",
    is_flag=True,
    help="Ask before each plan that is followed, and before the needle is pulled back for one.",
)
@tracker_option
@registration_option
@course_options
@path_option(
    "--policy",
    "policy_path",
    metavar="FILE.json",
    help="In a tissue with chance (tissue stochastic), ask the policy in this file after each push "
    "whether to roll now; ntagen plan --optimise -o wrote it for this task. Where it says nothing, "
    "or its move is not safe, plans are followed as without it.",
)
@known_option
@click.option(
    "--breath-phase",
    "breath_phase_deg",
    metavar="DEG",
    type=click.FloatRange(0.0, 360.0),
    help="The phase of the breath at the start, if regions move: from 0 to 360 degrees; by default "
    "0. A simulation moves its regions by the same clock.",
)
@path_option(
    "--log",
    "log_path",
    metavar="RUN.mcap",
    help="The file to write the log of the run to; an existing file is replaced, but with --resume "
    "nothing is.  [default: none; RUN-resumed.mcap with --resume RUN.mcap]",
)
@click.option(
    "--view",
    "is_watched",
    is_flag=True,
    help="Show the run while it goes on on a page in the browser, which can stop it; prints the "
    "address. There are needle, plan, tube, regions, force and deviation. A simulation then takes "
    "the time that a real needle would.",
)
@click.option(
    "--foxglove",
    "foxglove_port",
    metavar="[PORT]",
    type=click.IntRange(0, 65535),
    is_flag=False,
    flag_value=8765,
    help="Show the run in Foxglove while it goes on: open a connection to ws://localhost:8765, or "
    "to another port. It needs ntagen[foxglove], and lets a simulation take its time as --view.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
@click.option("--quiet", is_flag=True, help="Print only how the run ended.")
@click.option(
    "--settings",
    "only_settings",
    is_flag=True,
    help="Print all settings and where each comes from, and do not drive.",
)
@include_option()
@settings_options("seed", "noise", "time limit")
def command(
    environment: Path | None,
    resumed_path: Path | None,
    needle: str,
    confirm: bool,
    tracker: str | None,
    registration: str | None,
    policy_path: Path | None,
    known: str,
    breath_phase_deg: float | None,
    log_path: Path | None,
    is_watched: bool,
    foxglove_port: int | None,
    as_json: bool,
    quiet: bool,
    only_settings: bool,
    include: tuple[Path, ...],
    given: tuple[Given, ...],
    wanted: Wanted,
) -> int:
    """Steer a needle to the target and log the run.

    The driver pushes a little, estimates where the needle is and how it bends, finds a safe
    strategy, and follows its best plan while it measures. If the needle deviates or the force
    rises, the driver stops, pulls back, and looks for a new strategy with what it has learned.

    In a tissue that answers (tissue adversarial), the driver follows a strategy that wins whatever
    the tissue picks, and says up to which depth its guarantee held. A phantom or real needle is led
    by such a strategy as soon as one wins against all that the estimate leaves open.

    After a stop, a cut or a kill, --resume goes on from the log: the driver measures, finds the
    needle in the channel that it has cut, says what it relies on, and asks you.

    Ctrl-C and SIGTERM stop the needle and complete the log; a second Ctrl-C ends the program at
    once. Two runs cannot write the same log at the same time.

    \b
    Examples:
      ntagen drive examples/paper.nsl --log run.mcap
      ntagen drive examples/paper.nsl --seed 1 --noise 0.1mm --known none
      ntagen drive examples/paper.nsl --needle phantom --seed 1
      ntagen drive examples/paper.nsl --set "pull 8 mm" --set "force sensing off"
      ntagen drive examples/paper.nsl --tracker openigtlink+sim
      ntagen drive task.nsl --needle grbl:/dev/ttyACM0 --confirm --log run.mcap \\
        --tracker openigtlink:localhost:18944:Needle --registration registration.json
      ntagen drive examples/answering/answering.nsl --tissue between --seed 1 --only-guaranteed
      ntagen drive examples/chance/chance.nsl --policy t.policy.json --log run.mcap
      ntagen drive examples/paper.nsl --needle phantom --view
      ntagen drive examples/paper.nsl --settings
      ntagen drive --resume run.mcap

    \b
    --set takes what can stand in the braces drive { … } of ENV.nsl, and wins over them.
    """  # noqa: D301  click wants the control character
    if as_json:
        say_idle({"quiet": "--quiet"}, "with --json")
    if resumed_path is not None:
        given_needle = needle if "needle" in given_options() else None
        resumed = resumed_of(
            resumed_path, environment, include, given_needle, tracker, registration
        )
        log_path = new_log(resumed.log, log_path)
        require_terminal()
        tell_past(resumed)
        run = _resumed_run(resumed)
    else:
        if environment is None:
            raise click.UsageError("Missing argument 'ENV.nsl'.")
        task = _breathing(load_task(environment, include), breath_phase_deg)
        planned = _planned(environment, task, needle, known, given, wanted)
        if only_settings:
            show_settings(planned.configuration)
            return 0
        is_real = planned.configuration.needle.is_real
        tracking = tracking_of(tracker, registration, task.tracker, is_real=is_real)
        run = replace(planned, tracking=tracking)
    terminal = _Terminal(not (as_json or quiet), confirm, is_watched, foxglove_port)
    with signalled_operator() as operator:
        if run.resumed is None:
            run = _led(run, policy_path, operator)
        result = _drive(run, log_path, terminal, operator)
    scene = run.scene
    if as_json:
        guarantee = guarantee_of(result, scene, run.course)
        ended = summary(result, run.configuration, run.known, log_path)
        echo(json.dumps(ended | {"guarantee": guarantee}))
    else:
        report(result, scene, log_path, short=quiet)
    if operator.was_terminated and result.ended.outcome == State.INTERRUPTED.value:
        return TERMINATED
    return exit_code(result.ended.outcome)


def _planned(
    environment: Path,
    task: Task,
    needle: str,
    known: str,
    given: tuple[Given, ...],
    wanted: Wanted,
) -> Run:
    """A run that begins at the entry, before anything measures it."""
    from ntagen.drive.configure import configure
    from ntagen.drive.needles import LAB, ROS

    if needle == ROS:
        raise InputError(
            "a needle behind topics of ROS 2 is driven by a node\n"
            "hint: `ntagen ros ENV.nsl --needle ros` is that node"
        )
    if needle == LAB:
        raise InputError(
            "a needle in a lab is driven by its port and its tracker\n"
            "hint: `ntagen device simulate ENV.nsl` opens a lab, and prints the command"
        )
    configuration = configure((*task.given, *given), task.scene, known, needle)
    _say_idle(configuration, given, picks=picks_at_random(wanted, task.scene))
    say_idle_options(task.scene, configuration)
    return Run(environment, task, configuration, known, needle, wanted=wanted)


def _led(run: Run, policy_path: Path | None, operator: SignalledOperator) -> Run:
    """The run with the strategy or the policy that leads it."""
    from ntagen.drive.knowledge import told

    scene = told(run.scene, run.known)
    course = course_of(run.wanted, scene, run.configuration, operator.listen)
    policy = None
    if policy_path is not None:
        policy = load_policy(policy_path, scene)
        if policy.is_silent:
            say([f"{policy_path} is silent: plans are followed as without a policy"])
    return replace(run, course=course, policy=policy)


def _resumed_run(resumed: Resumed) -> Run:
    """A run that goes on from a log."""
    log = resumed.log
    return Run(
        log.path,
        resumed.task,
        resumed.configuration,
        resumed.known,
        resumed.needle,
        tracking=resumed.tracking,
        course=log.course,
        policy=log.policy,
        resumed=resumed,
    )


def _breathing(task: Task, phase_deg: float | None) -> Task:
    """The task with another phase of the breath at the start."""
    breath = task.scene.breath
    if phase_deg is None:
        return task
    if breath is None:
        say_idle({"breath_phase_deg": "--breath-phase"}, "where no region moves")
        return task
    clock_s = phase_deg / 360.0 * breath.period_s
    return replace(task, scene=task.scene.at_clock(clock_s))


def _say_idle(configuration: Configuration, given: Sequence[Given], *, picks: bool) -> None:
    """Tells what has no effect on this needle, in a tissue that may pick at random."""
    needle, errors = configuration.needle, configuration.errors
    say_idle_errors(needle, given)
    if needle.is_real:
        say_idle_settings(given, {"seed"}, "with a real needle")
        return
    if needle.parameters is None and not (errors.noise_mm or errors.roll_rad or picks):
        say_idle_settings(given, {"seed"}, "without --noise or --set 'roll error …'")


@dataclass(frozen=True, slots=True)
class _Terminal:
    """How the operator sees the run: told by the terminal, asked there, in the browser."""

    speaks: bool
    confirms: bool
    is_watched: bool
    foxglove_port: int | None


@contextlib.contextmanager
def _real_needle(run: Run) -> Iterator[tuple[WatchedActuator, LiveSensor]]:
    """What moves a real needle, and what measures it."""
    from ntagen.tracking.opening import opened_live

    settings, scene, tracking = run.configuration.settings, run.scene, run.tracking
    if tracking.tracker is None:
        raise AssertionError("a real needle has a tracker (`tracking_of`)")
    with (
        moved_by(run) as actuator,
        opened_live(
            tracking.text,
            tracking.tracker,
            tracking.transform,
            scene.needle.tip if run.resumed is None else None,
            actuator.now_s,
            watches_force=settings.force_sensing,
            force_varies=settings.force_noise_n > 0.0,
        ) as sensor,
    ):
        yield actuator, sensor


def _drive(
    run: Run,
    log_path: Path | None,
    terminal: _Terminal,
    operator: SignalledOperator,
) -> Driven:
    """Drives a real or a simulated needle."""
    from ntagen.drive.real import RealRun
    from ntagen.drive.simulate import simulate

    configuration, settings, scene = run.configuration, run.configuration.settings, run.scene
    steer: Callable[..., Driven]
    with contextlib.ExitStack() as stack:
        if configuration.needle.is_real:
            devices = stack.enter_context(_real_needle(run))

            def steer(*given: Any, **named: Any) -> Driven:  # noqa: ANN401  as for `simulate`
                return RealRun(scene, *devices, *given, **named).drive()
        else:
            watches_force = settings.force_sensing
            sensing = opened(run.tracking, scene.needle.tip, watches_force=watches_force)
            steer = functools.partial(
                simulate,
                scene,
                errors=configuration.errors,
                make=maker(run.wanted, scene, configuration, run.course),
                seed=configuration.seed,
                sense=stack.enter_context(sensing),
            )
        # A tracker or a port that cannot be reached must not cost an earlier log.
        log = stack.enter_context(log_of(log_path, run))
        synthesise, journal, agree = stack.enter_context(_around(run, log, terminal, operator))
        return steer(
            synthesise,
            settings,
            journal,
            known=run.known,
            listen=operator.listen,
            agree=agree,
            course=run.course,
            policy=run.policy,
            legs=() if run.resumed is None else run.resumed.legs,
            ask=operator.may,
        )


@contextlib.contextmanager
def _around(
    run: Run, log: list[Journal], terminal: _Terminal, operator: SignalledOperator
) -> Iterator[tuple[Synthesiser, Journal, Callable[[str], None]]]:
    """What a run needs besides the needle: what finds plans, what records, and who agrees."""
    from ntagen.drive.planning import mistakes_of_models
    from ntagen.drive.records import Journals
    from ntagen.drive.simulate import synthesiser_for

    settings = run.configuration.settings
    # The log has the strategies; nobody else asks for them.
    synthesise = synthesiser_for(settings, operator.listen, keeps_strategy=bool(log))
    agree = operator.agree if terminal.confirms else lambda _: None
    told = lines(settings.ranking, moves=not (terminal.confirms or run.resumed))
    with contextlib.ExitStack() as stack:
        journals = [*log, *stack.enter_context(_watched(run, operator, terminal))]
        if terminal.speaks:
            journals.append(stack.enter_context(told))
        elif run.resumed is not None:
            journals.append(FoundTeller())
        with mistakes_of_models():
            yield synthesise, Journals(*journals), agree


@contextlib.contextmanager
def _watched(run: Run, operator: SignalledOperator, terminal: _Terminal) -> Iterator[list[Journal]]:
    """The journals of a run that is watched in the browser or in Foxglove."""
    if not terminal.is_watched and terminal.foxglove_port is None:
        yield []
        return
    from ntagen.watch.feed import Feed
    from ntagen.watch.foxglove import shown_in_foxglove
    from ntagen.watch.pace import Pace
    from ntagen.watch.server import watched

    journals: list[Journal] = []
    with contextlib.ExitStack() as stack:
        if terminal.is_watched:
            feed = Feed(run.scene, run.configuration.settings)
            stop = functools.partial(operator.end, "stopped on the page of the run")
            address = stack.enter_context(watched(feed, stop))
            say([f"the run is shown at {address}"])
            journals.append(feed)
        if terminal.foxglove_port is not None:
            showing = shown_in_foxglove(run.scene, terminal.foxglove_port)
            view, address = stack.enter_context(showing)
            say([f"Foxglove can open a connection to {address}"])
            journals.append(view)
        if not run.configuration.needle.is_real:
            journals.insert(0, Pace(lambda: operator.wants_end))
        yield journals
