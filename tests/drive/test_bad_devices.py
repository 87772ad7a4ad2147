"""What can be wrong with a controller or a tracker before a run: one message, and nothing moves."""

from __future__ import annotations

import contextlib
import errno
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
import serial

from ntagen.cli import main
from ntagen.grbl.emulator import Emulator
from ntagen.grbl.port import SerialPort
from ntagen.lab.lab import Lab
from ntagen.lab.needles import place
from ntagen.needle.virtual import Errors
from ntagen.nsl import load

TASK = Path(__file__).parents[2] / "examples" / "stepper.nsl"
SCENE = load(TASK)


@dataclass
class Desk:
    """A lab, and the words with which a driver is started."""

    lab: Lab
    folder: Path
    port: str = ""
    tracker: str = ""
    registration: str = "none"
    more: list[str] = field(default_factory=list)

    def words(self) -> list[str]:
        words = ["drive", str(TASK), "--quiet", "--set", "force noise 0 N", *self.more]
        words += ["--needle", f"grbl:{self.port or self.lab.port}"]
        words += ["--tracker", self.tracker or self.lab.tracker_address]
        return words + (["--registration", self.registration] if self.registration else [])


@pytest.fixture
def desk(tmp_path: Path) -> Iterator[Desk]:
    with Lab(SCENE, place("virtual", SCENE, 1, 2.0, Errors()), speed=20.0) as lab:
        yield Desk(lab, tmp_path)


# What is wrong, each with its exit code and words of the message. A preparation may give what must
# be closed again.

Preparation = Callable[[Desk], object]
CASES: dict[str, tuple[Preparation, int, str]] = {}


def case(name: str, code: int, says: str) -> Callable[[Preparation], Preparation]:
    def add(prepare: Preparation) -> Preparation:
        CASES[name] = (prepare, code, says)
        return prepare

    return add


@case("wrong port", 5, "there is no such port")
def _(desk: Desk) -> None:
    desk.port = str(desk.folder / "ttyACM7")


@case("no serial port", 5, "this is no serial port")
def _(desk: Desk) -> None:
    (desk.folder / "file").write_text("")
    desk.port = str(desk.folder / "file")


@case("busy port", 5, "another program uses this port")
def _(desk: Desk) -> object:
    return SerialPort(desk.lab.port)


@case("wrong baud rate", 5, "check the baud rate")
def _(desk: Desk) -> None:
    take = desk.lab.emulator.take
    # A receiver that samples at another rate takes other bits for each byte.
    garble(desk.lab.emulator, lambda: bytes((7 * byte + 129) % 256 for byte in take()))


@case("wrong firmware", 5, "no reply of GRBL")
def _(desk: Desk) -> None:
    take = desk.lab.emulator.take
    garble(desk.lab.emulator, lambda: b"echo:Unknown command\nok\n" if take() else b"")


@case("old firmware", 5, "which has no real-time jog cancel")
def _(desk: Desk) -> None:
    take = desk.lab.emulator.take
    garble(desk.lab.emulator, lambda: take().replace(b"[VER:1.1", b"[VER:0.9"))


@case("silent controller", 5, "nothing answers")
def _(desk: Desk) -> None:
    desk.lab.emulator.faults.is_silent = True


@case("locked controller", 5, "locked by an alarm")
def _(desk: Desk) -> None:
    with desk.lab.lock:
        desk.lab.emulator.raise_alarm(3)


@case("other steps", 5, "steps")
def _(desk: Desk) -> None:
    with desk.lab.lock:
        assert desk.lab.emulator.memory.store(100, "80") == 0


@case("no tracker there", 5, "cannot connect to the tracker")
def _(desk: Desk) -> None:
    desk.lab.server.close()


@case("another tool", 5, "does not send the position of")
def _(desk: Desk) -> None:
    desk.tracker = desk.lab.tracker_address.replace("NeedleTip", "Stylus")


@case("no force", 2, "measures no force")
def _(desk: Desk) -> None:
    desk.tracker = desk.lab.tracker_address.replace(",force=Force", "")


