"""What `ntagen drive --resume` takes from the log of a run, and what it refuses."""

from __future__ import annotations

import json
import re
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from ntagen.cli.loading import load_task
from ntagen.cli.needle.same_devices import (
    BY_HAND,
    device_of,
    needle_of,
    require_simulated,
    tracking_of_log,
)
from ntagen.cli.needle.tracker import Tracking
from ntagen.cli.options import path_option
from ntagen.cli.terminal import echo
from ntagen.errors import InputError
from ntagen.files import json_of, read_file, require_unlocked
from ntagen.values import dataclass

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ntagen.drive.configure import Configuration
    from ntagen.drive.needles import Chosen
    from ntagen.drive.past import Leg
    from ntagen.drive.reading import RunLog
    from ntagen.drive.records import Record
    from ntagen.hardware import GrblDevice
    from ntagen.nsl import Task
    from ntagen.plan.synthesise import Synthesis
    from ntagen.scene import Scene

_KEPT: Final = frozenset(
    {
        "environment",
        "resumed_path",
        "needle",
        "tracker",
        "registration",
        "confirm",
        "log_path",
        "is_watched",
        "foxglove_port",
        "as_json",
        "quiet",
        "include",
    }
)
"""What may stand beside --resume; all else is as the log has it."""

_RESUMED: Final = re.compile(r"(?P<stem>.+-resumed)(-(?P<number>[1-9][0-9]{0,3}))?")
_SHOWN: Final = 12
"""So many digits of a digest tell two of them apart."""

_MOST_LOGS: Final = 1000

_LONG_MIN: Final = 120.0

resume_option = path_option(
    "--resume",
    "resumed_path",
    metavar="RUN.mcap",
    help="Go on from the log of a run that was stopped, cut off or killed while the needle was in "
    "the tissue. Task, settings, needle and tracker are those of the log. The needle is measured "
    "and found in its channel, and nothing moves before you agree (docs/resuming.md).",
)
"""The log from which a run goes on."""


@dataclass(frozen=True, slots=True)
class Resumed:
    """A run that goes on.

    Attributes:
        log: The log from which it goes on.
        legs: The runs in it.
        task: The task: its true scene if that is known, and the device.
        configuration: The settings and the needle.
        needle: What moves the needle, in words.
        tracking: What measures it.
    """

    log: RunLog
    legs: tuple[Leg, ...]
    task: Task
    configuration: Configuration
    needle: str
    tracking: Tracking

    @property
    def known(self) -> str:
        """The critical regions that the driver knows; those of a real needle's scene are all."""
        return "all" if self.configuration.needle.is_real else self.log.metadata.get("known", "all")

    def facts(self) -> tuple[dict[str, str], dict[str, bytes]]:
        """What the new log says about the one from which it goes on, and that log itself."""
        from ntagen.drive.log import EARLIER, RESUMES, SOURCE
        from ntagen.drive.reading import MAX_RECORD_BYTES

        log = self.log
        data = read_file(log.path, MAX_RECORD_BYTES)
        named = {"file": log.path.name, "sha256": log.sha256}
        metadata = {RESUMES: json.dumps(named)}
        for name in ("environment", "known", "origins"):
            metadata[name] = log.metadata.get(name, "")
        source = {SOURCE: log.attachments[SOURCE]} if SOURCE in log.attachments else {}
        return metadata, {EARLIER: data, **source}


