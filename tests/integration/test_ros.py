"""`ntagen ros` and a lab of nodes, as two processes that find each other over DDS on this machine.

What it publishes is recorded in a bag by its bytes, and read again by rosbags, which is not ours.
"""

# ruff: noqa: E402  messages of ROS have no types, and ROS may be missing

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="ROS 2 is not installed: pip install 'ntagen[ros]'")
rosbag2 = pytest.importorskip("rosbags.rosbag2", reason="rosbags is not installed")
typesys = pytest.importorskip("rosbags.typesys")

from geometry_msgs.msg import PoseArray, PoseStamped
from std_msgs.msg import String, UInt8MultiArray
from visualization_msgs.msg import MarkerArray

from ntagen.bags import LOG
from ntagen.drive.reading import read_log
from ntagen.drive.replay import replay
from ntagen.drive.simulate import synthesiser_for
from ntagen.ros.bridge import quality
from ntagen.ros.topics import MARKERS, POSE, PREDICTED, STATUS, TIP
from tests.faults.ros import FAULTS, ROOT, Bench, Fault, run
from tests.tutorials import steps_of

STORE = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
RECORDED = {
    POSE: PoseStamped,
    PREDICTED: PoseArray,
    MARKERS: MarkerArray,
    STATUS: String,
    TIP: PoseStamped,
    LOG: UInt8MultiArray,
}


class Recorder:
    """Records topics by their bytes, as `ros2 bag record` does."""

    def __init__(self, bench: Bench) -> None:
        self._heard: list[tuple[str, int, bytes]] = []
        for topic, kind in RECORDED.items():
            qos = quality(is_kept=topic in (STATUS, LOG), depth=1000, is_reliable=topic != TIP)

            def take(data: bytes, topic: str = topic) -> None:
                now_ns = bench.peer.node.get_clock().now().nanoseconds
                self._heard.append((topic, now_ns, data))

            bench.peer.node.create_subscription(kind, topic, take, qos, raw=True)

    def write(self, path: Path) -> None:
        """Writes all that was heard to a bag."""
        plugin = rosbag2.StoragePlugin.MCAP
        with rosbag2.Writer(path, version=9, storage_plugin=plugin) as writer:
            connections = {
                topic: writer.add_connection(
                    topic, f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}", typestore=STORE
                )
                for topic, kind in RECORDED.items()
            }
            for topic, now_ns, data in list(self._heard):
                writer.write(connections[topic], now_ns, data)


def messages(path: Path) -> dict[str, list[Any]]:
    """All messages of a bag, by their topics."""
    reader = importlib.import_module("rosbags.highlevel").AnyReader([path], default_typestore=STORE)
    found: dict[str, list[Any]] = {}
    with reader:
        for connection, _, data in reader.messages():
            found.setdefault(connection.topic, []).append(
                reader.deserialize(data, connection.msgtype)
            )
    return found


@pytest.mark.slow
def test_two_processes_reach_the_target(tmp_path: Path) -> None:
    path, log = tmp_path / "bag", tmp_path / "run.mcap"
    with Bench("virtual", 1, tmp_path) as bench:
        recorder = Recorder(bench)
        bench.start(at_once=False, options=("--log", str(log)))
        assert bench.wait_until(lambda: bench.has_said("idle"))
        assert bench.call("start") == (False, "the needle is not armed: call arm first")
        is_armed, said = bench.call("arm")
        assert is_armed, said
        assert "call the service start" in said
        assert bench.call("start") == (True, "steering")
        assert bench.wait_until(lambda: bench.has_said("target reached"), 120.0)
        assert bench.lab.truth().target_distance_mm < 0.0
        assert bench.lab.truth().clearance_mm > 0.0
        assert bench.call("pull_back") == (True, "pulling back")
        assert bench.wait_until(lambda: bench.has_said("pulled back"), 60.0)
        assert bench.depth_mm() == pytest.approx(0.0, abs=0.1)
        bench.process.terminate()
        code, summed_up, errors = bench.finish()
        assert (code, summed_up.get("outcome")) == (0, "target reached"), errors
        recorder.write(path)
    check_bag(messages(path))
    in_bag = read_log(path)
    assert in_bag.records == read_log(log).records
    assert replay(in_bag, synthesiser_for(in_bag.settings)).is_same


def check_bag(found: dict[str, list[Any]]) -> None:
    """Checks what was published; lengths are in metres."""
    depths = [message.pose.position.z for message in found[POSE]]
    assert found[POSE][0].header.frame_id == "needle"
    assert 0.03 < max(depths) < 0.08
    plan = found[PREDICTED][0]
    assert plan.header.frame_id == "needle"
    assert len(plan.poses) > 20
    assert 0.03 < plan.poses[-1].position.z < 0.08
    for one in plan.poses:
        turn = one.orientation
        assert turn.x**2 + turn.y**2 + turn.z**2 + turn.w**2 == pytest.approx(1.0)
    markers = {one.ns: one for message in found[MARKERS] for one in message.markers}
    assert {"target T1", "critical C1", "plan", "shaft", "tube"} <= markers.keys()
    sphere, line, tube = markers["target T1"], markers["shaft"], markers["tube"]
    assert (sphere.type, sphere.scale.x) == (2, pytest.approx(0.02))
    assert sphere.pose.position.y == pytest.approx(-0.05)
    assert (line.type, line.header.frame_id) == (4, "stage")
    assert (tube.type, len(tube.points) % 3, tube.scale.x) == (11, 0, 1.0)
    assert all(0.0 < one.color.a <= 1.0 for one in markers.values())
    said = [message.data for message in found[STATUS]]
    assert any(one.startswith("armed: the tip is seen at") for one in said)
    assert "target reached: the tip is in the last target" in said


@pytest.mark.slow
def test_the_script_of_the_tutorial_steers_and_pulls_back(tmp_path: Path) -> None:
    tutorial = (ROOT / "docs" / "tutorials" / "ros.md").read_text("utf-8")
    for step in steps_of(tutorial.replace("save this as", "Save this as")):
        if step.kind == "file":
            (tmp_path / step.name).write_text(step.text)
    with Bench("phantom", 2, tmp_path, task=tmp_path / "fast.nsl") as bench:
        bench.start(at_once=False)
        script = [sys.executable, str(tmp_path / "steer.py")]
        done = subprocess.run(script, capture_output=True, text=True, timeout=150.0)
        assert bench.depth_mm() == pytest.approx(0.0, abs=0.1)
    said = done.stdout.splitlines()
    assert said[-1] == "pulled back: the needle is at the entry", done.stderr
    assert "target reached: the tip is in the last target" in said


AT_START = [fault for fault in FAULTS if fault.is_at_start]


@pytest.mark.slow
@pytest.mark.parametrize("fault", AT_START, ids=lambda fault: fault.name)
def test_what_is_wrong_at_the_start_moves_nothing(fault: Fault, tmp_path: Path) -> None:
    assert run(fault, "virtual", 1, tmp_path).wrong == []


QUICK = ("tip silent", "tip in another frame", "two publishers", "stop called", "clock goes back")


@pytest.mark.slow
@pytest.mark.parametrize(
    "fault", [one for one in FAULTS if one.name in QUICK], ids=lambda fault: fault.name
)
def test_a_fault_on_the_way_stops_the_needle(fault: Fault, tmp_path: Path) -> None:
    assert run(fault, "virtual", 1, tmp_path).wrong == []
