"""`ntagen ros`: the driver as a node of ROS 2."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.loading import load_task
from ntagen.cli.needle.operator import signalled_operator
from ntagen.cli.needle.report import lines, report, summary
from ntagen.cli.needle.runs import Run, exit_code, log_of, moved_by
from ntagen.cli.needle.steering import known_option, say_idle_errors, settings_options
from ntagen.cli.needle.tracker import NO_REGISTRATION, Tracking, registration_option
from ntagen.cli.options import include_option, path_argument, path_option
from ntagen.cli.signals import TERMINATED
from ntagen.cli.terminal import echo
from ntagen.drive.states import State
from ntagen.errors import InputError

if TYPE_CHECKING:
    from ntagen.drive.configure import Configuration
    from ntagen.drive.device import WatchedActuator
    from ntagen.drive.records import Journal
    from ntagen.drive.settings import Settings
    from ntagen.nsl import Task
    from ntagen.parameters import Given
    from ntagen.plan.synthesise import Synthesiser
    from ntagen.ros.bridge import Bridge
    from ntagen.ros.topics import Topics
    from ntagen.ros.work import NodeWork
    from ntagen.scene import Scene
    from ntagen.tracking.frames import Transform

_ROS_ARGUMENTS: Final = "--ros-args"
_SIMULATED: Final = ("phantom", "virtual")
_NODE: Final = "ntagen"
_SERVICES: Final = "ntagen_services"
"""The node of the services: while one of them waits, the other node hears."""

_EPILOG: Final = """\
Exit codes: those of `ntagen drive` for how the run ended; 0 if the node was ended and nothing was
steered, 2 the input is wrong, 5 a device is not ready (--at-once)."""


class RosArguments(click.Command):
    """A command that leaves what stands behind ``--ros-args``, up to ``--``, to ROS."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Takes the arguments of ROS away first: they may look like options of ours."""
        ours, ros = split_arguments(args)
        ctx.meta[_ROS_ARGUMENTS] = ros
        return super().parse_args(ctx, ours)


def split_arguments(args: Sequence[str]) -> tuple[list[str], list[str]]:
    """Our arguments, and those of ROS with the word before them."""
    words = list(args)
    if _ROS_ARGUMENTS not in words:
        return words, []
    begin = words.index(_ROS_ARGUMENTS)
    end = words.index("--", begin) if "--" in words[begin:] else len(words)
    return words[:begin] + words[end + 1 :], words[begin:end]


def ros_arguments() -> list[str]:
    """The arguments of ROS of the command that runs."""
    found: list[str] = click.get_current_context().meta.get(_ROS_ARGUMENTS, [])
    return found


topics_option = path_option(
    "--topics",
    "topics_path",
    metavar="FILE.toml",
    help="Units, frames, quality of service and names of topics; parameters of the node win over "
    "it. docs/ros.md has all words.",
)


