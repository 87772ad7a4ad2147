"""The newest samples of topics, and why there are none."""

from __future__ import annotations

import pytest

from ntagen.errors import DeviceError
from ntagen.openigtlink.messages import NEWTON, Position, Sensor
from ntagen.ros.inbox import (
    SETTLED_S,
    Inbox,
    Publisher,
    Wanted,
    two_publishers,
    wait_until_settled,
    why_silent,
)

KIND = "geometry_msgs/msg/PoseStamped"
TIP = Wanted("/sensor/tip", KIND, False)
FORCE = Wanted("/sensor/force", "geometry_msgs/msg/WrenchStamped", False)
GOOD = Publisher("/tracker", KIND, True)


class Bench:
    """An inbox with a clock that the test sets."""

    def __init__(self, publishers: tuple[Publisher, ...] = (GOOD,)) -> None:
        self.now_s = 100.0
        self.inbox = Inbox(TIP, FORCE, 0.05, self.tick, lambda _: publishers)

    def tick(self) -> float:
        """Each look at the clock takes some time, so that nobody waits for ever."""
        self.now_s += 0.001
        return self.now_s


def test_the_newest_pose_counts_from_its_receipt() -> None:
    bench = Bench()
    bench.inbox.take_pose(Position((1.0, 2.0, 3.0)), 5.0)
    bench.inbox.take_pose(Position((2.0, 2.0, 3.0)), 6.0)
    assert bench.inbox.pose(waits=False).content == Position((2.0, 2.0, 3.0))
    bench.now_s += 1.0
    with pytest.raises(DeviceError, match=r"/sensor/tip is stale: the last message came 1\.\d+ s"):
        bench.inbox.pose()


def test_the_same_sample_with_the_same_stamp_is_not_new() -> None:
    bench = Bench()
    bench.inbox.take_pose(Position((1.0, 2.0, 3.0)), 5.0)
    bench.now_s += 1.0
    bench.inbox.take_pose(Position((1.0, 2.0, 3.0)), 5.0)
    with pytest.raises(DeviceError, match="came 1 times: the sensor hangs"):
        bench.inbox.pose()
    # Without a stamp nobody knows: the needle may rest.
    bench.inbox.take_pose(Position((1.0, 2.0, 3.0)), None)
    bench.inbox.take_pose(Position((1.0, 2.0, 3.0)), None)
    assert bench.inbox.pose().stamp_s is None


def test_what_is_wrong_for_good_stays_until_it_is_forgotten() -> None:
    bench = Bench()
    bench.inbox.fail("the frame is wrong")
    bench.inbox.fail("and something else")
    bench.inbox.take_pose(Position((1.0, 2.0, 3.0)), 5.0)
    for ask in (bench.inbox.pose, bench.inbox.sensor):
        with pytest.raises(DeviceError, match="the frame is wrong"):
            ask()
    bench.inbox.forget()
    bench.inbox.take_force(Sensor((0.5,), NEWTON), None)
    assert bench.inbox.sensor().content.values == (0.5,)


@pytest.mark.parametrize(
    ("publishers", "is_reliable", "says"),
    [
        ((), False, "nobody publishes /sensor/tip"),
        ((Publisher("/a", "geometry_msgs/msg/Pose", True),), False, "as geometry_msgs/msg/Pose"),
        ((Publisher("/a", KIND, False),), True, "as best effort, and this node asks for reliable"),
        ((GOOD,), False, "'/tracker' publishes /sensor/tip, but nothing has come for 0.5 s"),
    ],
)
def test_silence_is_explained_by_who_publishes(
    publishers: tuple[Publisher, ...], is_reliable: bool, says: str
) -> None:
    said = why_silent(Wanted(TIP.topic, KIND, is_reliable), publishers, 0.5)
    assert says in said
    assert "hint: " in said
    bench = Bench(publishers)
    if not is_reliable:
        with pytest.raises(DeviceError, match="/sensor/tip"):
            bench.inbox.pose()


def test_two_publishers_are_named() -> None:
    assert two_publishers("/sensor/tip", (GOOD,)) == ""
    said = two_publishers("/sensor/tip", (GOOD, Publisher("/bag", KIND, True)))
    assert "/sensor/tip has 2 publishers: '/tracker' and '/bag'" in said


def test_nodes_that_are_found_late_are_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 0.0

    def sleep(seconds: float) -> None:
        nonlocal now_s
        now_s += seconds

    monkeypatch.setattr("ntagen.ros.inbox.time.monotonic", lambda: now_s)
    monkeypatch.setattr("ntagen.ros.inbox.time.sleep", sleep)
    wait_until_settled(lambda: 2 if now_s > 0.7 else 1, until_s=5.0)
    assert now_s == pytest.approx(0.7 + SETTLED_S, abs=0.05)
    # Nodes that come and go without end are waited for no longer than that.
    wait_until_settled(lambda: now_s, until_s=5.0)
    assert now_s == pytest.approx(5.0, abs=0.05)
    # A node that has had the time to find the others does not wait.
    wait_until_settled(lambda: 1, until_s=5.0)
    assert now_s == pytest.approx(5.0, abs=0.05)
