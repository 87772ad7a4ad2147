"""`ntagen drive`: steers a needle to the target, and logs the run."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import signal
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.effects import say_idle
from ntagen.cli.models import include_option
from ntagen.cli.signals import TERMINATED, handled
from ntagen.cli.steering import show_settings, steering_options
from ntagen.cli.terminal import echo
from ntagen.cli.tracker import Sense, Tracking, opened, tracker_options, tracking_of
from ntagen.drive.operator import Operator
from ntagen.drive.states import State
from ntagen.files import read_file, require_apart

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from types import FrameType

    from ntagen.drive.configure import Configuration
    from ntagen.drive.records import Journal, Record
    from ntagen.drive.simulate import Result
    from ntagen.parameters import Given
    from ntagen.plan.synthesise import Synthesis
    from ntagen.scene import Scene

_EPILOG: Final = """\
Exit codes: 0 target reached, 1 no strategy, 2 the input is wrong, 3 time-out or another limit,
4 no strategy that holds in exact kinematics, 5 device fault, 6 no strategy that ends in time,
70 internal error, 130 interrupted, 143 ended by SIGTERM."""


@click.command("drive", epilog=_EPILOG)
@click.argument("environment", metavar="ENV.nsl", type=click.Path(path_type=Path))
@click.option(
    "--needle",
    default="virtual",
    show_default=True,
    help="Which needle to steer. All are simulations: virtual bends exactly as planned, phantom "
    "drifts, lags and is measured as real needles are, and grbl+sim is a phantom behind an "
    "emulated stepper controller.",
)
@tracker_options
@click.option(
    "--known",
    metavar="all|none|NAME,…",
    default="all",
    show_default=True,
    help="The critical regions that the driver knows at the start. It must feel the others.",
)
@click.option(
    "--log",
    "log_path",
    metavar="RUN.mcap",
    type=click.Path(path_type=Path),
    help="The file to write the log of the run to; an existing file is replaced.",
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
@steering_options
def command(
    environment: Path,
    needle: str,
    tracker: str | None,
    registration: str | None,
    known: str,
    log_path: Path | None,
    as_json: bool,
    quiet: bool,
    only_settings: bool,
    include: tuple[Path, ...],
    given: tuple[Given, ...],
) -> int:
    """Steer a needle to the target and log the run.

    The driver pushes a little, estimates where the needle is and how it bends, finds a safe
    strategy, and follows its best plan while it measures. If the needle deviates or the force
    rises, the driver stops, pulls back, and looks for a new strategy with what it has learned.

    Ctrl-C and SIGTERM stop the needle and complete the log; a second Ctrl-C ends the program at
    once. Two runs cannot write the same log at the same time.

    \b
    Examples:
      ntagen drive examples/paper.nsl --log run.mcap
      ntagen drive examples/paper.nsl --seed 1 --noise 0.1mm --known none
      ntagen drive examples/paper.nsl --needle phantom --seed 1
      ntagen drive examples/paper.nsl --pull 8mm --true-radius 33mm --force-sensing off
      ntagen drive examples/paper.nsl --tracker openigtlink+sim
      ntagen drive examples/paper.nsl --settings

    \b
    Values have a unit, as in 4mm, 2deg, 60s, 0.1N or 1GiB; a plain number is in the unit that the
    option names. The braces drive { … } of ENV.nsl give the same settings by their words, for
    example `initial push 4 mm` for --initial-push 4mm; the command line wins.
    """  # noqa: D301  click wants the control character
    from ntagen.drive.configure import configure
    from ntagen.nsl import load_task

    if as_json:
        say_idle({"quiet": "--quiet"}, "with --json")
    task = load_task(environment, include=include)
    for warning in task.warnings:
        echo(warning.render(), err=True)
    configuration = configure((*task.given, *given), task.scene, known, needle)
    errors = configuration.errors
    if configuration.needle.parameters is not None:
        idle = {"given_needle_noise_mm": "--noise", "given_needle_roll_rad": "--roll-error"}
        say_idle(idle, "on a phantom needle, which has its own errors")
    elif not (errors.noise_mm or errors.roll_rad):
        say_idle({"given_needle_seed": "--seed"}, "without --noise or --roll-error")
    if only_settings:
        show_settings(configuration)
        return 0
    tracking = tracking_of(tracker, registration, task.tracker)
    run = _Run(environment, task.scene, configuration, known, tracking)
    speaks = not (as_json or quiet)
    entry, watches_force = task.scene.needle.tip, configuration.settings.force_sensing
    # A tracker that cannot be reached must not cost an earlier log.
    with (
        _operator() as operator,
        opened(tracking, entry, watches_force=watches_force) as sense,
        _log(log_path, run) as log,
    ):
        result = _drive(run, sense, log, speaks, operator)
    if as_json:
        echo(json.dumps(_summary(result, run, log_path)))
    else:
        _report(result, task.scene, log_path, short=quiet)
    if operator.was_terminated and result.ended.outcome == State.INTERRUPTED.value:
        return TERMINATED
    return _exit_code(result.ended.outcome)


@dataclass(frozen=True, slots=True)
class _Run:
    """What is driven: the file, the true scene, the settings, what is known, what measures."""

    environment: Path
    scene: Scene
    configuration: Configuration
    known: str
    tracking: Tracking


class _Signalled(Operator):
    """An operator who speaks by signals."""

    def __init__(self) -> None:
        super().__init__()
        self.was_terminated = False

    def interrupt(self, _number: int, _frame: FrameType | None) -> None:
        """Ctrl-C: the first one ends the run in an orderly way, the second one at once."""
        if self.wants_end:
            raise KeyboardInterrupt
        self.end("interrupted by the operator")

    def terminate(self, _number: int, _frame: FrameType | None) -> None:
        """SIGTERM: ends the run in an orderly way."""
        self.was_terminated = True
        self.end("ended by the system (SIGTERM)")


@contextlib.contextmanager
def _operator() -> Iterator[_Signalled]:
    """The operator, who gets the signals until the end of the block."""
    operator = _Signalled()
    with handled({signal.SIGINT: operator.interrupt, signal.SIGTERM: operator.terminate}):
        yield operator


def _drive(
    run: _Run, sense: Sense | None, log: list[Journal], speaks: bool, operator: Operator
) -> Result:
    from ntagen.drive.records import Journals
    from ntagen.drive.simulate import simulate, synthesiser_for

    settings = run.configuration.settings
    # The log has the strategies; nobody else asks for them.
    synthesise = synthesiser_for(settings, operator.listen, keeps_strategy=bool(log))
    with contextlib.ExitStack() as stack:
        terminal = stack.enter_context(_terminal(settings.ranking)) if speaks else []
        return simulate(
            run.scene,
            synthesise,
            settings,
            Journals(*log, *terminal),
            known=run.known,
            errors=run.configuration.errors,
            make=run.configuration.needle.make,
            seed=run.configuration.seed,
            sense=sense,
            listen=operator.listen,
        )


@contextlib.contextmanager
def _log(path: Path | None, run: _Run) -> Iterator[list[Journal]]:
    """The journal that writes the log, if one is wanted."""
    if path is None:
        yield []
        return
    from ntagen.drive.knowledge import told
    from ntagen.drive.log import ACTUAL, SOURCE, Log, metadata_of
    from ntagen.drive.scene_json import scene_to_json
    from ntagen.nsl.source import MAX_SOURCE_BYTES

    # Mistakes on the command line must be found before an earlier log is replaced.
    environment, configuration = run.environment, run.configuration
    errors = configuration.errors
    told(run.scene, run.known)
    require_apart({"--log": path}, {"environment": environment})
    metadata = {
        "program": f"ntagen {_version()}",
        "environment": environment.name.encode(errors="replace").decode(),
        "seed": configuration.seed,
        "known": run.known,
        "tracker": run.tracking.text,
        "noise_mm": errors.noise_mm,
        "roll_error_rad": errors.roll_rad,
        "true_radius_mm": errors.radius_mm,
        "true_bevel_rad": errors.bevel_rad,
        "settings": configuration.settings.to_json(),
        "origins": dict(configuration.origins),
        **configuration.needle.facts(),
    }
    actual = replace(run.scene, needle=errors.true_needle(run.scene.needle))
    attachments = {ACTUAL: scene_to_json(actual).encode()}
    # A pipe can be read only once.
    if environment.is_file():
        attachments[SOURCE] = read_file(environment, MAX_SOURCE_BYTES)
    with Log(path, metadata_of(metadata), attachments) as log:
        yield [log]


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("ntagen")
    except PackageNotFoundError:
        return "(not installed)"


class _Lines:
    """Prints the run line by line; on a terminal also what happens at the moment."""

    def __init__(
        self,
        ranking: Sequence[str],
        status: Any = None,  # noqa: ANN401  rich is imported late
    ) -> None:
        self._ranking = ranking
        self._status = status

    def record(self, record: Record) -> None:
        """Prints the line of a record, if it has one, and refreshes the status."""
        from ntagen.drive.records import Measured, Transition
        from ntagen.drive.story import tell

        line = tell(record)
        if line is not None:
            echo(line)
        if self._status is None:
            return
        if isinstance(record, Transition):
            self._status.update(record.following)
        elif isinstance(record, Measured):
            self._status.update(
                f"{record.time_s:7.2f} s  {record.depth_mm:6.2f} mm deep, "
                f"force {record.force_n:.2f} N"
            )

    def started(self, scene: Scene) -> None:
        """Prints what is steered, what the driver knows, and how it chooses."""
        from ntagen.plan.wording import ranked_by

        echo(
            f"{scene.name}: {len(scene.targets)} target(s), "
            f"{len(scene.criticals)} critical region(s) known; plans "
            f"{ranked_by(self._ranking)}"
        )

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Does nothing: the record of the synthesis has the line."""


