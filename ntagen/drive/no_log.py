"""Why a file is not the log of a run: what it is instead, or what is missing in it."""

from __future__ import annotations

import struct
from collections.abc import Collection
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Final

from mcap.opcode import Opcode

from ntagen.errors import InputError

_START_BYTES: Final = 16
MAGIC: Final = b"\x89MCAP"
HEAD: Final = struct.Struct("<BQ")
"""The start of a record: its kind, and the length of the rest."""

_OTHER_FILES: Final = {
    b"SQLite format 3": "a database (SQLite), as bags of ROS 2 are",
    b"#ROSBAG": "a bag of ROS 1",
    b"PK\x03\x04": "a ZIP archive",
    b"\x1f\x8b": "packed (gzip)",
    b"\x28\xb5\x2f\xfd": "packed (zstd)",
}
_ROS_ENCODINGS: Final = frozenset({"cdr", "ros1"})
_TOPICS_SHOWN: Final = 5

_GIVE: Final = "hint: give a file that `ntagen drive --log` wrote"
_BAG: Final = (
    "hint: a bag has a run if `ntagen ros --log` was recorded with the topic /ntagen/log, and if "
    "the package rosbags is there (pip install 'ntagen[bags]'); `ntagen match` reads the positions "
    "of any bag"
)
_FILTERED: Final = (
    "hint: tools that filter, merge or repair logs leave out metadata and attachments unless they "
    "are told to keep them; give the file that `ntagen drive --log` wrote"
)


@dataclass(slots=True)
class Contents:
    """What was found in a file.

    Attributes:
        profile: The profile in the header of the file, such as ``ros2``.
        topics: The topics of its messages, in order, and their encodings.
    """

    profile: str = ""
    topics: dict[str, str] = field(default_factory=dict)


def no_log(
    path: Path, file: IO[bytes], found: Contents, records: int, torn_at: int | None
) -> InputError:
    """The error about a file without the metadata of a run.

    Args:
        path: The file.
        file: The same, open.
        found: What was read.
        records: How many records of a run it has.
        torn_at: The byte at which it becomes unreadable; None if it is whole.
    """
    file.seek(0)
    start = file.read(_START_BYTES)
    what = f"{path}: not the log of a run"
    if not start.startswith(MAGIC):
        is_other = (words for begin, words in _OTHER_FILES.items() if start.startswith(begin))
        words = next(is_other, "no MCAP file")
        hint = _BAG if "ROS" in words else _GIVE
        return InputError(f"{what}: it is {words if start else 'empty'}\n{hint}")
    if found.profile.startswith("ros") or _ROS_ENCODINGS & set(found.topics.values()):
        topics = f" with the topics {_shown(found.topics)}" if found.topics else ""
        return InputError(f"{what}: it is a bag of ROS{topics}\n{_BAG}")
    if records:
        return InputError(
            f"{what}: it has {records} records of a run, but the metadata `ntagen` with the "
            f"settings of the run are missing\n{_FILTERED}"
        )
    if torn_at is not None:
        file.seek(torn_at)
        torn = file.read(HEAD.size)
        kind = HEAD.unpack_from(torn)[0] if len(torn) >= HEAD.size else None
        inside = "within its first chunk of packed data" if kind == Opcode.CHUNK else "or damaged"
        return InputError(
            f"{what} that can be read: it is cut off at byte {torn_at}, {inside}, and nothing of a "
            f"run comes before\n{_GIVE}"
        )
    topics = f"it has the topics {_shown(found.topics)}" if found.topics else "it has no topics"
    return InputError(f"{what}: {topics}, and none of a run\n{_GIVE}")


def no_log_in_bag(path: Path) -> InputError:
    """The error about a folder that is a bag without the log of a run."""
    return InputError(f"{path}: not the log of a run: it is a bag of ROS\n{_BAG}")


def nothing_attached(
    path: Path, name: str, attached: Collection[str], *, is_torn: bool
) -> InputError:
    """The error that an attachment is not in a log."""
    hint = "hint: it was cut off before the run began" if is_torn and not attached else _FILTERED
    return InputError(f"{path}: the log has no scene: the attachment {name} is missing\n{hint}")


def _shown(topics: Collection[str]) -> str:
    first = ", ".join(list(topics)[:_TOPICS_SHOWN])
    more = f", … ({len(topics)} in all)" if len(topics) > _TOPICS_SHOWN else ""
    return first + more
