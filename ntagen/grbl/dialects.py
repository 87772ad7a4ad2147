"""What differs between the firmwares that the emulator can stand for.

The texts and default settings are what GRBL 1.1h (2019-08-30, built for three axes) and grblHAL
(2026-08-17, built for four axes) said when they were asked; the recordings are in the tests.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Dialect:
    """A firmware.

    Attributes:
        name: What users call it.
        axes: The letters of its axes.
        banner: What it says after a reset.
        build: What it says to ``$I``.
        settings: The default settings, as they are printed.
        systems: The coordinate systems that ``$#`` lists.
        modal_tail: What ``$G`` prints between the feed mode and the spindle.
        speed_end: What follows the spindle speed there.
        latches: Whether a refused line locks G-code until an empty line or a ``$`` command.
        is_hal: Whether reports are those of grblHAL.
        sleeps: Whether ``$SLP`` is known.
        max_line: The longest line, without its end.
        receive_bytes: How much it can receive before it reads.
        planner_blocks: How many motions it can hold.
        lead_s: How far it computes the motion ahead.
        line_s: The time until a line is answered.
        status_s: The time until ``?`` is answered.
        reset_s: The time from a reset to the banner.
        alarm_s: The time from an alarm to the banner of the reset that caused it.
    """

    name: str
    axes: str
    banner: str
    build: tuple[str, ...]
    settings: dict[int, str]
    systems: tuple[str, ...]
    modal_tail: str
    speed_end: str
    latches: bool
    is_hal: bool
    sleeps: bool
    max_line: int
    receive_bytes: int
    planner_blocks: int
    lead_s: float
    line_s: float
    status_s: float
    reset_s: float
    alarm_s: float


def _settings(text: str) -> dict[int, str]:
    """Settings from words such as ``0=10``."""
    return {int(number): value for number, _, value in (w.partition("=") for w in text.split())}


GRBL_11H: Final = Dialect(
    name="GRBL 1.1h",
    axes="XYZ",
    banner="Grbl 1.1h ['$' for help]",
    build=("[VER:1.1h.20190830:]", "[OPT:V,15,128]"),
    settings=_settings(
        """
        0=10 1=25 2=0 3=0 4=0 5=0 6=0 10=1 11=0.010 12=0.002 13=0 20=0 21=0 22=0 23=0 24=25.000
        25=500.000 26=250 27=1.000 30=1000 31=0 32=0 100=250.000 101=250.000 102=250.000
        110=500.000 111=500.000 112=500.000 120=10.000 121=10.000 122=10.000 130=200.000
        131=200.000 132=200.000
        """
    ),
    systems=("G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92"),
    modal_tail="",
    speed_end="",
    latches=False,
    is_hal=False,
    sleeps=True,
    max_line=78,
    receive_bytes=127,
    planner_blocks=15,
    lead_s=0.05,
    line_s=0.004,
    status_s=0.002,
    reset_s=0.02,
    alarm_s=0.5,
)

GRBLHAL: Final = Dialect(
    name="grblHAL",
    axes="XYZA",
    banner="GrblHAL 1.1f ['$' or '$HELP' for help]",
    build=(
        "[VER:1.1f.20260817:]",
        "[OPT:VNML+,100,1024,4,0]",
        "[AXS:4:XYZA]",
        "[NEWOPT:ENUMS,RT+,TC,SED]",
        "[FIRMWARE:grblHAL]",
        "[SIGNALS:D]",
        "[NVS STORAGE:*EEPROM]",
        "[DRIVER:Simulator]",
        "[DRIVER VERSION:260324]",
    ),
    settings=_settings(
        """
        0=5.0 1=25 2=0 3=0 4=15 5=0 6=0 9=1 10=511 11=0.010 12=0.002 13=0 14=0 15=0 17=0 18=0 19=0
        20=0 21=0 22=0 23=0 24=25.0 25=500.0 26=250 27=1.000 28=0.100 29=0.0 30=1000.000 31=0.000
        32=0 33=5000.0 34=0.0 35=0.0 36=100.0 37=0 39=1 40=0 41=0 42=2 43=1 44=4 45=3 46=0 47=0
        56=5.0 57=100.0 58=-5.0 59=500.0 60=0 61=0 62=0 63=3 64=0 65=0 100=250.00000 101=250.00000
        102=250.00000 103=250.00000 110=500.000 111=500.000 112=500.000 113=500.000 120=10.000
        121=10.000 122=10.000 123=10.000 130=200.000 131=200.000 132=200.000 133=200.000 341=0
        342=30.0 343=25.0 344=200.0 345=200.0 346=1 376=1 384=0 392=4.0 393=1.0 394=0.0 398=100
        481=0 485=0 486=0 538=0 539=0.0 673=0.0 676=15 680=0 701=0
        """
    ),
    systems=(
        *("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"),
        *("G28", "G30", "G92"),
    ),
    modal_tail=" G40 G49 G98 G50",
    speed_end=".",
    latches=True,
    is_hal=True,
    sleeps=False,
    max_line=255,
    receive_bytes=1023,
    planner_blocks=100,
    lead_s=0.05,
    line_s=0.004,
    status_s=0.002,
    reset_s=0.02,
    alarm_s=0.5,
)