@contextlib.contextmanager
def _terminal(ranking: Sequence[str]) -> Iterator[list[Journal]]:
    """The journal that prints; only a terminal gets a status line that moves."""
    import sys

    if not sys.stdout.isatty():
        yield [_Lines(ranking)]
        return
    from rich.console import Console

    with Console().status("arm") as status:
        yield [_Lines(ranking, status)]


def _summary(result: Result, run: _Run, log_path: Path | None) -> dict[str, Any]:
    from ntagen.units import deg_from_rad

    ended = result.ended
    errors = run.configuration.errors
    clearance_mm = result.clearance_mm
    return {
        "outcome": ended.outcome,
        "reason": ended.reason,
        "time_s": ended.time_s,
        "depth_mm": ended.depth_mm,
        "adjustments": ended.adjustments,
        "syntheses": ended.syntheses,
        "each_synthesis": [dataclasses.asdict(one) for one in result.syntheses],
        "true_clearance_mm": clearance_mm if math.isfinite(clearance_mm) else None,
        "true_target_distance_mm": result.target_distance_mm,
        "seed": run.configuration.seed,
        "noise_mm": errors.noise_mm,
        "roll_error_deg": deg_from_rad(errors.roll_rad),
        "known": run.known,
        "log": None if log_path is None else str(log_path),
    }


def _report(result: Result, scene: Scene, log_path: Path | None, *, short: bool) -> None:
    ended = result.ended
    if short:
        echo(f"{ended.outcome}: {ended.reason}")
        return
    clearance_mm, target_mm = result.clearance_mm, result.target_distance_mm
    where = "inside" if target_mm <= 0.0 else "outside of"
    echo(f"in truth, the tip is {abs(target_mm):.2f} mm {where} {scene.targets[-1].name}", nl=False)
    if math.isfinite(clearance_mm):
        echo(f", and the needle's path is {clearance_mm:.2f} mm or more from critical regions")
    else:
        echo("")
    count = f"{ended.syntheses} syntheses, {ended.adjustments} adjustments"
    echo(f"{count}, {ended.time_s:.1f} s, {ended.depth_mm:.1f} mm deep")
    if log_path is not None:
        echo(f"wrote {log_path}")


def _exit_code(outcome: str) -> int:
    return {
        State.TARGET_REACHED: 0,
        State.NO_STRATEGY: 1,
        State.NONE_HOLDS: 4,
        State.NO_TIME_LEFT: 6,
        State.TIMED_OUT: 3,
        State.FAULTED: 5,
        State.INTERRUPTED: 130,
    }[State(outcome)]
