"""`ntagen device test`, and what `ntagen device check` says about plugins."""

from __future__ import annotations

import contextlib
import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.options import path_option
from ntagen.cli.terminal import echo, say_idle
from ntagen.drive.steppers import axes_for, described, speeds_for
from ntagen.errors import DeviceError, InputError
from ntagen.extensions import DEVICES, TRACKERS, find, names, package
from ntagen.extensions import described as listed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ntagen.drive.device import LiveSensor, WatchedActuator
    from ntagen.drive.plugin import Speeds
    from ntagen.drive.settings import Settings
    from ntagen.nsl import Task
    from ntagen.testing import Check

_MOST_MM: Final = 10.0
_MOST_DEG: Final = 360.0


def is_plugin(text: str) -> bool:
    """Whether a name with its argument is that of a plugin; names of ntagen's own come first."""
    name = text.partition(":")[0]
    if name in ("grbl", "grbl+sim", "openigtlink") or name.endswith(".nsl"):
        return False
    return name in names(DEVICES) + names(TRACKERS)


def installed() -> str:
    """All plugins, for messages."""
    return f"devices {listed(DEVICES)}, trackers {listed(TRACKERS)}"


def check_plugin(text: str, *, as_json: bool) -> int:
    """Opens the device and the tracker of a plugin, moves nothing, and prints what they say.

    Raises:
        InputError: Several plugins have this name.
        DeviceError: The plugin fails.
    """
    from ntagen.drive.plugin import Speeds, open_device
    from ntagen.tracking.frames import IDENTITY
    from ntagen.tracking.plugin import PluginSource, open_plugin

    name, _, argument = text.partition(":")
    facts: list[dict[str, Any]] = []
    if name in names(DEVICES):
        with open_device(name, argument, Speeds()) as device:
            device.now_s()
            facts.append({"kind": "device", "says": device.description})
            facts[-1]["ramp_mm_per_s2"] = device.ramp_mm_per_s2
    if name in names(TRACKERS):
        with open_plugin(PluginSource(name, argument), IDENTITY, time.monotonic) as tracker:
            found = tracker.measure()
            facts.append({"kind": "tracker", "says": tracker.description})
            facts[-1]["measures_force"] = tracker.measures_force
            facts[-1]["position_mm"] = found.position_mm
    for fact in facts:
        fact["package"] = package(find(DEVICES if fact["kind"] == "device" else TRACKERS, name))
    if as_json:
        echo(json.dumps({"name": name, "plugins": facts}))
        return 0
    for fact in facts:
        echo(f"{text}: {fact.pop('kind')} of {fact.pop('package')}")
        for key, value in fact.items():
            if value not in ("", None):
                echo(f"  {key.replace('_', ' ')}: {value}")
    echo("nothing was moved")
    return 0


