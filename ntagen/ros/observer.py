"""Publishes a run: where the needle is and will be, markers for RViz, the state and its reason."""

from __future__ import annotations

import threading
from typing import Any, Final

from geometry_msgs.msg import PointStamped, PoseArray, PoseStamped
from std_msgs.msg import String

from ntagen.drive.records import (
    Command,
    Estimated,
    Foreseen,
    Measured,
    Predicted,
    Record,
    Transition,
)
from ntagen.drive.states import ENDS, State
from ntagen.drive.viewers import Viewers
from ntagen.drive.viewing import ROUTINE, Shown
from ntagen.plan.synthesise import Synthesis
from ntagen.ros import messages
from ntagen.ros.bridge import Bridge, quality
from ntagen.ros.frames import NeedleFrame
from ntagen.ros.shown import Board, Marker, markers_of, plan_poses, tube_of
from ntagen.ros.topics import (
    COMMAND,
    DIAGNOSTICS,
    MARKERS,
    POSE,
    PREDICTED,
    STATUS,
    TIP_POSE,
    Topics,
)
from ntagen.scene import Pose, Scene

AGAIN_S: Final = 1.0
"""State, markers and diagnostics are told again after this time: RViz may come later."""

_WELL, _WARNING, _ERROR = 0, 1, 2
_FAILED: Final = frozenset({State.FAULTED.value, "refused"})
_ENDS: Final = frozenset(one.value for one in ENDS)
"""An end is told by the session, with its reason, when all is done."""

_ODD: Final = frozenset(
    one.value for one in ENDS if one not in (State.TARGET_REACHED, State.FAULTED)
)


class Observer:
    """A journal that publishes; a `ntagen.drive.records.Journal`.

    Args:
        bridge: The node.
        topics: Names, frames and units.
        needle: The frame of the needle.
        accept: The confidence that the driver asks for.
        commands: Whether it publishes the depth of each command: a stage behind topics does that
            itself.
    """

    def __init__(
        self,
        bridge: Bridge,
        topics: Topics,
        needle: NeedleFrame,
        accept: float,
        *,
        commands: bool,
    ) -> None:
        self._bridge = bridge
        self._topics = topics
        self._needle = needle
        self._accept = accept
        self._commands = commands
        self._lock = threading.Lock()
        self._board = Board()
        self._viewers = Viewers(None)
        self._depth_mm = self._roll_rad = self._force_n = 0.0
        self._state, self._reason = "idle", "call the service arm"
        kinds = {POSE: PoseStamped, TIP_POSE: PoseStamped, PREDICTED: PoseArray}
        for usual, kind in kinds.items():
            bridge.advertise(topics.name(usual), kind)
        if commands:
            bridge.advertise(topics.name(COMMAND), PointStamped)
        bridge.advertise(topics.name(STATUS), String, quality(depth=1, is_kept=True))
        bridge.every(AGAIN_S, self._tell_again)

    @property
    def said(self) -> tuple[str, str]:
        """The state and its reason, as they were told last."""
        return self._state, self._reason

    def tell(self, state: str, reason: str) -> None:
        """Says in which state the driver is, and why."""
        self._state, self._reason = state, " ".join(reason.split())
        self._tell_state()

    def started(self, scene: Scene) -> None:
        """Shows the scene."""
        self._depth_mm = self._roll_rad = 0.0
        self._show(self._viewers.started(scene))

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Shows the plan."""
        self._show(self._viewers.synthesised(synthesis, 0.0))
        poses = plan_poses(synthesis, self._needle)
        head = messages.header(self._bridge.stamp(), self._topics.needle_frame)
        self._publish(PREDICTED, messages.pose_array(head, poses, self._topics.mm_per_unit))

    def record(self, record: Record) -> None:
        """Publishes what a record tells."""
        self._show(self._viewers.recorded(record))
        match record:
            case Transition() if record.event not in ROUTINE and record.following not in _ENDS:
                self.tell(record.following, record.event)
            case Command():
                self._command(record)
            case Measured():
                self._depth_mm, self._force_n = record.depth_mm, record.force_n
                self._publish_pose()
            case Predicted() | Estimated():
                self._publish_tip(Pose(record.position_mm, record.heading, record.bevel))
            case Foreseen():
                self._put([tube_of(record, self._accept)])

    def _command(self, record: Command) -> None:
        if record.kind == "roll":
            self._roll_rad += record.value
        if record.kind not in ("push", "pull"):
            return
        goal_mm = self._depth_mm + (record.value if record.kind == "push" else -record.value)
        if record.kind == "pull":
            # On the way back nothing is measured.
            self._depth_mm = goal_mm
            self._publish_pose()
        if not self._commands:
            return
        position_mm, _ = self._needle.at_guide(goal_mm, self._roll_rad)
        head = messages.header(self._bridge.stamp(), self._topics.stage_frame)
        self._publish(COMMAND, messages.stamped_point(head, position_mm, self._topics.mm_per_unit))

    def _publish_pose(self) -> None:
        """How far the needle is inserted and rolled: z, and the rotation about z."""
        straight = NeedleFrame(_ORIGIN).at_guide(self._depth_mm, self._roll_rad)
        head = messages.header(self._bridge.stamp(), self._topics.needle_frame)
        pose = messages.pose(*straight, self._topics.mm_per_unit)
        self._publish(POSE, messages.stamped_pose(head, pose))

    def _publish_tip(self, tip: Pose) -> None:
        head = messages.header(self._bridge.stamp(), self._topics.stage_frame)
        pose = messages.needle_pose(tip, self._topics.mm_per_unit)
        self._publish(TIP_POSE, messages.stamped_pose(head, pose))

    def _show(self, shown: Shown) -> None:
        self._put(
            [one for topic, update in shown if topic == "/scene" for one in markers_of(update)]
        )

    def _put(self, markers: list[Marker]) -> None:
        if markers:
            with self._lock:
                changed = self._board.put(markers)
            self._publish_markers(changed)

    def _publish_markers(self, markers: tuple[Marker, ...]) -> None:
        head = messages.header(self._bridge.stamp(), self._topics.stage_frame)
        self._publish(MARKERS, messages.marker_array(head, markers, self._topics.mm_per_unit))

    def _publish(self, usual: str, message: Any) -> None:  # noqa: ANN401  no types
        self._bridge.publish(self._topics.name(usual), message)

    def _tell_state(self) -> None:
        self._publish(STATUS, String(data=f"{self._state}: {self._reason}"))
        level = _WELL
        if self._state in _FAILED:
            level = _ERROR
        elif self._state in _ODD:
            level = _WARNING
        values = [
            ("state", self._state),
            ("depth_mm", f"{self._depth_mm:.3f}"),
            ("force_n", f"{self._force_n:.3f}"),
        ]
        text = f"{self._state}: {self._reason}"
        stamp = self._bridge.stamp()
        self._publish(DIAGNOSTICS, messages.diagnostics(stamp, level, text, values))

    def _tell_again(self) -> None:
        self._tell_state()
        with self._lock:
            standing = self._board.standing()
        if standing:
            self._publish_markers(standing)


_ORIGIN: Final = Pose((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
"""The needle at its entry, in its own frame."""
