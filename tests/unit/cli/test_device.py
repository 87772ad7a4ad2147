"""The command device: what it prints, and one message for each thing that can be wrong."""

from __future__ import annotations

import json
import os
import pty
import tty
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import serial

from ntagen.cli import main
from ntagen.errors import DeviceError
from ntagen.grbl.check import inspect
from ntagen.grbl.dialects import GRBL_11H, GRBLHAL, Dialect
from ntagen.grbl.emulator import Emulator, SimulatedPort
from ntagen.grbl.memory import Memory
from ntagen.grbl.port import Port, SerialPort
from ntagen.grbl.pseudo import PseudoTerminal

EXAMPLE = Path(__file__).parents[3] / "examples" / "paper.nsl"


def check_refused(capsys: pytest.CaptureFixture[str], code: int, says: str, *words: str) -> None:
    assert main(["device", "check", *words]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert err.count("hint:") == 1
    assert "Traceback" not in err


def test_the_emulated_device_is_found_by_its_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["device", "check", "grbl+sim"]) == 0
    out = capsys.readouterr().out
    assert "grblHAL 1.1f.20260817, state Idle" in out
    assert "A at 0.000: 250 steps per mm or degree" in out
    assert "set $1=255" in out
    assert out.endswith("nothing was moved\n")


