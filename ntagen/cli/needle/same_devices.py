"""The devices of a run that goes on: those of its log, and what a log must say about them."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.cli.needle.tracker import NO_REGISTRATION, Tracking
from ntagen.errors import InputError
from ntagen.files import json_of

if TYPE_CHECKING:
    from ntagen.drive.needles import Chosen
    from ntagen.drive.reading import RunLog
    from ntagen.hardware import GrblDevice
    from ntagen.nsl import Task
    from ntagen.tracking.frames import Transform

DEVICE: Final = "device"
"""The entry of a log with the axes of the controller, as the task describes them."""

REGISTRATION: Final = "registration"
"""The entry of a log with the registration of the tracker."""

BY_HAND: Final = "hint: pull the needle back by hand, and begin anew at the entry"
"""What is left where nothing can go on."""


def hardware_facts(task: Task, transform: Transform | None) -> dict[str, str]:
    """What a log must say about devices, so that a run can go on with the same ones."""
    from ntagen.tracking.transform_file import transform_to_json

    facts = {}
    if task.device is not None:
        facts[DEVICE] = json.dumps(asdict(task.device))
    if transform is not None:
        facts[REGISTRATION] = json.dumps(transform_to_json(transform))
    return facts


def needle_of(chosen: Chosen, given: str | None) -> str:
    """What moves the needle: as in the log, perhaps at another port.

    Raises:
        InputError: It is another kind of device.
    """
    if given is None or given == chosen.name:
        return chosen.name
    if chosen.is_real and given.partition(":")[0] == chosen.name.partition(":")[0]:
        return given
    raise InputError(
        f"the log is of a run with --needle {chosen.name}, not {given}\n"
        "hint: leave --needle out; only the port of the same kind of device may be another one"
    )


def tracking_of_log(log: RunLog, given: str | None, registration: str | None) -> Tracking:
    """What measures a real needle: the tracker of the log, with its registration.

    Raises:
        InputError: It is another tracker, or cannot say where the needle is now.
    """
    from ntagen.tracking.frames import IDENTITY
    from ntagen.tracking.live import Source
    from ntagen.tracking.spec import no_registration, parse_tracker
    from ntagen.tracking.transform_file import read_transform, transform_in

    text = log.metadata.get("tracker", "")
    logged = parse_tracker(text)
    tracker = logged if given is None else parse_tracker(given)
    if isinstance(logged, Source) and isinstance(tracker, Source):
        same = replace(tracker, host=logged.host, port=logged.port) == logged
        if not tracker.repeats:
            raise InputError(
                f"the tracker {text} sends changes only, so nobody knows whether a reading of a "
                f"needle at rest is a fresh one\n{BY_HAND}"
            )
    else:
        same = tracker == logged
    if not same:
        raise InputError(
            f"the log is of a run with --tracker {text}, not {given}\n"
            "hint: leave --tracker out; only host and port of the server may be other ones"
        )
    if REGISTRATION in log.metadata:
        if registration is not None:
            raise InputError(
                "--registration cannot stand beside --resume: the log has its own\n"
                "hint: leave it out"
            )
        with log.naming():
            transform = transform_in(log.metadata[REGISTRATION], "the registration")
    elif registration is None:
        raise no_registration()
    else:
        is_none = registration == NO_REGISTRATION
        transform = IDENTITY if is_none else read_transform(Path(registration))
    return Tracking(text if given is None else given, tracker, transform)


def require_simulated(log: RunLog, tracker: str | None, registration: str | None) -> None:
    """Refuses simulated needles that cannot be brought back by the motions in the log.

    Raises:
        InputError: This is one.
    """
    lab = "hint: a needle in a lab (`ntagen device simulate`) keeps its place"
    if tracker is not None or registration is not None:
        raise InputError("the simulated needle of this log measures itself\nhint: no --tracker")
    if log.metadata.get("tracker"):
        raise InputError(
            f"{log.path}: a simulated needle that {log.metadata['tracker']} measured cannot be "
            f"brought back\n{lab}"
        )
    if log.scene.tissue.is_adversarial:
        raise InputError(
            f"{log.path}: the log does not say what the simulated tissue answered, so its needle "
            f"cannot be brought back\n{lab}"
        )


def device_of(log: RunLog) -> GrblDevice | None:
    """The device of the task, as the log has it.

    Raises:
        InputError: It does not say so in the way in which it is written.
    """
    from ntagen.drive.json_values import value_from_json
    from ntagen.hardware import GrblDevice

    if DEVICE not in log.metadata:
        return None
    try:
        return value_from_json(json_of(log.metadata[DEVICE]), GrblDevice)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{log.path}: the device cannot be read: {error}") from error
