"""What the numbers in ``error:n`` and ``ALARM:n`` mean, in our own words.

Numbers up to 38 (errors) and 9 (alarms) are those of GRBL 1.1; the others come from grblHAL.
"""

from __future__ import annotations

from typing import Final

ERRORS: Final[dict[int, str]] = {
    1: "a word of G-code has no letter",
    2: "a number is missing or malformed",
    3: "the controller does not know this $ command",
    4: "a value must not be negative",
    5: "homing is switched off",
    6: "the step pulse is too short",
    7: "the stored settings could not be read, so the defaults are in use",
    8: "this $ command is allowed only while the machine is idle",
    9: "G-code is locked during an alarm or a jog",
    10: "soft limits need homing, which is switched off",
    11: "the line is too long",
    12: "the step rate of this setting is too high",
    13: "the safety door is open",
    14: "the start-up line or the build info is too long",
    15: "the jog would leave the travel of the machine",
    16: "the jog command is malformed",
    17: "laser mode needs a spindle with variable speed",
    18: "the reset input is active",
    19: "a position cannot be reached",
    20: "the controller does not know this G-code word",
    21: "two words of one modal group are in the same line",
    22: "no feed rate is set",
    23: "a word needs a whole number",
    24: "two words of the line both want the axis values",
    25: "a word is repeated in the line",
    26: "the line needs axis values and has none",
    27: "the line number is out of range",
    28: "a word that the command needs is missing",
    29: "this coordinate system does not exist",
    30: "G53 is allowed with G0 and G1 only",
    31: "there are axis values that nothing uses",
    32: "an arc needs axis values in its plane",
    33: "the arc or the probe target is impossible",
    34: "the arc's radius is impossible",
    35: "an arc needs offsets in its plane",
    36: "the line has words that nothing uses",
    37: "the tool length can be changed on its own axis only",
    38: "the tool number is too large",
    39: "a parameter has a wrong value",
    45: "the axes are not homed",
    50: "the emergency stop is active",
    52: "the value of the setting is out of range",
    53: "the setting is switched off",
    60: "there is no storage card",
    70: "a Bluetooth error",
    79: "the controller is locked until the alarm is over",
}

CRITICAL_ALARMS: Final = (1, 2)
"""After these, a controller obeys nothing but a reset; GRBL 1.1 does not even give its status."""

ALARMS: Final[dict[int, str]] = {
    1: "a limit switch was hit",
    2: "the target is outside the travel of the machine",
    3: "a reset came in motion, so the position may be lost",
    4: "the probe was not in its first state",
    5: "the probe did not touch",
    6: "homing was reset",
    7: "the safety door was opened while homing",
    8: "homing did not leave the limit switch",
    9: "homing did not find the limit switch",
    10: "the emergency stop is active",
    11: "the machine must be homed first",
    12: "a limit switch is active",
    13: "the probe protection stopped the motion",
    14: "the spindle did not reach its speed",
    15: "homing of an auto-squared axis failed",
    16: "the controller's self-test failed",
    17: "a motor driver reports a fault",
    18: "homing failed",
}

UNKNOWN: Final = "the controller does not say what this number means"


def error_text(code: int) -> str:
    """The meaning of ``error:code``, with the number."""
    return f"error:{code} ({ERRORS.get(code, UNKNOWN)})"


def alarm_text(code: int) -> str:
    """The meaning of ``ALARM:code``, with the number."""
    return f"ALARM:{code} ({ALARMS.get(code, UNKNOWN)})"