@click.command("ros", cls=RosArguments, epilog=_EPILOG)
@path_argument("environment", metavar="ENV.nsl")
@click.option(
    "--needle",
    default="ros",
    show_default=True,
    help="What moves the needle: ros is a stage that is commanded over topics; grbl:PORT and "
    "PLUGIN:ARGUMENT are those of ntagen drive. The tip comes from a topic. phantom and virtual "
    "are simulations, with a stage and a tracker of their own under /simulated.",
)
@topics_option
@registration_option
@known_option
@path_option(
    "--log",
    "log_path",
    metavar="RUN.mcap",
    help="The file to write the log of the run to; an existing file is replaced.",
)
@click.option(
    "--at-once",
    is_flag=True,
    help="Arm and steer at once, without waiting for the services, and end with the run.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
@include_option()
@settings_options("seed", "time limit")
def command(
    environment: Path,
    needle: str,
    topics_path: Path | None,
    registration: str | None,
    known: str,
    log_path: Path | None,
    at_once: bool,
    as_json: bool,
    include: tuple[Path, ...],
    given: tuple[Given, ...],
) -> int:
    """Steer a needle as a node of ROS 2, /ntagen.

    The node waits for its services /ntagen/arm, start, stop and pull_back (std_srvs/Trigger). It
    hears /sensor/tip (or /needle/state/shape), /sensor/force, /subject/state/target and
    skin_entry, and publishes /needle/state/pose and predicted_shape, /visualization_marker_array,
    /ntagen/status and /diagnostics. Lengths are in metres, or in mm by the parameter units.

    ROS 2 comes with pip install 'ntagen[ros]', or from the lab's own installation. What stands
    behind --ros-args is for ROS: parameters (-p) and other names (-r).

    \b
    Examples:
      ntagen ros examples/stepper.nsl --needle phantom
      ntagen ros task.nsl --log run.mcap --ros-args -p units:=mm -r /sensor/tip:=/em/tip
      ntagen ros task.nsl --needle grbl:/dev/ttyACM0 --topics lab.toml
    """  # noqa: D301  click wants the control character
    from ntagen.ros.loading import require_ros
    from ntagen.ros.topics import read_topics

    arguments = ros_arguments()
    task = load_task(environment, include)
    steered = _steered(environment, task, needle, known, given, log_path)
    transform = _transform(registration)
    topics = read_topics(topics_path)
    require_ros()
    steered = replace(steered, speaks=not as_json)
    opening = _opened(steered, topics, transform, arguments)
    with signalled_operator() as operator, opening as (work, services):
        from ntagen.ros.session import Session

        session = Session(work, work.observer.tell)
        _offer(services, session)
        if not (at_once or as_json):
            _say_services()
        session.run(operator.listen, at_once=at_once)
    if work.driven is None:
        return TERMINATED if operator.was_terminated else 0
    ended = work.driven.ended
    if as_json:
        configuration = steered.run.configuration
        echo(json.dumps(summary(work.driven, configuration, known, log_path)))
    else:
        report(work.driven, task.scene, log_path, short=False)
    if operator.was_terminated and ended.outcome == State.INTERRUPTED.value:
        return TERMINATED
    return exit_code(ended.outcome)


def _transform(registration: str | None) -> Transform:
    """The registration; without one, the topics are in the frame of the task."""
    from ntagen.tracking.frames import IDENTITY
    from ntagen.tracking.transform_file import read_transform

    is_none = registration in (None, NO_REGISTRATION)
    return IDENTITY if is_none else read_transform(Path(str(registration)))


@dataclass(frozen=True, slots=True)
class Steered:
    """What a node steers (`ntagen.ros.work.Task`)."""

    run: Run
    given: tuple[Given, ...]
    log_path: Path | None
    speaks: bool = True

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.run.scene

    @property
    def settings(self) -> Settings:
        """How to drive."""
        return self.run.configuration.settings

    @property
    def known(self) -> str:
        """The critical regions that the driver knows."""
        return self.run.known

    @property
    def is_behind_topics(self) -> bool:
        """Whether the needle is moved by a stage that is commanded over topics."""
        from ntagen.drive.needles import ROS

        return self.run.needle in (ROS, *_SIMULATED)

    def moved_by(self) -> AbstractContextManager[WatchedActuator]:
        """Opens what moves the needle."""
        return moved_by(self.run)

    def with_scene(self, scene: Scene) -> Steered:
        """The same with another scene."""
        task = replace(self.run.task, scene=scene)
        configuration = _configuration(task, self.run.needle, self.known, self.given)
        return replace(self, run=replace(self.run, task=task, configuration=configuration))

    def synthesiser(self, listen: Callable[[], None]) -> Synthesiser:
        """What finds plans."""
        from ntagen.drive.simulate import synthesiser_for

        return synthesiser_for(self.settings, listen, keeps_strategy=self.log_path is not None)

    @contextlib.contextmanager
    def journals(self) -> Iterator[list[Journal]]:
        """What else records the run: the log, and the lines on the terminal."""
        told = lines(self.settings.ranking, moves=False)
        speaking = told if self.speaks else contextlib.nullcontext()
        with log_of(self.log_path, self.run) as log, speaking as shown:
            yield [*log, *([shown] if shown else [])]


def _steered(
    environment: Path,
    task: Task,
    needle: str,
    known: str,
    given: tuple[Given, ...],
    log_path: Path | None,
) -> Steered:
    """What is steered, as the command line says."""
    from ntagen.drive.knowledge import told
    from ntagen.drive.needles import NAMES

    if needle in NAMES and needle not in _SIMULATED:
        raise InputError(
            f"a node does not steer {needle}\nhint: --needle phantom is such a needle, too"
        )
    configuration = _configuration(task, needle, known, given)
    say_idle_errors(configuration.needle, given)
    told(task.scene, known)
    run = Run(environment, task, configuration, known, needle, Tracking("ros"))
    return Steered(run, given, log_path)


def _configuration(task: Task, needle: str, known: str, given: tuple[Given, ...]) -> Configuration:
    """The settings: a simulated needle is driven as a real one is, after its calibration."""
    from ntagen.drive.configure import COMMAND_LINE, configure
    from ntagen.drive.needles import LAB, ROS
    from ntagen.nsl.driving import read_settings

    if needle == "virtual":
        # A force without noise would be taken for that of a dead sensor.
        noiseless = read_settings(["force noise 0 N"], COMMAND_LINE)
        return configure((*task.given, *noiseless, *given), task.scene, known, ROS)
    name = LAB if needle == "phantom" else needle
    return configure((*task.given, *given), task.scene, known, name)


@contextlib.contextmanager
def _opened(
    steered: Steered, topics: Topics, transform: Transform, arguments: list[str]
) -> Iterator[tuple[NodeWork, Bridge]]:
    """The node that steers and the one of its services, until the end of the block."""
    from ntagen.ros.bridge import Bridge, opened_nodes
    from ntagen.ros.work import NodeWork

    works: list[NodeWork] = []

    def fail(trouble: str) -> None:
        for one in works:
            one.fail(trouble)

    with contextlib.ExitStack() as stack:
        nodes = stack.enter_context(opened_nodes([_NODE, _SERVICES], arguments))
        bridge, services = (Bridge(node, fail) for node in nodes)
        topics = bridge.with_parameters(topics)
        if steered.run.needle in _SIMULATED:
            topics = stack.enter_context(_simulation(steered, topics))
        works.append(stack.enter_context(NodeWork(bridge, topics, steered, transform)))
        yield works[0], services


@contextlib.contextmanager
def _simulation(steered: Steered, topics: Topics) -> Iterator[Topics]:
    """A lab for a simulated needle, under names of its own; the topics with these names."""
    from ntagen.drive.steppers import speeds_for
    from ntagen.lab.needles import place
    from ntagen.ros.lab import opened_lab
    from ntagen.ros.topics import apart

    configuration, scene = steered.run.configuration, steered.scene
    settings = configuration.settings
    margin_mm = settings.sensing_margin_mm
    placed = place(steered.run.needle, scene, configuration.seed, margin_mm, configuration.errors)
    topics = replace(apart(topics, "/simulated"), bevel="+x", latency_s=placed.latency_s)
    with opened_lab(scene, placed, speeds_for(scene.needle, settings), topics):
        yield topics


def _offer(bridge: Bridge, session: Any) -> None:  # noqa: ANN401  imported late
    """Offers the services."""
    services = {
        "arm": session.arm,
        "start": session.start,
        "stop": session.stop,
        "pull_back": session.pull_back,
    }
    for name, do in services.items():
        bridge.answer(f"/{_NODE}/{name}", do)


def _say_services() -> None:
    echo(
        f"the node /{_NODE} waits; call /{_NODE}/arm, then /{_NODE}/start, for example\n\n"
        f"  ros2 service call /{_NODE}/arm std_srvs/srv/Trigger\n\nCtrl-C ends it"
    )