@pytest.mark.slow
def test_a_device_moves_only_when_that_is_agreed(capsys: pytest.CaptureFixture[str]) -> None:
    emulator = Emulator(GRBL_11H)
    emulator.power_on()
    with PseudoTerminal(emulator, speed=5.0) as terminal:
        device = f"grbl:{terminal.name}"
        assert main(["device", "check", device, "--json", "--move", "1", "--yes"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert (found["firmware"], found["moved_mm"], found["stands"]) == ("GRBL", 1.0, True)
        assert emulator.position == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
        # The standard input of tests is empty, which is no agreement.
        assert main(["device", "check", device, "--move", "1"]) != 0
        assert main(["device", "check", device, "--move", "A:1", "--yes"]) == 5
    assert "no axis A" in capsys.readouterr().err


def test_the_device_of_a_task_is_compared_with_its_description(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def write(device: str) -> str:
        path = tmp_path / "task.nsl"
        path.write_text(f"{EXAMPLE.read_text().rstrip().removesuffix('}')} {device} }}")
        return str(path)

    emulator = Emulator(GRBLHAL, memory=Memory(GRBLHAL, {100: 80.0, 103: 8.889, 113: 6000.0}))
    emulator.power_on()
    with PseudoTerminal(emulator, speed=5.0) as terminal:
        for steps, code in ((80, 0), (-80, 0), (160, 5)):
            axes = f"insert X {steps} steps/mm  roll A 8.89 steps/deg"
            task = write(f'device grbl "{terminal.name}" {{ {axes} }}')
            assert main(["device", "check", task]) == code
    assert "makes 80 steps per mm, but 160 are expected" in capsys.readouterr().err
    check_refused(capsys, 2, "the task describes no device", write(""))


@pytest.fixture
def terminal() -> Iterator[str]:
    """A pseudo-terminal with nothing behind it."""
    here, there = pty.openpty()
    tty.setraw(there)
    yield os.ttyname(there)
    os.close(here)
    os.close(there)


def test_a_busy_port_is_refused(capsys: pytest.CaptureFixture[str], terminal: str) -> None:
    port = SerialPort(terminal)
    check_refused(capsys, 5, "another program uses this port", f"grbl:{terminal}")
    port.close()


def test_wrong_ports_are_refused(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("")
    check_refused(capsys, 5, "there is no such port", f"grbl:{tmp_path / 'none'}")
    check_refused(capsys, 5, "this is no serial port", f"grbl:{file}")
    check_refused(capsys, 5, "this is no serial port", "grbl:/dev/null")
    check_refused(capsys, 2, "there is no device 'stepper'", "stepper")
    check_refused(capsys, 2, "there is no device 'grbl:'", "grbl:")


def test_a_port_without_permission_is_refused(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # The tests may run as root, who may use every port.
    def refuse(*_: object, **__: object) -> None:
        raise serial.SerialException(13, "could not open port: Permission denied")

    monkeypatch.setattr(serial, "serial_for_url", refuse)
    check_refused(capsys, 5, "you may not use this port", "grbl:/dev/ttyACM0")


class Talker:
    """A port at which something else than GRBL answers, on a clock of its own."""

    name = "talker"

    def __init__(self, answer: Callable[[bytes], bytes]) -> None:
        self.written = b""
        self._answer = answer
        self._pending = b""
        self._now_s = 0.0

    def now_s(self) -> float:
        return self._now_s

    def read(self, timeout_s: float) -> bytes:
        data, self._pending = self._pending, b""
        self._now_s += 0.001 if data else timeout_s
        return data

    def write(self, data: bytes) -> None:
        self.written += data
        self._pending += self._answer(data)

    def close(self) -> None:
        pass


def check_nothing_moves(port: Port, says: str) -> None:
    with pytest.raises(DeviceError, match=says) as raised:
        inspect(port)
    assert "hint:" in str(raised.value)


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (lambda _: b"", "nothing answers"),
        (lambda _: b"\xf8\x80\x00\xfe\n", "check the baud rate"),
        (lambda _: b"\xf8" * 700, "check the baud rate"),
        (lambda _: b"T:21.0 /0.0\nok\n", "no reply of GRBL"),
        (lambda sent: b"<Idle|MPos:0.000|FS:0,0>\n" if b"?" in sent else b"", "did not answer ''"),
        (
            lambda sent: b"<Idle|MPos:0.000|FS:0,0>\n" if b"?" in sent else b"ok\n",
            "does not tell its version",
        ),
        (
            lambda sent: b"<Idle|MPos:0,0,0>\n" if b"?" in sent else b"[VER:0.9j.2016:]\nok\n",
            "the firmware is GRBL 0.9j",
        ),
        (
            lambda sent: b"<Idle,MPos:0.000,0.000,0.000,WPos:0.000,0.000,0.000>\r\n",
            "the firmware is GRBL 0.9 or older",
        ),
        (lambda _: b"\xf8\x80\x00\xfe", "check the baud rate"),
        (lambda _: b"<Critical|MPos:0.000,0.000>\r\n", "the state Critical"),
    ],
)
def test_what_is_no_grbl_is_refused(answer: Callable[[bytes], bytes], says: str) -> None:
    port = Talker(answer)
    check_nothing_moves(port, says)
    assert not any(word in port.written for word in (b"G", b"J", b"X", b"\x18"))


@pytest.mark.parametrize("dialect", [GRBL_11H, GRBLHAL], ids=lambda d: d.name)
def test_a_check_changes_nothing(dialect: Dialect) -> None:
    emulator = Emulator(dialect, memory=Memory(dialect, {22: 0.0, 21: 1.0, 1: 255.0}))
    emulator.power_on()
    emulator.press("Z")
    before = emulator.memory.lines()
    found = inspect(SimulatedPort(emulator))
    assert (found.hard_limits, found.homing, found.stands, found.pins) == (True, False, True, "Z")
    assert found.notes == ("input pins are active: Z",)
    assert emulator.memory.lines() == before
    assert not any(emulator.position)


def test_a_machine_that_moves_or_is_locked_is_not_ready() -> None:
    emulator = Emulator(GRBLHAL)
    emulator.power_on()
    emulator.advance(0.1)
    emulator.feed(b"$J=G91X20F60\n")
    emulator.advance(1.0)
    check_nothing_moves(SimulatedPort(emulator), "moving already")
    emulator.raise_alarm(3)
    check_nothing_moves(SimulatedPort(emulator), "locked by an alarm")