@case("no registration", 2, "nothing says where the scene lies")
def _(desk: Desk) -> None:
    desk.registration = ""


@case("registration of another frame", 2, "comes in the frame Tracker, but the registration")
def _(desk: Desk) -> None:
    desk.tracker = desk.lab.tracker_address.replace("NeedleTip", "NeedleToTracker")
    desk.registration = str(registration(desk.folder, "Reference"))


@case("tracker in another frame", 5, "heading that is 180 deg")
def _(desk: Desk) -> None:
    # LPS for RAS: the entry is at the origin, so only the directions tell.
    desk.lab.faults.signs = (-1.0, -1.0, 1.0)


@case("mirrored frame", 5, "it mirrors")
def _(desk: Desk) -> None:
    desk.lab.faults.signs = (1.0, -1.0, 1.0)


@case("uncalibrated frame", 5, "mm from the entry")
def _(desk: Desk) -> None:
    desk.lab.faults.jump_mm = (120.0, -40.0, 900.0)


@case("needle in the tissue", 5, "6.0 mm beyond the entry")
def _(desk: Desk) -> None:
    desk.lab.faults.jump_mm = (0.0, -6.0, 0.0)


@case("hidden tool", 5, "NeedleTip")
def _(desk: Desk) -> None:
    desk.lab.faults.is_lost = True


@case("no room for the log", 2, "no space left")
def _(desk: Desk) -> None:
    desk.more = ["--log", "/dev/full"]


def garble(emulator: Emulator, take: Callable[[], bytes]) -> None:
    emulator.take = take  # type: ignore[method-assign]


def registration(folder: Path, source: str) -> Path:
    """A registration that `ntagen calibrate` makes, from a frame."""
    corners = [(0, 0, 0), (100, 0, 0), (0, 100, 0), (0, 0, 100)]
    rows = [",".join(map(str, (f"P{i}", *p, *p))) for i, p in enumerate(corners)]
    axes = [f"{frame}_{axis}_mm" for frame in (source.lower(), "scene") for axis in "xyz"]
    table, made = folder / "points.csv", folder / "registration.json"
    table.write_text("\n".join([",".join(["name", *axes]), *rows]) + "\n")
    assert main(["calibrate", str(table), "-o", str(made)]) == 0
    return made


SLOW = ("wrong baud rate", "wrong firmware", "silent controller")
"""A controller may need three seconds to start."""


@pytest.mark.parametrize(
    "name",
    [pytest.param(one, marks=pytest.mark.slow) if one in SLOW else one for one in CASES],
)
def test_what_is_wrong_is_said_once_and_nothing_moves(
    desk: Desk, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    prepare, code, says = CASES[name]
    held = prepare(desk)
    capsys.readouterr()
    try:
        assert main(desk.words()) == code
    finally:
        if isinstance(held, SerialPort):
            held.close()
    said = "".join(capsys.readouterr())
    assert says in said
    assert said.count("hint:") == 1
    assert "Traceback" not in said
    assert not desk.lab.truth().has_moved


def test_a_port_that_nobody_may_use(
    desk: Desk, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Root may use every port, so the operating system's answer is played."""

    def refuse(*_: object, **__: object) -> None:
        raise serial.SerialException(errno.EACCES, "could not open port: Permission denied")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    assert main(desk.words()) == 5
    said = "".join(capsys.readouterr())
    assert "you may not use this port" in said
    assert said.count("hint:") == 1
    assert not desk.lab.truth().has_moved


def test_a_fault_before_the_first_motion_is_in_the_summary_too(
    desk: Desk, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    desk.lab.faults.jump_mm = (0.0, -30.0, 0.0)
    words = [*desk.words(), "--json", "--log", str(tmp_path / "run.mcap")]
    with contextlib.suppress(ValueError):
        words.remove("--quiet")
    assert main(words) == 5
    summary = json.loads(capsys.readouterr().out)
    assert summary["outcome"] == "device fault"
    assert "30.0 mm from the entry" in summary["reason"]
    assert summary["depth_mm"] == 0.0
    assert not desk.lab.truth().has_moved
