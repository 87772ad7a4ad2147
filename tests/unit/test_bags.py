"""Bags of ROS 2, written and read by rosbags: traces of a tip, and the log of a run."""

# ruff: noqa: ANN401  messages of ROS have no types

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ntagen.bags import LOG, is_bag, log_in, positions_in
from ntagen.drive.log import Log, metadata_of
from ntagen.drive.reading import read_log
from ntagen.drive.records import Transition
from ntagen.drive.settings import Settings
from ntagen.errors import InputError
from ntagen.nsl import load
from ntagen.traces.reading import Columns, read_samples

rosbags = pytest.importorskip("rosbags.rosbag2", reason="rosbags is not installed")
typesys = pytest.importorskip("rosbags.typesys")

STORE = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
ROOT = Path(__file__).parents[2]
KINDS = {"mcap": rosbags.StoragePlugin.MCAP, "sqlite": rosbags.StoragePlugin.SQLITE3}


def of(kind: str, *values: Any) -> Any:
    return STORE.types[kind](*values)


def pose(seconds: int, x: float, y: float, z: float) -> Any:
    head = of("std_msgs/msg/Header", of("builtin_interfaces/msg/Time", seconds, 0), "stage")
    turn = of("geometry_msgs/msg/Quaternion", 0.0, 0.0, 0.0, 1.0)
    inner = of("geometry_msgs/msg/Pose", of("geometry_msgs/msg/Point", x, y, z), turn)
    return of("geometry_msgs/msg/PoseStamped", head, inner)


def shape(*poses: Any) -> Any:
    head = of("std_msgs/msg/Header", of("builtin_interfaces/msg/Time", 1, 0), "needle")
    return of("geometry_msgs/msg/PoseArray", head, [one.pose for one in poses])


def bag(path: Path, kind: str, topics: dict[str, list[Any]]) -> Path:
    """A bag with these messages, one a second."""
    with rosbags.Writer(path, version=9, storage_plugin=KINDS[kind]) as writer:
        for topic, messages in topics.items():
            name = messages[0].__msgtype__
            connection = writer.add_connection(topic, name, typestore=STORE)
            for number, message in enumerate(messages):
                writer.write(connection, (number + 1) * 10**9, STORE.serialize_cdr(message, name))
    return path


def file_of(path: Path) -> Path:
    (found,) = (one for one in path.iterdir() if one.suffix != ".yaml")
    return found


@pytest.mark.parametrize("kind", list(KINDS))
def test_a_trace_is_read_from_a_folder_and_from_its_file(kind: str, tmp_path: Path) -> None:
    tips = [pose(n + 1, 0.0, -0.001 * n, 0.0) for n in range(5)]
    path = bag(tmp_path / "bag", kind, {"/sensor/tip": tips, "/sensor/base": tips[:1]})
    for one in (path, file_of(path)):
        assert is_bag(one)
        samples = read_samples(one)
        assert samples.points_mm == pytest.approx(np.array([[0.0, -n, 0.0] for n in range(5)]))
        assert "/sensor/tip" in samples.name
    in_mm = read_samples(path, Columns("/sensor/tip", "mm"))
    assert in_mm.points_mm[4, 1] == pytest.approx(-0.004)


def test_stamps_order_the_samples_and_gaps_are_counted(tmp_path: Path) -> None:
    tips = [pose(3, 3.0, 0, 0), pose(1, 1.0, 0, 0), pose(2, math.nan, 0, 0), pose(0, 2e-9, 0, 0)]
    found = positions_in(bag(tmp_path / "bag", "mcap", {"/sensor/tip": tips}))
    assert (len(found.points), found.missing) == (3, 1)
    # A stamp of 0 says nothing: it counts when it was recorded, after 4 s.
    assert found.times_s == (3.0, 1.0, 4.0)
    samples = read_samples(tmp_path / "bag")
    assert list(samples.points_mm[:, 0]) == pytest.approx([1000.0, 3000.0, 2e-6])


def test_the_tip_of_a_shape_is_its_last_pose(tmp_path: Path) -> None:
    shapes = [shape(pose(1, 0, 0, 0), pose(1, 0, 0, 0.02)), shape()]
    path = bag(tmp_path / "bag", "mcap", {"/needle/state/shape": shapes})
    found = positions_in(path)
    assert (found.points, found.missing) == (((0.0, 0.0, 0.02),), 1)


def text(said: str) -> Any:
    return of("std_msgs/msg/String", said)


@pytest.mark.parametrize(
    ("wanted", "says"),
    [
        (None, "poses are on /a, /b"),
        ("/c", "/c has std_msgs/msg/String, which says no position"),
        ("/d", "there is no topic /d"),
    ],
)
def test_a_topic_that_is_no_tip_is_refused(wanted: str | None, says: str, tmp_path: Path) -> None:
    tips = [pose(1, 0.0, 0.0, 0.0)]
    path = bag(tmp_path / "bag", "mcap", {"/a": tips, "/b": tips, "/c": [text("x")]})
    with pytest.raises(InputError, match=says):
        positions_in(path, wanted)


def test_a_damaged_bag_gets_one_message(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag", "mcap", {"/sensor/tip": [pose(1, 0.0, 0.0, 0.0)]})
    file = file_of(path)
    file.write_bytes(file.read_bytes()[:200])
    with pytest.raises(InputError, match="this bag of ROS cannot be read"):
        read_samples(path)


def logged(path: Path) -> Path:
    """The log of the beginning of a run."""
    with Log(path, metadata_of({"settings": Settings().to_json()}), {}) as log:
        log.started(load(ROOT / "examples" / "paper.nsl"))
        log.record(Transition(1.0, "arm", "armed", "estimate"))
    return path


@pytest.mark.parametrize("kind", list(KINDS))
def test_a_run_in_a_bag_is_the_log_that_was_published(kind: str, tmp_path: Path) -> None:
    log = logged(tmp_path / "run.mcap")
    data = np.frombuffer(log.read_bytes(), np.uint8)
    layout = of("std_msgs/msg/MultiArrayLayout", [], 0)
    pieces = [
        of("std_msgs/msg/UInt8MultiArray", layout, data[begin : begin + 5000])
        for begin in range(0, len(data), 5000)
    ]
    path = bag(tmp_path / "bag", kind, {LOG: pieces})
    assert log_in(path) == log.read_bytes()
    found = read_log(path)
    assert found.records == read_log(log).records
    assert found.sha256 == read_log(log).sha256


def test_a_bag_without_a_run_is_told(tmp_path: Path) -> None:
    path = bag(tmp_path / "bag", "mcap", {"/sensor/tip": [pose(1, 0.0, 0.0, 0.0)]})
    for one in (path, file_of(path)):
        with pytest.raises(InputError, match=r"not the log of a run: it is a bag of ROS"):
            read_log(one)
