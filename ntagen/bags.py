"""Bags of ROS, read without ROS (rosbags): positions of a tip, and the log of a run in them.

A bag is a folder with a ``metadata.yaml``, or one of its files: MCAP with messages in CDR, or a
database of SQLite. Bags of ROS 1 are read, too. The package rosbags is imported when it is needed.
"""

from __future__ import annotations

import contextlib
import importlib
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.values import dataclass

LOG: Final = "/ntagen/log"
"""The topic on which a node publishes the log of its run."""

TIPS: Final = ("/sensor/tip", "/sensor/tip_filtered", "/needle/state/shape")
"""The topics of a tip that labs of needle steering use, the best first."""

_KINDS: Final[dict[str, Callable[[Any], Any]]] = {
    "geometry_msgs/msg/PoseStamped": lambda message: message.pose.position,
    "geometry_msgs/msg/PointStamped": lambda message: message.point,
    "geometry_msgs/msg/TransformStamped": lambda message: message.transform.translation,
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda message: message.pose.pose.position,
    # The shape of a needle, from its base to the tip.
    "geometry_msgs/msg/PoseArray": lambda message: message.poses[-1].position,
}
"""What says where something is, and how."""

_METADATA: Final = "metadata.yaml"
_SQLITE: Final = b"SQLite format 3\0"
_ROS_1: Final = b"#ROSBAG"
_MCAP: Final = b"\x89MCAP"
_HEAD_BYTES: Final = 64
_PROFILES: Final = (b"ros1", b"ros2")
_S_PER_NS: Final = 1e-9
_TOPICS_SHOWN: Final = 12


@dataclass(frozen=True, slots=True)
class Positions:
    """The positions that a topic says.

    Attributes:
        topic: The topic.
        times_s: When each was made by its stamp, or else when it was recorded.
        points: One position each, in the unit of the messages.
        missing: How many messages had no position, or one that is not a number.
    """

    topic: str
    times_s: tuple[float, ...]
    points: tuple[tuple[float, float, float], ...]
    missing: int


def is_bag(path: Path) -> bool:
    """Whether a path is a bag of ROS, by how it begins."""
    if path.is_dir():
        return (path / _METADATA).is_file()
    if not path.is_file():
        return False
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    if head.startswith(_MCAP):
        # The magic number, the kind and the length of the first record, the length of its profile.
        return head[21:25] in _PROFILES
    return head.startswith((_SQLITE, _ROS_1))


def positions_in(path: Path, topic: str | None = None) -> Positions:
    """The positions on a topic of a bag.

    Args:
        path: The bag.
        topic: The topic; None for that of the tip.

    Raises:
        InputError: The bag cannot be read, or has no such topic.
    """
    times_s, points, missing = [], [], 0
    with _opened(path) as reader:
        chosen = _chosen(path, reader, topic)
        place = _KINDS[chosen.msgtype]
        for _, stamp_ns, message in _messages(path, reader, [chosen]):
            point = None if _is_empty(message) else place(message)
            if point is None or not all(map(math.isfinite, (point.x, point.y, point.z))):
                missing += 1
                continue
            stamp = message.header.stamp
            made_s = stamp.sec + _S_PER_NS * stamp.nanosec
            times_s.append(made_s or _S_PER_NS * stamp_ns)
            points.append((float(point.x), float(point.y), float(point.z)))
    return Positions(chosen.topic, tuple(times_s), tuple(points), missing)


def log_in(path: Path) -> bytes | None:
    """The log of a run in a bag; None if it has none, or if rosbags is not installed.

    Raises:
        InputError: The bag cannot be read.
    """
    try:
        importlib.import_module("rosbags.highlevel")
    except ImportError:
        return None
    with _opened(path) as reader:
        found = [one for one in reader.connections if one.topic == LOG]
        pieces = [bytes(message.data) for _, _, message in _messages(path, reader, found)]
    return b"".join(pieces) if found else None


def topics_in(path: Path) -> tuple[str, ...]:
    """The topics of a bag.

    Raises:
        InputError: The bag cannot be read.
    """
    with _opened(path) as reader:
        return tuple(sorted({one.topic for one in reader.connections}))


def _is_empty(message: Any) -> bool:  # noqa: ANN401  types of the bag
    return not len(getattr(message, "poses", (None,)))


def _chosen(path: Path, reader: Any, topic: str | None) -> Any:  # noqa: ANN401  types of rosbags
    """The connection of a topic that says where something is."""
    usable = {one.topic: one for one in reader.connections if one.msgtype in _KINDS}
    if topic is None:
        usual = [name for name in TIPS if name in usable]
        if not usual and len(usable) != 1:
            raise InputError(
                f"{path}: nobody knows which topic of this bag is the tip; poses are on "
                f"{_shown(usable)}\nhint: name it, as in --columns /sensor/tip"
            )
        return usable[(usual or list(usable))[0]]
    if topic in usable:
        return usable[topic]
    kinds = {one.topic: one.msgtype for one in reader.connections}
    if topic in kinds:
        raise InputError(
            f"{path}: {topic} has {kinds[topic]}, which says no position\n"
            f"hint: poses are on {_shown(usable)}"
        )
    raise InputError(f"{path}: there is no topic {topic}\nhint: poses are on {_shown(usable)}")


def _shown(topics: Any) -> str:  # noqa: ANN401  a mapping or a sequence of names
    names = sorted(topics)
    more = f", … ({len(names)} in all)" if len(names) > _TOPICS_SHOWN else ""
    return ", ".join(names[:_TOPICS_SHOWN]) + more if names else "no topic"


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The reader of a bag."""
    try:
        highlevel = importlib.import_module("rosbags.highlevel")
        typesys = importlib.import_module("rosbags.typesys")
    except ImportError as error:
        raise InputError(
            f"{path} is a bag of ROS, and the package rosbags is not installed\n"
            "hint: pip install 'ntagen[bags]'"
        ) from error
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    with contextlib.ExitStack() as stack:
        try:
            reader = stack.enter_context(highlevel.AnyReader([path], default_typestore=store))
        # Damaged files make the libraries raise errors of many kinds.
        except Exception as error:
            raise _damaged(path, error) from error
        yield reader


def _messages(path: Path, reader: Any, connections: list[Any]) -> Iterator[Any]:  # noqa: ANN401
    """The messages of connections, in the order in which they were recorded."""
    if not connections:
        return
    try:
        for connection, stamp_ns, data in reader.messages(connections=connections):
            yield connection, stamp_ns, reader.deserialize(data, connection.msgtype)
    except InputError:
        raise
    except Exception as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> InputError:
    said = " ".join(str(error).split()) or type(error).__name__
    return InputError(
        f"{path}: this bag of ROS cannot be read: {said}\n"
        "hint: a bag that was cut off is mended by `ros2 bag reindex`, or for MCAP by "
        "`mcap recover`"
    )