@click.command(
    "test", epilog="Exit codes: 0 all checks hold, 2 the command line is wrong, 5 a check does not."
)
@click.argument("device", metavar="PLUGIN[:ARGUMENT]|grbl:PORT|grbl+sim|openigtlink:…")
@path_option(
    "--task",
    metavar="TASK.nsl",
    help="The task whose speeds, and whose axes for grbl:PORT, are used.",
)
@click.option(
    "--length",
    "length_mm",
    metavar="MM",
    default=1.0,
    show_default=True,
    type=click.FloatRange(min=0.0, max=_MOST_MM, min_open=True),
    help="How far the needle is pushed and pulled.",
)
@click.option(
    "--angle",
    "angle_deg",
    metavar="DEG",
    default=30.0,
    show_default=True,
    type=click.FloatRange(min=0.0, max=_MOST_DEG, min_open=True),
    help="How far it is rolled.",
)
@click.option("--yes", is_flag=True, help="Agree to the motions beforehand.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
def command(
    device: str,
    task: Path | None,
    length_mm: float,
    angle_deg: float,
    yes: bool,
    as_json: bool,
) -> int:
    """Check that a device or a tracker keeps the protocol; made for authors of plugins.

    A device is pushed, pulled and rolled a little, after you agree: take the needle out of the
    tissue first. Its clock, refusals, duration of motions, watch, early ends and stops are
    checked. It stands about where it was at the end. A tracker must see the needle; nothing is
    moved.

    \b
    Examples:
      ntagen device test mystage:simulated
      ntagen device test mystage:/dev/ttyUSB0 --length 0.5 --yes
      ntagen device test grbl+sim --yes
      ntagen device test grbl:/dev/ttyACM0 --task task.nsl
    """  # noqa: D301  click wants the control character
    from ntagen.testing import device_contract, tracker_contract
    from ntagen.units import rad_from_deg

    checks: list[Check] = []
    name = device.partition(":")[0]
    is_tracker = name == "openigtlink" or name in names(TRACKERS)
    if is_tracker:
        with _tracker(device) as sensor:
            checks += tracker_contract(sensor, report=_teller(as_json))
    if not is_tracker or name in names(DEVICES):
        speeds = _speeds(task)
        with _device(device, task, speeds) as moved:
            _agree(device, length_mm, angle_deg, yes=yes)
            angle_rad = rad_from_deg(angle_deg)
            checks += device_contract(moved, speeds, length_mm, angle_rad, _teller(as_json))
    else:
        idle = {"task": "--task", "length_mm": "--length", "angle_deg": "--angle", "yes": "--yes"}
        say_idle(idle, "with a tracker")
    failed = sum(bool(check.problem) for check in checks)
    if as_json:
        shown = {"device": device, "passed": not failed, "checks": [asdict(one) for one in checks]}
        echo(json.dumps(shown))
    if failed:
        raise DeviceError(
            f"{device}: {failed} of {len(checks)} checks do not hold\n"
            "hint: docs/plugins.md says what a device and a tracker must do"
        )
    if not as_json:
        echo(f"{device}: all {len(checks)} checks hold")
    return 0


def _teller(as_json: bool) -> Any:  # noqa: ANN401  a function of a type that is imported late
    def tell(check: Check) -> None:
        if as_json:
            return
        echo(f"WRONG {check.name}: {check.problem}" if check.problem else f"ok    {check.name}")

    return tell


def _agree(device: str, length_mm: float, angle_deg: float, *, yes: bool) -> None:
    asked = (
        f"Push, pull and roll the needle of {device} several times by up to {length_mm:g} mm and "
        f"{angle_deg:g} deg? Take it out of the tissue first."
    )
    if not (yes or click.confirm(asked, err=True)):
        raise InputError("nothing was moved\nhint: agree, or give --yes")


def for_steppers(path: Path) -> tuple[Task, Settings]:
    """A task, and its settings for a needle that steppers move."""
    from ntagen.drive.configure import configure
    from ntagen.nsl import load_task

    task = load_task(path)
    return task, configure(task.given, task.scene, needle="grbl").settings


def _speeds(task: Path | None) -> Speeds:
    """The speeds of a task, or those that are usual."""
    from ntagen.drive.plugin import Speeds

    if task is None:
        return Speeds()
    found, settings = for_steppers(task)
    return speeds_for(found.scene.needle, settings)


@contextlib.contextmanager
def _device(text: str, task: Path | None, speeds: Speeds) -> Iterator[WatchedActuator]:
    """The device itself, without what is put around a plugin in a drive."""
    name, _, argument = text.partition(":")
    if name not in ("grbl", "grbl+sim"):
        from ntagen.drive.plugin import open_bare

        with open_bare(name, argument, speeds) as inner:
            yield inner
        return
    from ntagen.grbl.actuator import GrblActuator
    from ntagen.grbl.port import SerialPort

    with contextlib.ExitStack() as stack:
        if name == "grbl+sim":
            argument, axes = stack.enter_context(_emulated(speeds))
        else:
            axes = _axes(text, task)
        wire = stack.enter_context(contextlib.closing(SerialPort(argument)))
        yield GrblActuator(wire, axes)


@contextlib.contextmanager
def _emulated(speeds: Speeds) -> Iterator[tuple[str, Any]]:
    """An emulated controller on a pseudo-terminal, and its axes."""
    from dataclasses import replace

    from ntagen.drive.plant import simulated_axes, simulated_controller
    from ntagen.grbl.emulator import NoPlant
    from ntagen.grbl.pseudo import PseudoTerminal
    from ntagen.units import deg_from_rad

    axes = replace(
        simulated_axes(speeds.push_mm_per_s),
        pull_mm_per_s=speeds.pull_mm_per_s,
        roll_deg_per_s=deg_from_rad(speeds.roll_rad_per_s),
    )
    with PseudoTerminal(simulated_controller(NoPlant(), axes)) as terminal:
        yield terminal.name, axes


def _axes(text: str, task: Path | None) -> Any:  # noqa: ANN401  of a type that is imported late
    """The axes that a task describes for a controller."""
    if task is None:
        raise InputError(
            f"nothing says which axis of {text} does what\nhint: give --task TASK.nsl, whose "
            "`device` describes them"
        )
    found, settings = for_steppers(task)
    return axes_for(described(found, task), found.scene.needle, settings)


@contextlib.contextmanager
def _tracker(text: str) -> Iterator[LiveSensor]:
    """The tracker itself, without what is put around a plugin in a drive."""
    from ntagen.tracking.frames import IDENTITY
    from ntagen.tracking.live import LiveTracker, Source
    from ntagen.tracking.plugin import PluginSource, open_bare
    from ntagen.tracking.spec import parse_tracker

    source = parse_tracker(text)
    if isinstance(source, PluginSource):
        with open_bare(source, IDENTITY, time.monotonic) as inner:
            yield inner
    elif isinstance(source, Source):
        with LiveTracker(source, IDENTITY, time.monotonic) as live:
            yield live
    else:
        raise InputError(f"{text} is a recording, which is no device")
