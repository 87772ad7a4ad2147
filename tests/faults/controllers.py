"""The controllers with real firmware that runs drive a needle with: programs of this computer.

Each takes a TCP connection for its serial line, and letters at its standard input, which turn
switches over. The tester builds them, or what runs in them (`docs/firmware.md`).
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

SOFT_MM = 12.0
"""The needle may go so deep where soft limits are on."""

_BRIDGE = Path(__file__).with_name("grbl_avr.c")


@dataclass(frozen=True)
class Controller:
    """A controller whose axis X inserts the needle.

    Attributes:
        name: What the tests call it.
        variable: The environment variable by which the tester names it.
        words: The command that starts it: of what was named, a folder for its settings, and a port.
        banner: How its greeting begins.
        axes: Its axes, in the order of its positions.
        roll: The axis that turns the needle.
        settings: What the task wants of these axes, and how fast they may be.
        soft_limits: The lines that let X go `SOFT_MM` further, and no more.
    """

    name: str
    variable: str
    words: Callable[[Path, Path, int], list[str]]
    banner: bytes
    axes: str
    roll: str
    settings: tuple[str, ...]
    soft_limits: tuple[str, ...]

    @property
    def is_named(self) -> bool:
        """Whether the tester has named it."""
        return self.variable in os.environ

    @property
    def program(self) -> Path:
        """What the tester has named."""
        return Path(os.environ[self.variable]).resolve()

    def start(self, folder: Path, port: int) -> subprocess.Popen[bytes]:
        """Switches it on; it listens soon afterwards.

        Args:
            folder: Where it keeps its settings.
            port: The TCP port for its serial line.
        """
        return subprocess.Popen(
            self.words(self.program, folder, port),
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd=folder,
            # So that Linux gives it a share of its own, whatever the driver computes.
            start_new_session=True,
        )


def _simulator(program: Path, folder: Path, port: int) -> list[str]:
    """The simulator on one core, as a microcontroller has one.

    Its firmware and its interrupts are two threads without a lock, so that side by side they lose
    what the other one says: the end of a motion, or an alarm.
    """
    one_core = ["taskset", "--cpu-list", str(max(os.sched_getaffinity(0)))]
    memory = str(folder / "settings.dat")
    return [*one_core, str(program), "-n", "-t", "1", "-e", memory, "-p", str(port)]


def _in_simavr(firmware: Path, folder: Path, port: int) -> list[str]:
    """The firmware in an ATmega328P of simavr, whose wires are compiled here."""
    bridge = folder / "grbl_avr"
    if not bridge.exists():
        words = ["cc", "-O2", "-I/usr/include/simavr", "-o", str(bridge), str(_BRIDGE), "-lsimavr"]
        subprocess.run(words, check=True)
    return [str(bridge), str(firmware), str(folder / "eeprom"), str(port)]


GRBLHAL = Controller(
    name="grblHAL",
    variable="NTAGEN_GRBLHAL_SIM",
    words=_simulator,
    banner=b"GrblHAL",
    axes="XYZA",
    roll="A",
    settings=("$1=255", "$100=80", "$103=5", "$110=600", "$113=7200", "$120=100", "$123=1000"),
    # X begins where it stands, by hand: limits count for an axis that has been homed.
    soft_limits=("$22=43", "$23=1", "$44=0", "$45=0", f"$130={SOFT_MM:g}", "$20=1", "$HX"),
)

GRBL_11H = Controller(
    name="GRBL 1.1h",
    variable="NTAGEN_GRBL_AVR",
    words=_in_simavr,
    banner=b"Grbl 1.1h",
    axes="XYZ",
    roll="Y",
    settings=("$1=255", "$100=80", "$101=5", "$110=600", "$111=7200", "$120=100", "$121=1000"),
    # All axes end at 0, and each must be able to turn both ways: so they first go back from there.
    soft_limits=(f"$J=G91 X-{SOFT_MM:g} Y-720 F7200", "$22=1", "$131=2000", "$20=1"),
)

CONTROLLERS = (GRBLHAL, GRBL_11H)
