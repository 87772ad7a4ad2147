"""What `ntagen drive` and `ntagen ros` share: what is driven, its device, log and exit code."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from ntagen.cli.needle.answering_tissue import Wanted
from ntagen.cli.needle.same_devices import hardware_facts
from ntagen.cli.needle.tracker import Tracking
from ntagen.drive.states import State
from ntagen.errors import InputError
from ntagen.files import require_apart

if TYPE_CHECKING:
    from collections.abc import Iterator
    from contextlib import AbstractContextManager

    from ntagen.cli.needle.resume import Resumed
    from ntagen.drive.configure import Configuration
    from ntagen.drive.device import WatchedActuator
    from ntagen.drive.following import Course
    from ntagen.drive.records import Journal
    from ntagen.nsl import Task
    from ntagen.plan.policy import Policy
    from ntagen.scene import Scene


@dataclass(frozen=True, slots=True)
class Run:
    """What is driven: the file, its task, the settings, what is known, what moves and measures."""

    environment: Path
    task: Task
    configuration: Configuration
    known: str
    needle: str
    tracking: Tracking = field(default_factory=Tracking)
    wanted: Wanted = field(default_factory=Wanted)
    course: Course | None = None
    policy: Policy | None = None
    resumed: Resumed | None = None

    @property
    def scene(self) -> Scene:
        """The true scene."""
        return self.task.scene


def moved_by(run: Run) -> AbstractContextManager[WatchedActuator]:
    """Opens what moves a real needle behind steppers or a plugin.

    Raises:
        InputError: The task describes no such device, or it does not fit.
        DeviceError: It is not ready to move.
    """
    from ntagen.drive.needles import REAL
    from ntagen.drive.steppers import axes_for, described, opened_plugin, opened_steppers
    from ntagen.grbl.port import SerialPort

    settings, scene = run.configuration.settings, run.scene
    name, _, argument = run.needle.partition(":")
    if name != REAL:
        return opened_plugin(name, argument, scene.needle, settings)
    device = described(run.task, run.environment)
    axes = axes_for(device, scene.needle, settings)
    port = SerialPort(argument or device.port)
    return opened_steppers(port, axes, scene.needle, settings)


@contextlib.contextmanager
def log_of(path: Path | None, run: Run) -> Iterator[list[Journal]]:
    """The journal that writes the log, if one is wanted."""
    if path is None:
        yield []
        return
    from ntagen.drive.knowledge import told
    from ntagen.drive.log import POLICY, TREE, Log
    from ntagen.drive.log_facts import facts_of

    # Mistakes on the command line must be found before an earlier log is replaced.
    told(run.scene, run.known)
    require_apart({"--log": path}, {"environment": run.environment})
    # Of a run that goes on, the log before it has the source.
    source = run.environment if run.resumed is None else Path()
    metadata, attachments = facts_of(
        source, run.scene, run.configuration, run.known, run.tracking.text
    )
    metadata |= hardware_facts(run.task, run.tracking.transform)
    if run.course is not None:
        from ntagen.drive.trees import COURSE, course_to_log

        metadata[COURSE], tree = course_to_log(run.course)
        attachments |= {} if tree is None else {TREE: tree}
    if run.policy is not None:
        attachments[POLICY] = run.policy.text().encode()
    if run.resumed is not None:
        of_before, log_before = run.resumed.facts()
        metadata, attachments = metadata | of_before, attachments | log_before
    with Log(path, metadata, attachments) as log:
        try:
            yield [log]
        except InputError:
            if run.resumed is not None and log.is_empty:
                # The run could not go on, and its log was not there before.
                path.unlink(missing_ok=True)
            raise


def exit_code(outcome: str) -> int:
    """The exit code of a run by how it ended."""
    return {
        State.TARGET_REACHED: 0,
        State.NO_STRATEGY: 1,
        State.NONE_HOLDS: 4,
        State.NO_TIME_LEFT: 6,
        State.NOT_GUARANTEED: 4,
        State.TIMED_OUT: 3,
        State.FAULTED: 5,
        State.PULLED_OUT: 7,
        State.INTERRUPTED: 130,
    }[State(outcome)]
