"""A lab made of nodes: a stage with a needle in tissue, its tracker, its force sensor, its subject.

To `ntagen ros` all of that is real: it hears and commands topics. The lab alone knows the truth.
With a speed other than 1, it also publishes the time of the lab as ``/clock``.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Sequence
from typing import Any, Final

from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped, PoseStamped, WrenchStamped
from rosgraph_msgs.msg import Clock

from ntagen.drive.plugin import Speeds
from ntagen.errors import DeviceError
from ntagen.lab.lab import RATE_HZ, Publisher, TrackerFaults, Truth
from ntagen.lab.needles import Placed
from ntagen.openigtlink.messages import Sensor as Readings
from ntagen.openigtlink.messages import Transform, turned
from ntagen.openigtlink.packets import Packet
from ntagen.ros import messages
from ntagen.ros.bench import Bench
from ntagen.ros.bridge import Bridge, opened_nodes, quality
from ntagen.ros.frames import NeedleFrame, quaternion_of
from ntagen.ros.stage import Place
from ntagen.ros.topics import (
    ENTRY,
    FORCE,
    STAGE_COMMAND,
    STAGE_STATE,
    TARGET,
    TIP,
    Topics,
)
from ntagen.scene import Scene

STAGE_HZ: Final = 50.0
"""How often the stage says where it is."""

_CLOCK_HZ: Final = 100.0
_SUBJECT_S: Final = 1.0
_NODES: Final = ("lab_stage", "lab_tracker")


class RosLab:
    """A lab; its threads are those of the nodes, and one of the tracker.

    Args:
        stage: The node of the stage.
        tracker: The node of tracker and force sensor.
        bench: The needle and what moves it.
        scene: The actual scene.
        topics: Names, frames and units.
        latency_s: How old a sample of the tip is when it is sent.

    Attributes:
        bench: The needle and what moves it.
        faults: What is wrong with tracker and force sensor.
        is_deaf: Whether the stage does not hear what it is told.
        is_silent: Whether the stage does not say where it is.
        frame: Another frame than that of the task for the tip; empty for none.
        factor: Positions of the tip are multiplied by this: a unit that was mistaken.
    """

    def __init__(
        self,
        stage: Bridge,
        tracker: Bridge,
        bench: Bench,
        scene: Scene,
        topics: Topics,
        latency_s: float,
    ) -> None:
        self.bench = bench
        self.is_deaf = self.is_silent = False
        self.frame = ""
        self.factor = 1.0
        self._stage = stage
        self._tracker = tracker
        self._scene = scene
        self._topics = topics
        self._needle = NeedleFrame(scene.needle.tip)
        self._began_s = time.time() - bench.now_s() / bench.speed
        self._near_rad = 0.0
        period_s = 1.0 / (RATE_HZ * bench.speed)
        self._publisher = Publisher(self, bench.look, period_s, latency_s / bench.speed)
        self.faults: TrackerFaults = self._publisher.faults
        self._sensing = quality(is_reliable=False, depth=topics.depth)
        tracker.advertise(topics.name(TIP), PoseStamped, self._sensing)
        tracker.advertise(topics.name(FORCE), WrenchStamped, self._sensing)
        stage.advertise(topics.name(STAGE_STATE), PoseStamped, self._sensing)
        stage.hear(topics.name(STAGE_COMMAND), PoseStamped, self._go, quality(depth=1))
        stage.every(1.0 / STAGE_HZ / bench.speed, self._tell_stage)
        for usual in (TARGET, ENTRY):
            stage.advertise(topics.name(usual), PointStamped, quality(depth=1, is_kept=True))
        stage.every(_SUBJECT_S, self._tell_subject)
        self._tell_subject()
        if bench.speed != 1.0:
            stage.every(1.0 / _CLOCK_HZ, self._tell_clock)

    def __enter__(self) -> RosLab:
        self._publisher.__enter__()
        return self

    def __exit__(self, *error: object) -> None:
        self._publisher.__exit__(*error)

    def idle_s(self) -> float | None:
        """How long nothing has moved, in seconds outside; `None` if nothing ever has."""
        return self.bench.idle_s()

    def truth(self) -> Truth:
        """What has really happened until now."""
        return self.bench.truth()

    def send(self, *packets: Packet) -> None:
        """Publishes messages of a tracker (`ntagen.lab.lab.Publisher`) as those of ROS."""
        for packet in packets:
            sent_s = time.time() if packet.stamp_s is None else packet.stamp_s
            head = messages.header(self._stamp(sent_s), self.frame or self._topics.stage_frame)
            match packet.content:
                case Readings(values):
                    self._tracker.publish(
                        self._topics.name(FORCE), messages.wrench(head, values[0])
                    )
                case Transform(columns):
                    x, y, z, place_mm = columns
                    unit = self._topics.sensor_mm_per_unit / self.factor
                    pose = messages.pose(place_mm, quaternion_of((x, y, z)), unit)
                    self._tracker.publish(self._topics.name(TIP), messages.stamped_pose(head, pose))
                case _:
                    raise TypeError(f"the lab publishes no {packet.content}")

    def _stamp(self, unix_s: float) -> Time:
        """A moment as messages of the lab say it: on the clock of the lab if that is not usual."""
        if self.bench.speed != 1.0:
            unix_s = self.bench.speed * (unix_s - self._began_s)
        nanoseconds = max(0, round(unix_s * 1e9))
        return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)

    def _tell_clock(self) -> None:
        self._stage.publish("/clock", Clock(clock=self._stamp(time.time())), quality(depth=1))

    def _go(self, message: Any) -> None:  # noqa: ANN401  no types
        """The stage goes where it is told; what it does not understand it does not do."""
        if self.is_deaf or message.header.frame_id != self._topics.stage_frame:
            return
        place_mm = messages.place_of(message.pose.position, self._topics.mm_per_unit)
        matrix = turned(messages.rotation_of(message.pose.orientation), place_mm)
        with contextlib.suppress(DeviceError):
            depth_mm, roll_rad = self._needle.of_guide(matrix, self._near_rad)
            self._near_rad = roll_rad
            self.bench.tell(Place(depth_mm, roll_rad))

    def _tell_stage(self) -> None:
        if self.is_silent:
            return
        here = self.bench.where()
        guide = self._needle.at_guide(here.depth_mm, here.roll_rad)
        head = messages.header(self._stamp(time.time()), self._topics.stage_frame)
        pose = messages.pose(*guide, self._topics.mm_per_unit)
        name = self._topics.name(STAGE_STATE)
        self._stage.publish(name, messages.stamped_pose(head, pose))

    def _tell_subject(self) -> None:
        unit = self._topics.mm_per_unit
        head = messages.header(self._stamp(time.time()), self._topics.stage_frame)
        target_mm = self._scene.targets[-1].center_mm
        entry_mm = self._scene.needle.tip.position_mm
        for usual, place_mm in ((TARGET, target_mm), (ENTRY, entry_mm)):
            self._stage.publish(
                self._topics.name(usual), messages.stamped_point(head, place_mm, unit)
            )


@contextlib.contextmanager
def opened_lab(
    scene: Scene,
    placed: Placed,
    speeds: Speeds,
    topics: Topics,
    *,
    speed: float = 1.0,
    arguments: Sequence[str] = (),
) -> Iterator[RosLab]:
    """A lab that is open until the end of the block.

    Args:
        scene: The actual scene.
        placed: The needle in it.
        speeds: How fast the stage is led.
        topics: Names, frames and units.
        speed: How many seconds pass in the lab in one second outside.
        arguments: What stands behind ``--ros-args``, with it; empty for none.

    Raises:
        InputError: ROS does not understand the arguments, or cannot begin.
    """

    def fail(text: str) -> None:
        nodes[0].get_logger().error(text)

    with opened_nodes(_NODES, arguments) as nodes:
        stage, tracker = (Bridge(node, fail) for node in nodes)
        bench = Bench(scene, placed, speeds, speed)
        with RosLab(stage, tracker, bench, scene, topics, placed.latency_s) as lab:
            yield lab
