"""The newest samples of the sensors, and why there are none.

It gives what `ntagen.tracking.live.LiveTracker` asks of a client, so that samples of topics are
judged as those of OpenIGTLink are. How old a sample is counts from its receipt.

Some things are wrong for good, even if good samples come in between: a pose in another frame, two
publishers of one topic. The first of them is kept as the `trouble` until `forget`.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Final

from ntagen.errors import DeviceError
from ntagen.openigtlink.messages import Sensor
from ntagen.openigtlink.samples import Kind, Pose, Sample
from ntagen.values import dataclass

DISCOVERY_S: Final = 5.0
"""Nodes find each other within this time, also on a busy machine."""

SETTLED_S: Final = 1.0
"""Nodes that were found for so long without another one are taken for all that there are; ours."""

_STEP_S: Final = 0.02
"""A wait looks at the clock so often: a simulated clock does not wake anybody."""


@dataclass(frozen=True, slots=True)
class Publisher:
    """Who publishes a topic.

    Attributes:
        node: The name of the node.
        kind: The type of its messages, as in ``geometry_msgs/msg/PoseStamped``.
        is_reliable: Whether it sends again what was lost.
    """

    node: str
    kind: str
    is_reliable: bool


@dataclass(frozen=True, slots=True)
class Wanted:
    """What is listened to.

    Attributes:
        topic: The name of the topic.
        kind: The type of its messages.
        is_reliable: Whether publishers must be reliable.
    """

    topic: str
    kind: str
    is_reliable: bool


Look = Callable[[str], "tuple[Publisher, ...]"]
"""Says who publishes a topic."""


class Inbox:
    """The newest samples of the tip and of the force.

    Args:
        tip: Where poses come from.
        force: Where forces come from.
        stale_s: A sample is waited for so long.
        now_s: The clock of all times of receipt.
        look: Who publishes a topic.
    """

    def __init__(
        self, tip: Wanted, force: Wanted, stale_s: float, now_s: Callable[[], float], look: Look
    ) -> None:
        self.now_s = now_s
        self._tip = tip
        self._force = force
        self._stale_s = stale_s
        self._look = look
        self._changed = threading.Condition()
        self._pose: Sample[Pose] | None = None
        self._reading: Sample[Sensor] | None = None
        self._repeats = 0
        self._trouble = ""

    @property
    def trouble(self) -> str:
        """What is wrong for good; empty if nothing."""
        return self._trouble

    def fail(self, trouble: str) -> None:
        """Notes that something is wrong for good; the first thing counts."""
        with self._changed:
            self._trouble = self._trouble or trouble
            self._changed.notify_all()

    def forget(self) -> None:
        """Forgets all samples and what was wrong: for a new beginning."""
        with self._changed:
            self._pose = self._reading = None
            self._repeats = 0
            self._trouble = ""

    def wait_for_first(self, *, with_force: bool) -> None:
        """Waits until something has come from each topic, or for `DISCOVERY_S`.

        Args:
            with_force: Whether a force is waited for, too.
        """
        with self._changed:
            self._changed.wait_for(
                lambda: (
                    bool(self._trouble)
                    or (self._pose is not None and not (with_force and self._reading is None))
                ),
                DISCOVERY_S,
            )

    def take_pose(self, content: Pose, stamp_s: float | None) -> None:
        """Takes a pose of the tip, in mm and in the frame of the stage or the tracker."""
        with self._changed:
            before = self._pose
            is_same = before is not None and (before.stamp_s, before.content) == (stamp_s, content)
            if is_same and stamp_s is not None:
                # A sensor that hangs, behind a node that does not.
                self._repeats += 1
                return
            self._repeats = 0
            self._pose = Sample(self._tip.topic, content, self.now_s(), stamp_s, {})
            self._changed.notify_all()

    def take_force(self, content: Sensor, stamp_s: float | None) -> None:
        """Takes a force."""
        with self._changed:
            self._reading = Sample(self._force.topic, content, self.now_s(), stamp_s, {})
            self._changed.notify_all()

    def pose(
        self,
        device: str | None = None,
        *,
        after_s: float | None = None,
        any_age: bool = False,
        waits: bool = True,
    ) -> Sample[Pose]:
        """The newest pose, as `ntagen.openigtlink.client.Client.pose`.

        Raises:
            DeviceError: There is none in time.
        """
        del device
        least_s = -math.inf if any_age else after_s
        return self._newest(self._tip, lambda: self._pose, least_s, waits)

    def sensor(
        self, device: str | None = None, *, any_age: bool = False, waits: bool = True
    ) -> Sample[Sensor]:
        """The newest force, as `pose`."""
        del device
        least_s = -math.inf if any_age else None
        return self._newest(self._force, lambda: self._reading, least_s, waits)

    def close(self) -> None:
        """Does nothing: the node closes what it opened."""

    def _newest(
        self,
        wanted: Wanted,
        newest: Callable[[], Sample[Kind] | None],
        after_s: float | None,
        waits: bool,
    ) -> Sample[Kind]:
        end_s = self.now_s() + (self._stale_s if waits else 0.0)
        # A simulated clock may stand still; nobody waits for it for ever.
        last_s = time.monotonic() + 4.0 * self._stale_s + 1.0
        with self._changed:
            while True:
                if self._trouble:
                    raise DeviceError(self._trouble)
                now_s = self.now_s()
                least_s = now_s - self._stale_s if after_s is None else after_s
                sample = newest()
                if sample is not None and sample.received_s > least_s:
                    return sample
                if now_s >= end_s or time.monotonic() > last_s:
                    break
                self._changed.wait(min(_STEP_S, end_s - now_s))
        # Who publishes is asked without the lock: samples may come meanwhile.
        raise DeviceError(self._why(wanted, newest()))

    def _why(self, wanted: Wanted, sample: Sample[Kind] | None) -> str:
        """Why there is no sample."""
        if sample is not None:
            told = ""
            if self._repeats and wanted is self._tip:
                told = (
                    f"; since then the same sample, with the same stamp, came {self._repeats} "
                    "times: the sensor hangs"
                )
            return (
                f"{wanted.topic} is stale: the last message came "
                f"{self.now_s() - sample.received_s:.2f} s ago, and {self._stale_s:g} s is "
                f"allowed{told}\nhint: does the sensor see the needle, and does its node run?"
            )
        return why_silent(wanted, self._look(wanted.topic), self._stale_s)


def why_silent(wanted: Wanted, publishers: tuple[Publisher, ...], waited_s: float) -> str:
    """Why nothing ever came from a topic, in words.

    Args:
        wanted: What is listened to.
        publishers: Who publishes it.
        waited_s: How long it was waited for.
    """
    if not publishers:
        return (
            f"nobody publishes {wanted.topic}\n"
            f"hint: start the node that does, or remap it: --ros-args -r {wanted.topic}:=/its/name"
            "; `ros2 topic list` shows the names"
        )
    for one in publishers:
        if one.kind != wanted.kind:
            return (
                f"'{one.node}' publishes {wanted.topic} as {one.kind}, and {wanted.kind} is "
                f"expected\nhint: remap one of them, or let the node publish {wanted.kind}"
            )
    for one in publishers:
        if wanted.is_reliable and not one.is_reliable:
            return (
                f"'{one.node}' publishes {wanted.topic} as best effort, and this node asks for "
                "reliable messages, so nothing is received\n"
                "hint: add --ros-args -p reliability:=best_effort"
            )
    names = " and ".join(f"'{one.node}'" for one in publishers)
    return (
        f"{names} publishes {wanted.topic}, but nothing has come for {waited_s:g} s\n"
        "hint: does the sensor see the needle? Are ROS_DOMAIN_ID and the network the same for both?"
    )


def wait_until_settled(who: Callable[[], object], until_s: float) -> None:
    """Waits until the same nodes are found for `SETTLED_S`.

    The first sample may come before the second publisher is found, and then the needle would move.

    Args:
        who: Asks which nodes are found now.
        until_s: It waits no longer than until this time, by `time.monotonic`.
    """
    found, since_s = who(), time.monotonic()
    while (now_s := time.monotonic()) < min(until_s, since_s + SETTLED_S):
        time.sleep(_STEP_S)
        if (newer := who()) != found:
            found, since_s = newer, now_s


def two_publishers(topic: str, publishers: tuple[Publisher, ...]) -> str:
    """The message about a topic with more than one publisher; empty if there is only one."""
    if len(publishers) < 2:
        return ""
    names = " and ".join(f"'{one.node}'" for one in publishers)
    return (
        f"{topic} has {len(publishers)} publishers: {names}; nobody knows which of them is right\n"
        f"hint: end all but one, or remap one of them: --ros-args -r {topic}:=/another/name"
    )
