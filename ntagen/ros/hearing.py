"""What a node hears of the needle and of the subject: tip, force, target and entry."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Any, Final

from geometry_msgs.msg import PointStamped, PoseArray, PoseStamped, WrenchStamped

from ntagen.errors import DeviceError
from ntagen.needle.vectors import distance
from ntagen.openigtlink.messages import NEWTON
from ntagen.openigtlink.messages import Sensor as Readings
from ntagen.ros.bridge import Bridge, quality
from ntagen.ros.clock import Clock
from ntagen.ros.frames import NeedleFrame, content_of, shape_of
from ntagen.ros.inbox import (
    DISCOVERY_S,
    Inbox,
    Wanted,
    two_publishers,
    wait_until_settled,
)
from ntagen.ros.messages import place_of, rotation_of, stamp_of
from ntagen.ros.topics import ENTRY, FORCE, TARGET, Topics
from ntagen.scene import Vector

_KINDS: Final = {"tip": PoseStamped, "shape": PoseArray}
_GRAPH_S: Final = 0.1
"""How often it is asked who publishes what is heard."""

_MOVED_MM: Final = 0.5
"""A target that is told again may differ by this from the one that is steered to; ours."""


class Hearing:
    """What is heard from now on.

    Args:
        bridge: The node.
        topics: Names, frames and units.
        needle: The frame of the needle.
        clock: The clock of receipts.
        tip_frames: The frames in which the tip may come besides that of the needle; empty for any.
        hears_force: Whether the force is listened to.

    Attributes:
        inbox: The samples of tip and force.
    """

    def __init__(
        self,
        bridge: Bridge,
        topics: Topics,
        needle: NeedleFrame,
        clock: Clock,
        tip_frames: tuple[str, ...],
        *,
        hears_force: bool,
    ) -> None:
        self._bridge = bridge
        self._topics = topics
        self._needle = needle
        self._tip_frames = tip_frames
        self._found_s = time.monotonic() + DISCOVERY_S
        self._lock = threading.Lock()
        self._told: dict[str, Vector] = {}
        self._used: dict[str, Vector] = {}
        is_reliable = topics.reliability == "reliable"
        qos = quality(is_reliable=is_reliable, depth=topics.depth)
        kind = _KINDS[topics.tip_from]
        force = topics.name(FORCE)
        self._heard = [topics.tip, *([force] if hears_force else [])]
        self.inbox = Inbox(
            Wanted(bridge.resolved(topics.tip), _named(kind), is_reliable),
            Wanted(bridge.resolved(force), _named(WrenchStamped), is_reliable),
            topics.stale_s,
            clock.now_s,
            bridge.publishers,
        )
        take_tip = self._take_pose if kind is PoseStamped else self._take_shape
        bridge.hear(topics.tip, kind, take_tip, qos)
        if hears_force:
            bridge.hear(force, WrenchStamped, self._take_force, qos)
        for usual in (TARGET, ENTRY):
            for one in (quality(is_kept=True, depth=1), quality(is_reliable=False, depth=1)):
                # A publisher that keeps its message for those who come later may have sent it
                # once; others are heard by the second one.
                bridge.hear(topics.name(usual), PointStamped, self._taker(usual), one)
        bridge.every(_GRAPH_S, self._look)

    def told_mm(self, usual: str) -> Vector | None:
        """The target or the entry that was told last, in the frame of the stage."""
        with self._lock:
            return self._told.get(usual)

    def use(self, usual: str, place_mm: Vector) -> None:
        """Notes what a run steers to: if it is told otherwise, the run must end."""
        with self._lock:
            self._used[usual] = place_mm

    def require_one_each(self) -> None:
        """Refuses a sensor that two nodes publish, once this node has found the others.

        Raises:
            DeviceError: One has two publishers.
        """
        wait_until_settled(
            lambda: [self._bridge.publishers(topic) for topic in self._heard], self._found_s
        )
        self._look()
        if self.inbox.trouble:
            raise DeviceError(self.inbox.trouble)

    def _look(self) -> None:
        """Looks whether a sensor has two publishers."""
        for topic in self._heard:
            trouble = two_publishers(self._bridge.resolved(topic), self._bridge.publishers(topic))
            if trouble:
                self.inbox.fail(trouble)

    def _take_pose(self, message: Any) -> None:  # noqa: ANN401  no types
        self._take(message.header, message.pose)

    def _take_shape(self, message: Any) -> None:  # noqa: ANN401  no types
        # Without poses, the needle is not seen.
        if message.poses and self._knows(message.header):
            per_unit = self._topics.sensor_mm_per_unit
            places_mm = [place_of(pose.position, per_unit) for pose in message.poses]
            shape = shape_of(places_mm, self._needle_of(message.header))
            self.inbox.take_pose(shape, stamp_of(message.header))

    def _take(self, head: Any, pose: Any) -> None:  # noqa: ANN401  no types
        if self._knows(head):
            place_mm = place_of(pose.position, self._topics.sensor_mm_per_unit)
            rotation = rotation_of(pose.orientation)
            content = content_of(place_mm, rotation, self._needle_of(head))
            self.inbox.take_pose(content, stamp_of(head))

    def _knows(self, head: Any) -> bool:  # noqa: ANN401  no types
        """Whether the tip may come in a frame; else the needle must stop."""
        frame, frames = head.frame_id, self._tip_frames
        if not frames or frame in (*frames, self._topics.needle_frame):
            return True
        self.inbox.fail(self._wrong_frame(self._topics.tip, frame, frames))
        return False

    def _needle_of(self, head: Any) -> NeedleFrame | None:  # noqa: ANN401  no types
        """The frame of the needle, if a message is in it."""
        return self._needle if head.frame_id == self._topics.needle_frame else None

    def _take_force(self, message: Any) -> None:  # noqa: ANN401  no types
        force_n = getattr(message.wrench.force, self._topics.force_axis)
        self.inbox.take_force(Readings((force_n,), NEWTON), stamp_of(message.header))

    def _taker(self, usual: str) -> Callable[[Any], None]:
        def take(message: Any) -> None:  # noqa: ANN401  no types
            topics, frame = self._topics, message.header.frame_id
            place_mm = place_of(message.point, topics.mm_per_unit)
            if frame == topics.needle_frame:
                place_mm = self._needle.to_stage(place_mm)
            elif frame != topics.stage_frame:
                name = topics.name(usual)
                self.inbox.fail(self._wrong_frame(name, frame, (topics.stage_frame,)))
                return
            self._note(usual, place_mm)

        return take

    def _note(self, usual: str, place_mm: Vector) -> None:
        with self._lock:
            self._told[usual] = place_mm
            used = self._used.get(usual)
        name = self._bridge.resolved(self._topics.name(usual))
        if not all(map(math.isfinite, place_mm)):
            self.inbox.fail(f"{name} is {place_mm}, which is not a number")
        elif used is not None and distance(used, place_mm) > _MOVED_MM:
            self.inbox.fail(
                f"{name} was moved by {distance(used, place_mm):.1f} mm while the needle is "
                "steered to where it was\nhint: stop, pull back and arm again"
            )

    def _wrong_frame(self, topic: str, frame: str, wanted: tuple[str, ...]) -> str:
        names = " or ".join(f"'{one}'" for one in (*wanted, self._topics.needle_frame))
        came = f"in the frame '{frame}'" if frame else "without a frame (frame_id is empty)"
        return (
            f"{self._bridge.resolved(topic)} came {came}, and {names} is expected\n"
            "hint: set frame_id in the node that publishes it, name the frame with "
            "--ros-args -p stage_frame:=NAME, or give --registration"
        )


def _named(kind: Any) -> str:  # noqa: ANN401  no types
    """The name of a type of messages, as the graph has it."""
    return f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