def resumed_of(
    path: Path,
    environment: Path | None,
    include: tuple[Path, ...],
    needle: str | None,
    tracker: str | None,
    registration: str | None,
) -> Resumed:
    """What the options mean beside --resume.

    Args:
        path: The log.
        environment: The task, if it is named.
        include: Folders from which it may include files.
        needle: The words of --needle, if they are given.
        tracker: Those of --tracker.
        registration: Those of --registration.

    Raises:
        InputError: Nothing can go on from this log, or not so.
    """
    from ntagen.drive.past import legs_of
    from ntagen.drive.reading import MAX_RECORD_BYTES, read_log

    _refuse_others()
    require_unlocked(
        path, f"{path} is the log of a run that is still driving\nhint: end that run first"
    )
    log = read_log(path)
    if log.file_bytes > MAX_RECORD_BYTES:
        raise InputError(
            f"{path} has {log.file_bytes / 2**20:.0f} MiB, and a log of more than "
            f"{MAX_RECORD_BYTES / 2**20:.0f} MiB does not fit into another one\n{BY_HAND}"
        )
    legs = legs_of(log)
    _require_in_tissue(path, legs)
    _require_newest(log)
    task = None if environment is None else load_task(environment, include)
    if task is not None:
        _require_same_task(log, task)
    configuration = _configuration_of(log)
    chosen = configuration.needle
    # The port may be another one now.
    name = needle_of(chosen, needle)
    configuration = replace(configuration, needle=replace(chosen, name=name))
    if chosen.is_real:
        tracking = tracking_of_log(log, tracker, registration)
        device = task.device if task is not None else device_of(log)
    else:
        require_simulated(log, tracker, registration)
        tracking, device = Tracking(), None
    return Resumed(log, legs, _task_of(log, chosen, device), configuration, name, tracking)


def new_log(resumed: RunLog, path: Path | None) -> Path:
    """Where the log of a run that goes on is written.

    After ``run.mcap`` comes ``run-resumed.mcap``, after that ``run-resumed-2.mcap``.

    Raises:
        InputError: There is a file already.
    """
    if path is None:
        stem = resumed.path.stem
        found = _RESUMED.fullmatch(stem)
        name = f"{found['stem']}-{int(found['number'] or 1) + 1}" if found else f"{stem}-resumed"
        path = resumed.path.with_name(f"{name}{resumed.path.suffix}")
    if path.exists():
        raise InputError(
            f"{path} is there already, and the log of a run that goes on replaces nothing\n"
            "hint: name another file with --log"
        )
    return path


def require_terminal() -> None:
    """Refuses to go on where nobody can be asked.

    Raises:
        InputError: There is no terminal.
    """
    if not sys.stdin.isatty():
        raise InputError(
            "a run goes on only if somebody at a terminal agrees, and there is none\n"
            "hint: run `ntagen drive --resume` in a terminal, where the needle can be seen"
        )


