"""Damaged traces, calibrations, logs and bags: each is read, or refused at its name, within limits.

``NTAGEN_FILES=20000 NTAGEN_SEED=1`` makes a large run of each test. ``NTAGEN_FOUND=FOLDER`` keeps
the files that are wrong.
"""

from __future__ import annotations

import io
import json
import math
import os
import random
import struct
from pathlib import Path
from typing import Any

import pytest
from mcap.records import Attachment, Message, Metadata
from mcap.writer import CompressionType, Writer

from ntagen.cli import main
from ntagen.drive.reading import read_log
from ntagen.drive.replay import replay
from ntagen.drive.story import tell
from ntagen.errors import InputError, LimitError
from ntagen.plan.synthesise import Synthesis
from ntagen.plot.run import picture_of_run
from ntagen.scene import Scene
from ntagen.traces.reading import Columns, read_samples
from ntagen.traces.trace import trace_of
from ntagen.tracking.frames import IDENTITY
from ntagen.tracking.playback import Playback, samples_of_log, samples_of_table
from ntagen.tracking.points import Points, pair, read_points
from ntagen.tracking.registration import register
from ntagen.tracking.transform_file import read_transform
from tests.damage import SEED, Read, check_files, damaged, is_read
from tests.logs import repacked

ROOT = Path(__file__).parents[2]
FILES = int(os.environ.get("NTAGEN_FILES", "60"))
LOGS = int(os.environ.get("NTAGEN_FILES", "16"))


# Tables of traces.


def trace_seeds() -> list[bytes]:
    """The same trace in the forms that are read."""
    text = (ROOT / "examples" / "traces" / "two_rolls.csv").read_text()
    rows = [line.split(",") for line in text.splitlines()[1:]]
    ndi = ["Tools,Port 1,Frame,Face,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error"]
    ndi += [f"1,P,{n},0,OK,1,0,0,0,{x},{y},{z},.1" for n, (_, x, y, z) in enumerate(rows)]
    ndi[20] = "1,P,20,0,MISSING,,,,,,,,"
    return [
        one.encode()
        for one in (
            text,
            text.replace(",", ";").replace(".", ","),
            "\n".join(" ".join(row[1:]) for row in rows),
            "Time\tX\tY\tZ\ns\tmm\tmm\tmm\n" + "\n".join("\t".join(row) for row in rows),
            "\n".join(ndi),
            '"time, s","x_mm","y_mm","z_mm"\n'
            + "\n".join(f'"{t}",{x},{y},{z}' for t, x, y, z in rows),
        )
    ]


def test_damaged_traces_are_read_or_refused(tmp_path: Path) -> None:
    def read(path: Path) -> None:
        trace_of(read_samples(path, Columns(unit=random.Random(1).choice(["mm", "m"]))))

    assert 0 < check_files(tmp_path, "trace.csv", trace_seeds(), read, FILES) < FILES


def test_damaged_recordings_are_read_or_refused(tmp_path: Path) -> None:
    head = "time_s,x_mm,y_mm,z_mm,force_n,heading_x,heading_y,heading_z,bevel_x,bevel_y,bevel_z\n"
    rows = [f"{0.1 * n:.1f},{n},0,{-n},0.1,0,1,0,,," for n in range(40)]
    text = head + "\n".join(rows)
    seeds = [text.encode(), text.replace(",", ";").replace(".", ",").encode()]

    def read(path: Path) -> None:
        samples, has_force = samples_of_table(path, IDENTITY)
        Playback(str(path), samples, lambda: 0.0, measures_force=has_force).measure()

    assert 0 < check_files(tmp_path, "run.csv", seeds, read, FILES) < FILES


# Calibrations.

CALIBRATION = (ROOT / "examples" / "calibration.csv").read_bytes()
FCSV = b"""# Markups fiducial file version = 4.11
# CoordinateSystem = LPS
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
1,10.0,20.5,-3,0,0,0,1,1,1,0,A,,
2,30,-20,8,0,0,0,1,1,1,0,B,,
3,-30,15,40,0,0,0,1,1,1,0,C,,
4,5,44,-17,0,0,0,1,1,1,0,D,,
"""
MARKUPS = json.dumps(
    {
        "markups": [
            {
                "type": "Fiducial",
                "coordinateSystem": "LPS",
                "coordinateUnits": "mm",
                "controlPoints": [
                    {"id": str(n), "label": name, "position": place, "positionStatus": "defined"}
                    for n, (name, place) in enumerate(
                        {
                            "A": [10, 20.5, -3],
                            "B": [30, -20, 8],
                            "C": [-30, 15, 40],
                            "D": [5, 44, -17],
                        }.items()
                    )
                ],
            }
        ]
    },
    indent=1,
).encode()
REGISTRATION = json.dumps(
    {
        "format": "ntagen-registration",
        "version": 1,
        "from": "bench",
        "to": "scene",
        "rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
        "translation_mm": [100, -20, 7],
    }
).encode()


