"""What a row may say about a lab, and what can be driven in one."""

from __future__ import annotations

from typing import Final

from ntagen.drive.configure import Configuration
from ntagen.drive.needles import LAB
from ntagen.errors import InputError
from ntagen.experiment.description import SPEED, Row
from ntagen.lab.speeds import FASTEST, SLOWEST
from ntagen.nsl import Task

REAL_TIME: Final = 1.0
"""The speed of a lab if nobody says otherwise."""

_SPEEDS: Final = f"a lab runs at {SLOWEST:g} to {FASTEST:g} times the speed of real time"


def mistake_in_speeds(speeds: list[object]) -> tuple[str, str] | None:
    """What is wrong with a list of speeds: cause and hint."""
    if not speeds:
        return "the list has no value", f"write for example speed = 10; {_SPEEDS}"
    for place, one in enumerate(speeds):
        is_number = isinstance(one, int | float) and not isinstance(one, bool)
        if not is_number or not SLOWEST <= one <= FASTEST:  # type: ignore[operator]
            return f"{one!r} is no speed", f"write for example speed = 10; {_SPEEDS}"
        if one in speeds[:place]:
            return f"{one} stands there twice", "leave one of them out"
    return None


def speed_of(needle: str, given: float | None) -> float | None:
    """The speed of a row: that which was given, and real time for a lab without one."""
    if given is None:
        return REAL_TIME if needle == LAB else None
    return float(given)


def mistake_in_lab(
    row: Row, task: Task, configuration: Configuration
) -> tuple[str, str, str] | None:
    """What is wrong with a row as far as labs go: key, cause and hint."""
    if row.needle != LAB:
        if row.speed is None:
            return None
        cause = f"it is that of a lab, and the needle is {row.needle}"
        return SPEED, cause, f'leave it out, or write needle = "{LAB}"'
    if task.scene.breath is not None:
        return "needle", "no region moves in a lab", "choose another needle for this scene"
    if task.scene.tissue.is_adversarial:
        return "needle", "no tissue answers in a lab", "choose another needle for this scene"
    # A lab opens ports: what that takes is imported for its rows only.
    from ntagen.experiment.in_lab import require_fitting

    try:
        require_fitting(task, configuration)
    except InputError as error:
        cause, _, hint = str(error).partition("\nhint: ")
        return "needle", cause, hint
    return None