class FoundTeller:
    """A journal that prints what an answer relies on, where nothing else is printed."""

    def record(self, record: Record) -> None:
        """Prints where the needle was found."""
        from ntagen.drive.records import Found
        from ntagen.drive.story import text_of

        if isinstance(record, Found):
            echo(text_of(record) or "", err=True)

    def started(self, scene: Scene) -> None:
        """Prints nothing."""

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Prints nothing."""


def tell_past(resumed: Resumed) -> None:
    """Prints from what a run goes on, and how old that is: tissue relaxes meanwhile."""
    log, ended = resumed.log, resumed.legs[-1].ended
    last_s = log.records[-1].time_s if log.records else 0.0
    how = "was cut off" if ended is None else f"ended with '{ended.outcome}: {ended.reason}'"
    minutes = max(0.0, time.time() - log.path.stat().st_mtime) / 60.0
    ago = f"{minutes:.0f} min" if minutes < _LONG_MIN else f"{minutes / 60.0:.0f} h"
    echo(f"{log.path} {how} at {last_s:.2f} s, {ago} ago", err=True)


def _refuse_others() -> None:
    """Refuses options that would make the run another one.

    Raises:
        InputError: One stands on the command line.
    """
    context = click.get_current_context()
    source = click.core.ParameterSource.COMMANDLINE
    for one in context.command.params:
        name = one.name or ""
        if name not in _KEPT and context.get_parameter_source(name) is source:
            raise InputError(
                f"{one.opts[-1]} cannot stand beside --resume: a run goes on as it began, and all "
                "of that is in its log\nhint: leave it out, or begin anew at the entry"
            )


def _require_in_tissue(path: Path, legs: Sequence[Leg]) -> None:
    """Refuses runs after which there is nothing to go on with.

    Raises:
        InputError: The needle was not inserted, or is where it should be.
    """
    from ntagen.drive.past import depth_mm
    from ntagen.drive.states import State

    ended = legs[-1].ended
    if ended is not None and ended.outcome == State.TARGET_REACHED.value:
        raise InputError(
            f"{path}: this run has reached its target ({ended.reason}): there is nothing to go on "
            "with\nhint: `ntagen report` makes a page of it"
        )
    is_out = ended is not None and ended.outcome == State.PULLED_OUT.value
    pending = [leg.pending for leg in legs if leg.pending is not None]
    was_pushed = any(one.kind == "push" for one in pending)
    if is_out or (depth_mm(legs) <= 0.0 and not was_pushed):
        where = "after the needle was pulled out" if is_out else "before the needle was inserted"
        raise InputError(
            f"{path}: this run ended {where}\n"
            "hint: begin anew: `ntagen drive ENV.nsl`, with the needle at the entry"
        )


def _require_newest(log: RunLog) -> None:
    """Refuses a log from which another run has gone on: the needle was moved since.

    Raises:
        InputError: There is one in the same folder.
    """
    from ntagen.drive.log import RESUMES
    from ntagen.drive.reading import metadata_in

    others = [one for one in log.path.parent.glob("*.mcap") if one != log.path]
    for other in sorted(others)[:_MOST_LOGS]:
        named = metadata_in(other).get(RESUMES, "")
        if log.sha256 in named:
            raise InputError(
                f"{log.path}: {other.name} is the log of a run that went on from this one, and may "
                f"have moved the needle\nhint: ntagen drive --resume {other}"
            )


def _require_same_task(log: RunLog, task: Task) -> None:
    """Refuses a task that is not that of the log.

    Raises:
        InputError: It is another one.
    """
    from ntagen.drive.knowledge import told

    known = log.metadata.get("known", "all")
    names = {region.name for region in task.scene.criticals}
    is_known = known in ("all", "none") or {one.strip() for one in known.split(",")} <= names
    ours = _digest_of(told(task.scene, known)) if is_known else ""
    theirs = _digest_of(log.scene)
    if ours != theirs:
        raise InputError(
            f"{log.path}: this is the log of another task, '{log.scene.name}' with the digest "
            f"{theirs[:_SHOWN]}, and that of '{task.scene.name}' is {ours[:_SHOWN] or 'another'}\n"
            "hint: leave the task out: the log has its own"
        )


def _digest_of(scene: Scene) -> str:
    """The digest of a scene; where regions move, a run may begin at any phase."""
    from ntagen.drive.trees import digest_of

    return digest_of(scene if scene.breath is None else scene.at_clock(0.0))


def _configuration_of(log: RunLog) -> Configuration:
    """The settings and the needle of a log.

    Raises:
        InputError: It does not say so in the way in which it is written.
    """
    from ntagen.drive.configure import Configuration
    from ntagen.drive.json_values import value_from_json
    from ntagen.drive.needles import choose
    from ntagen.needle.errors import Errors
    from ntagen.needle.phantom_parameters import PhantomParameters

    metadata = log.metadata
    try:
        name = metadata["needle"]
        if "seed" not in metadata:
            return Configuration(settings=log.settings, needle=choose(name, Errors()))
        errors = Errors(
            noise_mm=json_of(metadata["noise_mm"]) or None,
            roll_rad=float(metadata["roll_error_rad"]),
            radius_mm=float(metadata["true_radius_mm"]),
            bevel_rad=float(metadata["true_bevel_rad"]),
        )
        chosen = choose(name, errors)
        if "phantom" in metadata:
            parameters = value_from_json(json_of(metadata["phantom"]), PhantomParameters)
            chosen = replace(chosen, parameters=parameters)
        return Configuration(log.settings, errors, int(metadata["seed"]), {}, chosen)
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise InputError(
            f"{log.path}: the log does not say which needle was driven: {error}\n{BY_HAND}"
        ) from error


def _task_of(log: RunLog, chosen: Chosen, device: GrblDevice | None) -> Task:
    """The task of a log: of a simulation with the regions that are really there."""
    from ntagen.nsl import Task

    if chosen.is_real:
        return Task(log.scene, device=device)
    return Task(replace(log.actual, needle=log.scene.needle))