def _registered(path: Path) -> None:
    sets = read_points(path, iter(["tracker", "scene"]))
    first, second = sets if len(sets) == 2 else (sets[0], Points("scene", sets[0].positions_mm))
    try:
        register(pair(first, second))
    except InputError as error:
        # The command names the files of the two sets.
        raise InputError(f"{path}: {error}") from error


@pytest.mark.parametrize(
    ("name", "seed", "read"),
    [
        ("points.csv", CALIBRATION, _registered),
        ("points.fcsv", FCSV, _registered),
        ("points.mrk.json", MARKUPS, _registered),
        ("registration.json", REGISTRATION, read_transform),
    ],
)
def test_damaged_calibrations_are_read_or_refused(
    tmp_path: Path, name: str, seed: bytes, read: Read
) -> None:
    assert 0 < check_files(tmp_path, name, [seed], read, FILES) < FILES


# Logs and bags.


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The log of a drive."""
    path = tmp_path_factory.mktemp("log") / "run.mcap"
    task = ROOT / "examples" / "paper.nsl"
    assert main(["drive", str(task), "--quiet", "--noise", "0.1mm", "--log", str(path)]) == 0
    return path.read_bytes()


@pytest.fixture(scope="module")
def logs(log: bytes) -> list[bytes]:
    """The log as it is, and without compression and models, which are most of its bytes."""

    def short(item: Any) -> Any:  # noqa: ANN401  a record of a log
        is_model = isinstance(item, Attachment) and item.name.startswith("rebuild-")
        is_view = isinstance(item, Message) and item.channel_id > 17
        return None if is_model or is_view else item

    return [log, *(repacked(log, kind, short) for kind in CompressionType)]


def _no_plan(_: Scene) -> Synthesis:
    raise LimitError("nothing is looked for here")


def _looked_at(path: Path) -> None:
    run = read_log(path)
    run.rows()
    for record in run.records:
        tell(record)
    picture_of_run(run, 3)
    replay(run, _no_plan)


def test_damaged_logs_are_read_or_refused(tmp_path: Path, logs: list[bytes]) -> None:
    assert 0 < check_files(tmp_path, "run.mcap", logs, _looked_at, LOGS) < LOGS


def test_damaged_logs_are_traces_or_refused(tmp_path: Path, logs: list[bytes]) -> None:
    def read(path: Path) -> None:
        trace_of(read_samples(path))
        Playback(str(path), samples_of_log(path), lambda: 0.0).measure()

    assert 0 < check_files(tmp_path, "trace.mcap", logs, read, LOGS) < LOGS


def changed_values(data: bytes, draw: random.Random) -> bytes:
    """A log in which fields of messages, metadata and attachments have other values."""

    def change(item: Any) -> Any:  # noqa: ANN401  a record of a log
        if draw.random() > 0.02 and not isinstance(item, Metadata | Attachment):
            return item
        match item:
            case Message():
                if draw.random() < 0.5:
                    item.data = damaged(item.data, draw)
                elif len(item.data) >= 9:
                    place = draw.randrange(len(item.data) - 8)
                    number = draw.choice([math.nan, math.inf, -1e300, 0.0, 1e-300, -1.0, 1e9])
                    item.data = (
                        item.data[:place] + struct.pack("<d", number) + item.data[place + 8 :]
                    )
            case Attachment() if draw.random() < 0.3:
                item.data = damaged(item.data, draw)
            case Metadata() if draw.random() < 0.3:
                name = draw.choice(sorted(item.metadata))
                text = item.metadata[name].encode()
                item.metadata[name] = damaged(text, draw).decode("utf-8", "replace")
            case _:
                pass
        return item

    return repacked(data, CompressionType.NONE, change)


def test_logs_with_other_values_are_read_or_refused(tmp_path: Path, logs: list[bytes]) -> None:
    draw = random.Random(f"values {SEED}")
    path = tmp_path / "run.mcap"
    for number in range(LOGS // 4):
        path.write_bytes(changed_values(logs[1], draw))
        is_read(path, _looked_at, number)


def bag() -> bytes:
    """A bag of ROS 2 with a pose."""
    out = io.BytesIO()
    writer = Writer(out)
    writer.start(profile="ros2", library="rosbag2")
    schema = writer.register_schema("geometry_msgs/msg/PoseStamped", "ros2msg", b"Header header\n")
    channel = writer.register_channel("/sensor/tip", "cdr", schema)
    for number in range(30):
        writer.add_message(channel, number, struct.pack("<4xIQ7d", 0, 1, *range(7)), number)
    writer.finish()
    return out.getvalue()


def test_damaged_bags_are_refused(tmp_path: Path) -> None:
    bags = [bag(), b"SQLite format 3\0" + bytes(4080), b"#ROSBAG V2.0\n" + bytes(200)]
    assert check_files(tmp_path, "bag.mcap", bags, read_log, FILES) == 0
