"""The wire to a stage that is commanded over topics; see `ntagen.ros.stage`."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any, Final

from geometry_msgs.msg import PointStamped, PoseStamped

from ntagen.errors import DeviceError
from ntagen.openigtlink.messages import turned
from ntagen.ros.bridge import Bridge, quality
from ntagen.ros.clock import Clock
from ntagen.ros.frames import NeedleFrame
from ntagen.ros.inbox import DISCOVERY_S, Wanted, two_publishers, why_silent
from ntagen.ros.messages import header, place_of, pose, rotation_of, stamped_point, stamped_pose
from ntagen.ros.stage import Place
from ntagen.ros.topics import COMMAND, STAGE_COMMAND, STAGE_STATE, Topics

_KIND: Final = "geometry_msgs/msg/PoseStamped"
_STEP_S: Final = 0.02
_NO_ROTATION: Final = 1e-3


class TopicLink:
    """A stage behind topics; a `ntagen.ros.stage.Link`.

    Args:
        bridge: The node.
        topics: Names, frames and units.
        needle: The frame of the needle.
        clock: The clock of motions and receipts.
    """

    def __init__(self, bridge: Bridge, topics: Topics, needle: NeedleFrame, clock: Clock) -> None:
        self._bridge = bridge
        self._topics = topics
        self._needle = needle
        self._lock = threading.Lock()
        self._newest: tuple[Place, float] | None = None
        self._trouble = ""
        self.now_s: Callable[[], float] = clock.now_s
        qos = quality(depth=1)
        bridge.advertise(topics.name(STAGE_COMMAND), PoseStamped, qos)
        bridge.advertise(topics.name(COMMAND), PointStamped, qos)
        hearing = quality(is_reliable=topics.reliability == "reliable", depth=topics.depth)
        bridge.hear(topics.name(STAGE_STATE), PoseStamped, self._take, hearing)

    def begin(self) -> None:
        """Refuses a stage that nobody could rely on.

        Raises:
            DeviceError: Nobody hears the commands, or others command it, too.
        """
        with self._lock:
            # The clock may have begun anew: what was heard before says nothing about now.
            self._trouble, self._newest = "", None
        self._wait_for_first()
        state, command = (self._topics.name(one) for one in (STAGE_STATE, STAGE_COMMAND))
        trouble = two_publishers(self._bridge.resolved(state), self._bridge.publishers(state))
        if trouble:
            raise DeviceError(trouble)
        others = self._bridge.publishers(command)
        if len(others) > 1:
            names = " and ".join(f"'{one.node}'" for one in others)
            raise DeviceError(
                f"the stage has two masters: {names} publish {self._bridge.resolved(command)}\n"
                "hint: end all but this node"
            )
        hearers = (command, self._topics.name(COMMAND))
        if not any(self._bridge.hearers(one) for one in hearers):
            raise DeviceError(
                f"nobody hears {self._bridge.resolved(command)}, so no stage would move\n"
                "hint: start the node of the stage, or remap the topic"
            )

    def tell(self, place: Place) -> None:
        """See `ntagen.ros.stage.Link.tell`."""
        topics, unit = self._topics, self._topics.mm_per_unit
        position_mm, rotation = self._needle.at_guide(place.depth_mm, place.roll_rad)
        head = header(self._bridge.stamp(), topics.stage_frame)
        asked = stamped_pose(head, pose(position_mm, rotation, unit))
        self._bridge.publish(topics.name(STAGE_COMMAND), asked)
        self._bridge.publish(topics.name(COMMAND), stamped_point(head, position_mm, unit))

    def where(self) -> Place:
        """See `ntagen.ros.stage.Link.where`."""
        with self._lock:
            newest, trouble = self._newest, self._trouble
        if trouble:
            raise DeviceError(trouble)
        state = self._bridge.resolved(self._topics.name(STAGE_STATE))
        if newest is None:
            raise DeviceError(self._silence())
        age_s = self.now_s() - newest[1]
        if age_s > self._topics.stale_s:
            raise DeviceError(
                f"the stage is silent: the last {state} came {age_s:.2f} s ago, and "
                f"{self._topics.stale_s:g} s is allowed\nhint: does its node run?"
            )
        return newest[0]

    def _wait_for_first(self) -> None:
        """Waits for the stage's first word: nodes need some time to find each other."""
        end_s = time.monotonic() + DISCOVERY_S
        while self._newest is None and not self._trouble and time.monotonic() < end_s:
            time.sleep(_STEP_S)
        self.where()

    def _silence(self) -> str:
        topics = self._topics
        state = self._bridge.resolved(topics.name(STAGE_STATE))
        wanted = Wanted(state, _KIND, topics.reliability == "reliable")
        return why_silent(wanted, self._bridge.publishers(state), topics.stale_s)

    def _take(self, message: Any) -> None:  # noqa: ANN401  no types
        try:
            place = self._place(message)
        except DeviceError as error:
            with self._lock:
                self._trouble = self._trouble or str(error)
            return
        with self._lock:
            self._newest = (place, self.now_s())

    def _place(self, message: Any) -> Place:  # noqa: ANN401  no types
        topics, frame = self._topics, message.header.frame_id
        position_mm = place_of(message.pose.position, topics.mm_per_unit)
        rotation = rotation_of(message.pose.orientation)
        if abs(sum(part * part for part in rotation) - 1.0) > _NO_ROTATION:
            raise DeviceError(
                f"the stage reports the orientation {rotation}, which is no rotation\n"
                "hint: a quaternion has the length 1"
            )
        if frame == topics.needle_frame:
            matrix = self._needle.measured(position_mm, rotation).columns
        elif frame == topics.stage_frame:
            matrix = turned(rotation, position_mm)
        else:
            raise DeviceError(
                f"the stage reports its pose in the frame '{frame}', and '{topics.stage_frame}' "
                f"or '{topics.needle_frame}' is expected\n"
                "hint: name the frame with --ros-args -p stage_frame:=NAME"
            )
        newest = self._newest
        near_rad = 0.0 if newest is None else newest[0].roll_rad
        return Place(*self._needle.of_guide(matrix, near_rad))
