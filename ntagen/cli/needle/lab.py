"""`ntagen device simulate`: a lab without hardware, for `ntagen drive` in another terminal."""

from __future__ import annotations

import contextlib
import json
import math
import shlex
import signal
import time
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.loading import load_task
from ntagen.cli.needle.ros import RosArguments, ros_arguments, topics_option
from ntagen.cli.needle.steering import say_idle_errors, settings_options
from ntagen.cli.options import include_option, path_argument
from ntagen.cli.signals import handled
from ntagen.cli.terminal import echo, say_idle
from ntagen.drive.steppers import axes_for, described
from ntagen.lab.lab import RATE_HZ
from ntagen.lab.speeds import FASTEST, SLOWEST

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

    from ntagen.drive.configure import Configuration
    from ntagen.grbl.axes import Axes
    from ntagen.hardware import GrblDevice
    from ntagen.lab.lab import Lab, Truth
    from ntagen.lab.needles import Placed
    from ntagen.nsl import Task
    from ntagen.parameters import Given
    from ntagen.ros.lab import RosLab

_LOOK_S: Final = 0.1
"""How often it is asked whether the lab should end."""


class _Simulate(RosArguments, Renamed):
    """The command, whose last arguments may be for ROS."""


@click.command(
    "simulate",
    cls=_Simulate,
    former={
        "--help-settings": "`ntagen drive --help-settings` prints them",
        "--rate": f"a lab publishes {RATE_HZ:g} samples a second",
        "--listen-port": "the port that is free is printed, also with --json",
    },
    epilog="Exit codes: 0 the lab was closed, 2 the input is wrong.",
)
@path_argument("environment", metavar="ENV.nsl")
@click.option(
    "--needle",
    type=click.Choice(["phantom", "virtual"]),
    default="phantom",
    show_default=True,
    help="The needle in the lab: phantom drifts, lags and is measured as real needles are; virtual "
    "bends exactly as planned.",
)
@click.option(
    "--speed",
    metavar="N",
    default=1.0,
    show_default=True,
    type=click.FloatRange(min=SLOWEST, max=FASTEST),
    help="How many times as fast time passes in the lab, for axes, needle and tracker.",
)
@click.option(
    "--until-idle",
    "until_idle_s",
    metavar="SECONDS",
    type=click.FloatRange(min=0.1),
    help="Close the lab when nothing has moved for so long, after something has moved.",
)
@click.option(
    "--ros",
    "as_nodes",
    is_flag=True,
    help="Make the lab of nodes of ROS 2, for ntagen ros: /lab_stage and /lab_tracker. With "
    "another speed than 1 they also publish /clock.",
)
@topics_option
@click.option("--json", "as_json", is_flag=True, help="Print two JSON objects, nothing else.")
@include_option()
@settings_options("seed", listed=False)
def command(
    environment: Path,
    needle: str,
    speed: float,
    until_idle_s: float | None,
    as_nodes: bool,
    topics_path: Path | None,
    as_json: bool,
    include: tuple[Path, ...],
    given: tuple[Given, ...],
) -> int:
    """Simulate a lab in which `ntagen drive` can be tried without hardware.

    An emulated stepper controller on a pseudo-terminal moves a needle, which stands at the entry
    of the task's tissue with all of its regions. The controller has the axes of the `device` in
    the task. A tracker and a force sensor publish it over
    OpenIGTLink, on this machine only: TRANSFORM NeedleTip, whose z axis is the heading and whose x
    axis is the bevel direction, and SENSOR Force in newtons.

    The command for the second terminal is printed first. It has the settings that fit this needle,
    as after a calibration. Which regions the driver knows is chosen there, with --known.

    Ctrl-C closes the lab, and the truth is printed: where the tip is, and how near the cut path is
    to critical regions. A driver may be ended and started again: the axes stay where they are.

    \b
    Examples:
      ntagen device simulate examples/stepper.nsl
      ntagen device simulate examples/stepper.nsl --seed 3 --speed 5 --until-idle 20
      ntagen device simulate examples/stepper.nsl --needle virtual --set 'roll error 2 deg'
      ntagen device simulate examples/stepper.nsl --ros
    """  # noqa: D301  click wants the control character
    from ntagen.drive.configure import configure
    from ntagen.lab.lab import Lab
    from ntagen.lab.needles import place

    task = load_task(environment, include)
    fitted = configure((*task.given, *given), task.scene, "all", needle)
    say_idle_errors(fitted.needle, given)
    margin_mm = fitted.settings.sensing_margin_mm
    placed = place(needle, task.scene, fitted.seed, margin_mm, fitted.errors)
    closing = _Closing(until_idle_s)
    with handled({signal.SIGINT: closing.close, signal.SIGTERM: closing.close}):
        if as_nodes:
            opening = _of_nodes(task, fitted, placed, topics_path, speed)
        else:
            say_idle({"topics_path": "--topics"}, "without --ros")
            axes = _axes(described(task, environment), task, given)
            opening = _of_lab(Lab(task.scene, placed, axes=axes, speed=speed))
        with opening as opened:
            words = ["ntagen", opened.command, str(environment), *opened.address]
            for path in include:
                words += ["--include", str(path)]
            words += [*_fitting(fitted, task), *opened.ros]
            _open(opened.facts, shlex.join(words), as_json=as_json)
            while not closing.is_due(opened.lab.idle_s()):
                time.sleep(_LOOK_S)
            truth = opened.lab.truth()
    _close(truth, as_json=as_json)
    return 0


