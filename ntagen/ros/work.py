"""What a node does when it is asked: it arms, steers and pulls back (`ntagen.ros.session.Work`)."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

from ntagen.drive.device import LiveSensor, WatchedActuator
from ntagen.drive.fitting import overrun_mm
from ntagen.drive.outcome import Driven
from ntagen.drive.planning import mistakes_of_models
from ntagen.drive.real import RealRun, require_overrun
from ntagen.drive.records import Ended, Journal, Journals
from ntagen.drive.settings import Settings
from ntagen.drive.steppers import speeds_for
from ntagen.errors import DeviceError
from ntagen.needle.vectors import distance
from ntagen.plan.synthesise import Synthesiser
from ntagen.ros.bridge import Bridge
from ntagen.ros.clock import Clock
from ntagen.ros.frames import NeedleFrame
from ntagen.ros.hearing import Hearing
from ntagen.ros.inbox import DISCOVERY_S
from ntagen.ros.link import TopicLink
from ntagen.ros.log_topic import LogTopic
from ntagen.ros.observer import Observer
from ntagen.ros.stage import StageActuator
from ntagen.ros.subject import scene_for
from ntagen.ros.topics import ENTRY, LOG, TARGET, Topics
from ntagen.ros.tracker import tracker_of
from ntagen.scene import Scene
from ntagen.tracking.frames import IDENTITY, Transform
from ntagen.tracking.live import ANY_FRAME
from ntagen.tracking.plausible import DEEPEST_MM


class Task(Protocol):
    """What is steered, and what `ntagen ros` alone knows of it."""

    @property
    def scene(self) -> Scene:
        """The scene."""

    @property
    def settings(self) -> Settings:
        """How to drive."""

    @property
    def known(self) -> str:
        """The critical regions that the driver knows."""

    @property
    def is_behind_topics(self) -> bool:
        """Whether the needle is moved by a stage that is commanded over topics."""

    def moved_by(self) -> AbstractContextManager[WatchedActuator]:
        """Opens what moves the needle, if that is no stage behind topics."""

    def with_scene(self, scene: Scene) -> Task:
        """The same with another scene.

        Raises:
            InputError: It cannot be steered in.
        """

    def synthesiser(self, listen: Callable[[], None]) -> Synthesiser:
        """What finds plans."""

    @property
    def log_path(self) -> Path | None:
        """The log of the run, if there is one."""

    def journals(self) -> AbstractContextManager[list[Journal]]:
        """What else records the run, until the end of the block; the log is the first of them."""


class NodeWork:
    """The work of a node.

    Args:
        bridge: The node.
        topics: Names, frames and units.
        task: What is steered.
        transform: The registration.
    """

    def __init__(
        self, bridge: Bridge, topics: Topics, task: Task, transform: Transform = IDENTITY
    ) -> None:
        self.bridge = bridge
        self._topics = topics
        self._task = self._armed = task
        self._transform = transform
        entry = task.scene.needle.tip
        needle = NeedleFrame(entry)
        self.clock = Clock(bridge.time_s if bridge.is_simulated else None, self.fail)
        self._hearing = Hearing(
            bridge,
            topics,
            needle,
            self.clock,
            self._tip_frames(),
            hears_force=task.settings.force_sensing,
        )
        is_ours = task.is_behind_topics
        self._link = TopicLink(bridge, topics, needle, self.clock) if is_ours else None
        accept = task.settings.accept
        self.observer = Observer(bridge, topics, needle, accept, commands=not is_ours)
        self.driven: Driven | None = None
        self._stack = contextlib.ExitStack()
        self._run: RealRun | None = None
        self._devices: tuple[WatchedActuator, LiveSensor] | None = None
        self._listen: Callable[[], None] = lambda: None

    def __enter__(self) -> NodeWork:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def fail(self, trouble: str) -> None:
        """Notes that something is wrong for good: what moves is stopped."""
        self._hearing.inbox.fail(trouble)

    def _tip_frames(self) -> tuple[str, ...]:
        """The frames in which the tip may come; empty for any."""
        if self._transform == IDENTITY:
            return (self._topics.stage_frame,)
        return () if self._transform.source == ANY_FRAME else (self._transform.source,)

    def arm(self) -> str:
        """See `ntagen.ros.session.Work.arm`."""
        self._stack.close()
        self._devices = None
        self._wait_for_clock()
        self.clock.begin()
        self._hearing.inbox.forget()
        self._hearing.inbox.wait_for_first(with_force=self._task.settings.force_sensing)
        self._hearing.require_one_each()
        self._armed = self._with_subject()
        try:
            actuator = self._stack.enter_context(self._actuator())
            sensor = self._sensor(actuator)
            found = sensor.measure()
        except BaseException:
            self._stack.close()
            raise
        self._devices = (actuator, sensor)
        self._hearing.use(TARGET, self._armed.scene.targets[-1].center_mm)
        place = ", ".join(f"{number:.1f}" for number in found.position_mm)
        return f"the tip is seen at ({place}) mm; call the service start"

    def drive(self, listen: Callable[[], None]) -> Ended:
        """See `ntagen.ros.session.Work.drive`."""
        if self._devices is None:
            raise AssertionError("the needle is armed first")
        self._listen = listen
        task = self._armed
        with self._log_topic() as topic, task.journals() as journals:
            self._run = RealRun(
                task.scene,
                *self._devices,
                task.synthesiser(self._hear),
                task.settings,
                Journals(*journals, *topic, self.observer),
                known=task.known,
                listen=self._hear,
            )
            with mistakes_of_models():
                self.driven = self._run.drive()
            return self.driven.ended

    @contextlib.contextmanager
    def _log_topic(self) -> Iterator[list[LogTopic]]:
        """What publishes the log, if there is one; its rest at the end of the block."""
        path = self._armed.log_path
        if path is None:
            yield []
            return
        topic = LogTopic(self.bridge, self._topics.name(LOG), path)
        yield [topic]
        topic.finish()

    def halt(self) -> None:
        """See `ntagen.ros.session.Work.halt`; other devices look every 10 ms whether to stop."""
        actuator = None if self._devices is None else self._devices[0]
        if isinstance(actuator, StageActuator):
            # A stage that is silent was told nothing more.
            with contextlib.suppress(DeviceError):
                actuator.hold()

    def retract(self, listen: Callable[[], None]) -> None:
        """See `ntagen.ros.session.Work.retract`."""
        if self._run is None or self._devices is None:
            raise AssertionError("a needle that was not steered is not pulled back")
        self._listen = listen
        # What ended the run may be over; whether it is, the next samples show.
        self._hearing.inbox.forget()
        self._hearing.require_one_each()
        sensor = self._devices[1]
        sensor.measure()
        self._run.retract()
        entry_mm = self._armed.scene.needle.tip.position_mm
        away_mm = distance(sensor.measure().position_mm, entry_mm)
        if away_mm > DEEPEST_MM:
            raise DeviceError(
                f"by the commands the needle is at the entry, and the tip is seen {away_mm:.1f} mm "
                "from it\nhint: pull it back by hand"
            )

    def _hear(self) -> None:
        self._listen()

    def _wait_for_clock(self) -> None:
        """Waits for the first time of a simulated clock.

        Raises:
            DeviceError: Nobody says it.
        """
        if not self.clock.is_simulated:
            return
        end_s = time.monotonic() + DISCOVERY_S
        while self.bridge.time_s() == 0.0:
            if time.monotonic() > end_s:
                raise DeviceError(
                    "use_sim_time is set, and nobody publishes /clock\n"
                    "hint: start the simulation or the bag (`ros2 bag play --clock`), or leave "
                    "use_sim_time out"
                )
            time.sleep(0.02)

    @contextlib.contextmanager
    def _actuator(self) -> Iterator[WatchedActuator]:
        settings, needle = self._armed.settings, self._armed.scene.needle
        if self._link is None:
            with self._armed.moved_by() as actuator:
                yield actuator
            return
        ramp = self._topics.stage_ramp_mm_per_s2
        require_overrun(settings, overrun_mm(needle.speed_mm_per_s, ramp))
        speeds = speeds_for(needle, settings)
        self._link.begin()
        stage = StageActuator(self._link, speeds, self._topics.stage_tolerance_mm, ramp)
        try:
            yield stage
        finally:
            with contextlib.suppress(DeviceError):
                stage.stop()

    def _sensor(self, actuator: WatchedActuator) -> LiveSensor:
        settings = self._armed.settings
        moved = (lambda: actuator.moved_mm) if isinstance(actuator, StageActuator) else lambda: 0.0
        return tracker_of(
            self._hearing.inbox,
            self._topics,
            self._transform,
            self._armed.scene.needle.tip,
            actuator.now_s,
            moved,
            watches_force=settings.force_sensing,
            force_varies=settings.force_noise_n > 0.0,
        )

    def _with_subject(self) -> Task:
        """The task with the target that was told last, if one was.

        Raises:
            DeviceError: The entry or the target cannot be meant.
            InputError: There is no way to such a target.
        """
        entry_mm, target_mm = (self._hearing.told_mm(one) for one in (ENTRY, TARGET))
        scene = scene_for(self._task.scene, self._topics, entry_mm, target_mm)
        return self._task if scene is self._task.scene else self._task.with_scene(scene)
