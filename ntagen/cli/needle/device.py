"""`ntagen device`: tries a device before it drives a needle."""

from __future__ import annotations

import contextlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.needle.lab import command as simulate
from ntagen.cli.needle.plugins import check_plugin, for_steppers, installed, is_plugin
from ntagen.cli.needle.plugins import command as test
from ntagen.cli.needle.tracker import look_at
from ntagen.cli.terminal import echo, say_idle
from ntagen.drive.steppers import axes_for, described
from ntagen.errors import DeviceError, InputError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ntagen.grbl.axes import Axes
    from ntagen.grbl.check import Findings
    from ntagen.grbl.port import Port

_MOST_MM: Final = 10.0
_STEPPERS_ONLY: Final = {"motion": "--move", "yes": "--yes"}


_LENGTH: Final = click.FloatRange(min=0.0, max=_MOST_MM, min_open=True)


def _motion(value: object) -> tuple[str, float]:
    """An axis, X if none is named, and how far it is moved, in mm."""
    axis, _, length = str(value).rpartition(":")
    return axis or "X", float(_LENGTH(length))


@click.group("device")
def command() -> None:
    """Try a device before it drives a needle.

    \b
    Examples:
      ntagen device check grbl:/dev/ttyACM0
      ntagen device check openigtlink:localhost:18944
      ntagen device simulate examples/stepper.nsl
    """  # noqa: D301  click wants the control character


command.add_command(simulate)
command.add_command(test)


@command.command(
    "check",
    cls=Renamed,
    former={"--baud": "write grbl:PORT,baud={}", "--axis": "write --move {}:MM"},
    epilog="Exit codes: 0 it is ready, 2 the command line is wrong, 5 it is not ready.",
)
@click.argument("device", metavar="grbl:PORT|grbl+sim|TASK.nsl|openigtlink:HOST:PORT|PLUGIN")
@click.option(
    "--move",
    "motion",
    metavar="[AXIS:]MM",
    type=_motion,
    help=f"Also move an axis (X by itself) by this length, at most {_MOST_MM:g} mm, and back, "
    "after you agree.",
)
@click.option(
    "--listen",
    "listen_s",
    metavar="SECONDS",
    default=2.0,
    show_default=True,
    type=click.FloatRange(min=0.0, max=3600.0, min_open=True),
    help="Listen to a tracker for so long.",
)
@click.option("--yes", is_flag=True, help="Agree to --move beforehand.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
def check(
    device: str,
    motion: tuple[str, float] | None,
    listen_s: float,
    yes: bool,
    as_json: bool,
) -> int:
    """Look at a device and print what it is.

    The device is asked for its firmware, settings, limits and status. Nothing is moved, and no
    setting is changed. `grbl+sim` is an emulated controller on a pseudo-terminal. Of a task, the
    device that it describes is looked at, and its axes are compared with the description.

    Of a tracker, openigtlink:HOST:PORT[:DEVICE][,OPTION=VALUE]…, the devices that it sends are
    printed, with their rates and positions. Of a plugin, PLUGIN[:ARGUMENT], what it says about
    itself, and a measurement if it is a tracker; docs/plugins.md has more.

    \b
    Examples:
      ntagen device check grbl:/dev/ttyACM0
      ntagen device check task.nsl
      ntagen device check grbl+sim --move 2
      ntagen device check openigtlink:localhost:18944
    """  # noqa: D301  click wants the control character
    from ntagen.grbl.check import inspect

    if is_plugin(device):
        say_idle(_STEPPERS_ONLY | {"listen_s": "--listen"}, "with a plugin")
        return check_plugin(device, as_json=as_json)
    if device.startswith("openigtlink:"):
        say_idle(_STEPPERS_ONLY, "with a tracker")
        return look_at(device, listen_s, as_json=as_json)
    say_idle({"listen_s": "--listen"}, "without a tracker")
    axes = None
    if device.endswith(".nsl"):
        device, axes = _described(Path(device))
    with _port(device) as port:
        findings = inspect(port, axes)
        if not as_json:
            _tell(device, findings)
        moved = motion if motion is not None and _agreed(*motion, yes=yes) else None
        if moved is not None:
            _move(port, *moved)
    if as_json:
        echo(json.dumps(asdict(findings) | {"moved_mm": 0.0 if moved is None else moved[1]}))
    elif moved is not None:
        echo(f"moved {moved[0]} by {moved[1]:g} mm and back")
    else:
        echo("nothing was moved")
    if not findings.stands:
        raise DeviceError(f"{device}: the machine moves\nhint: stop what commands it")
    return 0


def _described(path: Path) -> tuple[str, Axes]:
    """The device that a task describes, and its axes."""
    task, settings = for_steppers(path)
    device = described(task, path)
    return f"grbl:{device.port}", axes_for(device, task.scene.needle, settings)


@contextlib.contextmanager
def _port(device: str) -> Iterator[Port]:
    """The port of a device, as long as it is needed."""
    from ntagen.grbl.port import SerialPort

    kind, _, name = device.partition(":")
    with contextlib.ExitStack() as stack:
        if device == "grbl+sim":
            from ntagen.grbl.dialects import GRBLHAL
            from ntagen.grbl.emulator import Emulator
            from ntagen.grbl.pseudo import PseudoTerminal

            emulator = Emulator(GRBLHAL)
            emulator.power_on()
            name = stack.enter_context(PseudoTerminal(emulator)).name
        elif kind != "grbl" or not name:
            raise InputError(
                f"there is no device '{device}'\n"
                "hint: write grbl:PORT, for example grbl:/dev/ttyACM0, or grbl+sim, or "
                f"openigtlink:HOST:PORT; installed plugins: {installed()}"
            )
        port = SerialPort(name)
        stack.callback(port.close)
        yield port


def _agreed(axis: str, length_mm: float, *, yes: bool) -> bool:
    """Whether the user wants the motion."""
    return yes or click.confirm(
        f"Move {axis} by {length_mm:g} mm and back? Take the needle out of the tissue first.",
        err=True,
    )


def _move(port: Port, axis: str, length_mm: float) -> None:
    """Moves an axis forth and back, watched as in a drive."""
    from ntagen.grbl.actuator import GrblActuator
    from ntagen.grbl.axes import Axes, Axis

    other = next(letter for letter in "YX" if letter != axis)
    axes = Axes(insert=Axis(axis), roll=Axis(other), pull_mm_per_s=1.0, roll_deg_per_s=1.0)
    actuator = GrblActuator(port, axes)
    actuator.push(length_mm)
    actuator.pull(length_mm)


def _tell(device: str, found: Findings) -> None:
    echo(f"{device}: {found.firmware} {found.version}, state {found.state}")
    for axis in found.axes:
        echo(
            f"  {axis.letter} at {axis.position:.3f}: {axis.steps_per_unit:g} steps per mm or "
            f"degree, at most {axis.speed:.4g} per s and {axis.acceleration:g} per s², "
            f"travel {axis.travel:g}"
        )
    for name, is_on in (
        ("soft limits", found.soft_limits),
        ("hard limits", found.hard_limits),
        ("homing", found.homing),
    ):
        echo(f"  {name}: {'on' if is_on else 'off'}")
    for note in found.notes:
        echo(f"  note: {note}")