class _Closing:
    """Whether the lab should be closed."""

    def __init__(self, until_idle_s: float | None) -> None:
        self._until_idle_s = math.inf if until_idle_s is None else until_idle_s
        self._is_told = False

    def close(self, _number: int, _frame: FrameType | None) -> None:
        """Ctrl-C or SIGTERM."""
        self._is_told = True

    def is_due(self, idle_s: float | None) -> bool:
        """Whether it is time."""
        return self._is_told or (idle_s is not None and idle_s >= self._until_idle_s)


def _axes(device: GrblDevice, task: Task, given: tuple[Given, ...]) -> Axes:
    """The axes that a task describes, as fast as any driver of it wants them."""
    from ntagen.drive.configure import configure
    from ntagen.drive.plant import simulated_axes

    needle = task.scene.needle
    wanted = axes_for(device, needle, configure((*task.given, *given), task.scene).settings)
    ours = simulated_axes(needle.speed_mm_per_s)
    return replace(
        wanted,
        pull_mm_per_s=max(wanted.pull_mm_per_s, ours.pull_mm_per_s),
        roll_deg_per_s=max(wanted.roll_deg_per_s, ours.roll_deg_per_s),
    )


@dataclass(frozen=True, slots=True)
class _Opened:
    """A lab, and how a driver reaches it.

    Attributes:
        lab: The lab, with a port and a server, or of nodes.
        command: The command of the driver.
        address: Its options for the devices of the lab.
        facts: What a program may want to know besides.
        ros: The arguments of ROS; they stand at the end.
    """

    lab: Lab | RosLab
    command: str
    address: list[str]
    facts: dict[str, str] = field(default_factory=dict)
    ros: tuple[str, ...] = ()


@contextlib.contextmanager
def _of_lab(lab: Lab) -> Iterator[_Opened]:
    """A lab with a port and a server."""
    with lab:
        needle = f"grbl:{lab.port}"
        address = ["--needle", needle, "--tracker", lab.tracker_address, "--registration", "none"]
        facts = {"device": needle, "port": lab.port, "tracker": lab.tracker_address}
        yield _Opened(lab, "drive", address, facts | {"registration": "none"})


@contextlib.contextmanager
def _of_nodes(
    task: Task, fitted: Configuration, placed: Placed, topics_path: Path | None, speed: float
) -> Iterator[_Opened]:
    """A lab of nodes."""
    from ntagen.drive.configure import configure
    from ntagen.drive.needles import ROS
    from ntagen.drive.steppers import speeds_for
    from ntagen.ros.loading import require_ros
    from ntagen.ros.topics import read_topics

    topics = read_topics(topics_path)
    require_ros()
    from ntagen.ros.lab import opened_lab

    settings = configure(task.given, task.scene, needle=ROS).settings
    speeds = speeds_for(task.scene.needle, settings)
    address = ["--needle", ROS]
    if topics_path is not None:
        address += ["--topics", str(topics_path)]
    ros = ["--ros-args", "-p", "bevel:=+x"]
    if placed.latency_s:
        ros += ["-p", f"latency_s:={placed.latency_s:g}"]
    if speed != 1.0:
        ros += ["-p", "use_sim_time:=true"]
    lab_arguments = ros_arguments()
    with opened_lab(
        task.scene, placed, speeds, topics, speed=speed, arguments=lab_arguments
    ) as lab:
        # Other names in the lab are other names for its driver.
        yield _Opened(lab, "ros", address, ros=(*ros, *lab_arguments[1:]))


def _fitting(fitted: Configuration, task: Task) -> list[str]:
    """The options of `ntagen drive` that a calibration of the lab's needle would give."""
    from ntagen.drive.configure import configure
    from ntagen.drive.settings import STEERING
    from ntagen.parameters import NEEDLE

    of_driver = [one for one in task.given if not one.parameter.field.startswith(f"{NEEDLE}.")]
    plain = configure(of_driver, task.scene)
    settings = []
    for parameter in STEERING:
        value = fitted.value(parameter)
        if value != plain.value(parameter):
            settings.append(f"{parameter.words} {parameter.shown(value)}")
    if fitted.needle.parameters is None:
        # A force without noise would be taken for that of a dead sensor.
        settings.append("force noise 0 N")
    return ["--set", "  ".join(settings)] if settings else []


def _open(facts: dict[str, str], driving: str, *, as_json: bool) -> None:
    """Says how the lab is reached."""
    if as_json:
        echo(json.dumps(facts | {"command": driving}))
        return
    echo(f"the lab is open; in another terminal, run\n\n  {driving}\n\nCtrl-C closes it")


def _close(truth: Truth, *, as_json: bool) -> None:
    """Says what has really happened."""
    clearance_mm = truth.clearance_mm
    if as_json:
        facts = {
            "tip_mm": truth.tip.position_mm,
            "heading": truth.tip.heading,
            "bevel": truth.tip.bevel,
            "target": truth.target,
            "true_target_distance_mm": truth.target_distance_mm,
            "true_clearance_mm": clearance_mm if math.isfinite(clearance_mm) else None,
            "has_moved": truth.has_moved,
            "lab_time_s": truth.time_s,
        }
        echo(json.dumps(facts))
        return
    place = ", ".join(f"{number:.2f}" for number in truth.tip.position_mm)
    where = "inside" if truth.target_distance_mm <= 0.0 else "outside of"
    echo(f"in truth, the tip is at ({place}) mm, ", nl=False)
    echo(f"{abs(truth.target_distance_mm):.2f} mm {where} {truth.target}", nl=False)
    if not truth.has_moved:
        echo("; nothing has moved")
    elif math.isfinite(clearance_mm):
        echo(f", and the cut path is {clearance_mm:.2f} mm or more from critical regions")
    else:
        echo("")
