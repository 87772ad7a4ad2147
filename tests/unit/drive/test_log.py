"""Log and reading: nothing is changed on the way, and a torn log gives all up to the tear."""

from __future__ import annotations

import dataclasses
import json
import math
import re
import resource
import subprocess
import sys
from pathlib import Path
from typing import get_args, get_type_hints

import lz4.frame
import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk, Footer
from mcap.writer import CompressionType, Writer
from mcap_protobuf.decoder import DecoderFactory

from ntagen.cli import main
from ntagen.drive.log import ACTUAL, VIEW_S, Log, metadata_of, topic_of
from ntagen.drive.messages import KINDS, decode, encode
from ntagen.drive.reading import read_log
from ntagen.drive.records import (
    Command,
    JournalError,
    Measured,
    Predicted,
    Record,
    Transition,
)
from ntagen.drive.scene_json import scene_from_json, scene_to_json
from ntagen.drive.settings import Settings
from ntagen.drive.viewing import quaternion
from ntagen.errors import InputError
from ntagen.needle.kinematics import bending_axis
from ntagen.scene import MEASURED_TISSUE, Pose, Scene
from ntagen.traces.reading import read_samples
from tests.logs import repacked
from tests.scenes import poses
from tests.steering import PAPER, scene

ROOT = Path(__file__).parents[3]

numbers = st.floats(-1e12, 1e12)

SCALARS = {
    float: numbers,
    int: st.integers(0, 10**9),
    bool: st.booleans(),
    str: st.text(max_size=9),
}


@st.composite
def records(draw: st.DrawFn) -> Record:
    kind = draw(st.sampled_from(KINDS))
    values = {}
    for field, hint in get_type_hints(kind).items():
        if field not in {f.name for f in dataclasses.fields(kind)}:
            continue
        if get_args(hint):
            values[field] = tuple(draw(numbers) for _ in range(3))
        else:
            values[field] = draw(SCALARS[hint])
    return kind(**values)


@given(records(), st.integers(0, 10**9))
def test_a_record_survives_its_message(record: Record, sequence: int) -> None:
    name = f"ntagen.{type(record).__name__}"
    assert decode(name, encode(record, sequence)) == (sequence, record)


@pytest.mark.parametrize("of", [PAPER, scene(), dataclasses.replace(PAPER, tissue=MEASURED_TISSUE)])
def test_a_scene_survives_json(of: Scene) -> None:
    assert scene_from_json(scene_to_json(of)) == of


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"version": 2}', '{"version": 1, "scene": {}}'])
def test_what_is_no_scene_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        scene_from_json(text)


@pytest.mark.parametrize(
    ("entry", "value"),
    [("name", {}), ("resolution_per_mm", "9"), ("criticals", None), ("axis", [0, 1]), ("more", 1)],
)
def test_a_scene_with_a_wrong_entry_is_refused(entry: str, value: object) -> None:
    document = json.loads(scene_to_json(PAPER))
    document["scene"][entry] = value
    with pytest.raises(InputError, match="cannot be read"):
        scene_from_json(json.dumps(document))


@pytest.mark.parametrize("text", ['{"version": 1, "scene": {"name": ', "9" * 5000, "[" * 100_000])
def test_a_scene_of_broken_json_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        scene_from_json(text)


def test_settings_survive_json() -> None:
    settings = Settings(timeout_s=7.0, ranking=("length",))
    assert Settings.from_json(settings.to_json()) == settings


@given(poses())
def test_the_quaternion_is_the_rotation_of_the_tip(pose: Pose) -> None:
    x, y, z, w = quaternion(pose)
    assert math.hypot(x, y, z, w) == pytest.approx(1.0, abs=1e-6)
    first = (1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w))
    second = (2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w))
    assert first == pytest.approx(pose.heading, abs=1e-6)
    assert second == pytest.approx(bending_axis(pose), abs=1e-6)


MANY = [Command(0.25 * i, "push", 0.25) for i in range(40)]
ALARM = Transition(10.0, "monitor", "force", "stop")


def written(path: Path) -> Path:
    with filled(path):
        pass
    return path


def filled(path: Path) -> Log:
    settings = metadata_of({"seed": 1, "settings": Settings().to_json()})
    log = Log(path, settings, {ACTUAL: scene_to_json(PAPER).encode()})
    log.started(scene())
    for record in [*MANY, ALARM]:
        log.record(record)
    return log


def test_a_log_is_read_as_it_was_written(tmp_path: Path) -> None:
    log = read_log(written(tmp_path / "run.mcap"))
    assert log.records == (*MANY, ALARM)
    assert log.metadata["seed"] == "1"
    assert log.torn_at_byte is None
    assert (log.scene, log.actual) == (scene(), PAPER)
    assert log.settings == Settings()


def test_common_readers_read_the_log(tmp_path: Path) -> None:
    with written(tmp_path / "run.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        commands = [
            m for _, c, _, m in reader.iter_decoded_messages() if c.topic == topic_of(Command)
        ]
    assert [command.value for command in commands] == [0.25] * len(MANY)


def test_a_log_that_is_not_kept_up_shows_the_needle_seldom_and_has_all_records(
    tmp_path: Path,
) -> None:
    records = [
        record
        for i in range(41)
        for record in (
            Measured(0.125 * i, 0.25 * i, (0.0, -0.25 * i, 0.0), 0.0, (), ()),
            Predicted(0.125 * i, (0.0, -0.25 * i, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), 0.0),
        )
    ]

    def shown(name: str, *, is_kept_up: bool) -> dict[str, list[float]]:
        path = tmp_path / name
        with Log(path, {}, {}, is_kept_up=is_kept_up) as log:
            log.started(PAPER)
            for record in records:
                log.record(record)
        assert read_log(path).records == tuple(records)
        seen: dict[str, list[float]] = {}
        with path.open("rb") as stream:
            for _, channel, message in make_reader(stream).iter_messages():
                seen.setdefault(channel.topic, []).append(message.log_time / 1e9)
        return seen

    watched = shown("watched.mcap", is_kept_up=True)
    alone = shown("alone.mcap", is_kept_up=False)
    seldom_s = [VIEW_S * i for i in range(math.floor(0.125 * 40 / VIEW_S) + 1)]
    for topic in ("/needle/measured", "/needle/tip", "/tf"):
        assert watched[topic] == [0.125 * i for i in range(41)]
        assert alone[topic] == seldom_s
    # The shaft has grown each time.
    assert sorted({*alone["/scene"]}) == seldom_s
    assert {*alone["/scene"]} < {*watched["/scene"]}


def test_equal_runs_give_equal_files(tmp_path: Path) -> None:
    first, second = written(tmp_path / "a.mcap"), written(tmp_path / "b.mcap")
    assert first.read_bytes() == second.read_bytes()


def test_every_record_is_with_the_system_before_the_log_is_closed(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with filled(path):
        log = read_log(path)
        assert log.torn_at_byte == path.stat().st_size
    assert log.records == (*MANY, ALARM)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.9, 0.99])
def test_a_torn_log_gives_all_before_the_tear(tmp_path: Path, share: float) -> None:
    data = written(tmp_path / "run.mcap").read_bytes()
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(data[: int(len(data) * share)])
    log = read_log(torn)
    assert log.records == (*MANY, ALARM)[: len(log.records)]
    assert log.torn_at_byte is not None
    assert 0 < log.torn_at_byte <= len(data) * share


@pytest.mark.parametrize(
    "wrong",
    [
        Predicted(1.0, (math.nan, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.0),
        Predicted(1.0, (1e300, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), 0.0),
        Command(math.inf, "push", 1.0),
        Measured(1.0, 2.0, (1.0, 2.0), 0.0, (), ()),  # type: ignore[arg-type]
        Measured(1.0, 2.0, (1.0, 2.0, 3.0), 0.0, (1.0,), ()),
    ],
)
def test_a_record_that_cannot_be_right_is_none(wrong: Record) -> None:
    with pytest.raises(ValueError, match=r"numbers|cannot be right"):
        decode(f"ntagen.{type(wrong).__name__}", encode(wrong, 1))


def test_a_wrong_length_in_a_chunk_is_a_tear(tmp_path: Path) -> None:
    data = bytearray(written(tmp_path / "run.mcap").read_bytes())
    chunk = RecordBuilder()
    Chunk("", b"some data", 0, 0, 0, 9).write(chunk)
    end = data.index(bytes([Opcode.DATA_END]) + (4).to_bytes(8, "little"))
    wrong = bytearray(chunk.end())
    # The length of the data is the last but the data.
    wrong[-17:-9] = (1 << 62).to_bytes(8, "little")
    path = tmp_path / "wrong.mcap"
    path.write_bytes(data[:end] + wrong)
    log = read_log(path)
    assert log.records == (*MANY, ALARM)
    assert log.torn_at_byte == end


@pytest.mark.parametrize("data", [b"", b"\x00" * 100, b"\x89MCAP0\r\n", b"<nta></nta>"])
def test_what_is_no_log_is_refused(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(data)
    with pytest.raises(InputError, match="not the log of a run"):
        read_log(path)


def check_is_no_log(path: Path, *says: str) -> None:
    with pytest.raises(InputError, match="not the log of a run") as refusal:
        read_log(path)
    text = str(refusal.value)
    assert text.startswith(f"{path}: ")
    assert "hint:" in text
    assert all(words in text for words in says), text


def test_a_packed_log_that_is_cut_off_is_told(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    with path.open("wb") as out:
        writer = Writer(out, chunk_size=1 << 24, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema("ntagen.Command", "protobuf", b"")
        channel = writer.register_channel("/ntagen/command", "protobuf", schema)
        for number in range(1000):
            data = encode(Command(number * 1.7, "push", number**0.5), number)
            writer.add_message(channel, number, data, number)
        writer.finish()
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 3])
    start = data.index(bytes([Opcode.CHUNK]), 20)
    check_is_no_log(path, f"cut off at byte {start}", "within its first chunk of packed data")


def test_a_log_whose_metadata_were_filtered_out_is_told(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap")
    kinds = {Opcode.METADATA, Opcode.ATTACHMENT, Opcode.METADATA_INDEX, Opcode.ATTACHMENT_INDEX}
    path.write_bytes(without(path.read_bytes(), kinds))
    count = len((*MANY, ALARM))
    check_is_no_log(path, f"it has {count} records of a run", "the metadata `ntagen`", "filter")


def test_a_log_without_attachments_says_which_one_is_missing(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap")
    path.write_bytes(without(path.read_bytes(), {Opcode.ATTACHMENT, Opcode.ATTACHMENT_INDEX}))
    log = read_log(path)
    assert log.records == (*MANY, ALARM)
    with pytest.raises(InputError, match=r"the attachment scene\.json is missing") as refusal:
        _ = log.scene
    assert str(path) in str(refusal.value)
    assert "leave out metadata and attachments" in str(refusal.value)


def test_a_log_without_measurements_says_where_it_is_cut_off(tmp_path: Path) -> None:
    path = written(tmp_path / "run.mcap")
    data = path.read_bytes()
    # Behind the metadata, which say that it is a log.
    end = 17 + int.from_bytes(data[9:17], "little")
    end += 9 + int.from_bytes(data[end + 1 : end + 9], "little")
    path.write_bytes(data[: end + 20])
    with pytest.raises(InputError, match="no measurements in this log: it is cut off at byte"):
        read_samples(path)


def without(data: bytes, kinds: set[Opcode]) -> bytes:
    """A file without the records of some kinds, and without its end."""
    kept, start = bytearray(data[:8]), 8
    while start + 9 <= len(data) and data[start] != Opcode.DATA_END:
        end = start + 9 + int.from_bytes(data[start + 1 : start + 9], "little")
        if data[start] not in kinds:
            kept += data[start:end]
        start = end
    footer = RecordBuilder()
    Footer(0, 0, 0).write(footer)
    return bytes(kept + footer.end() + data[:8])


def test_a_bag_of_ros_is_told_with_its_topics(tmp_path: Path) -> None:
    path = tmp_path / "bag.mcap"
    with path.open("wb") as out:
        writer = Writer(out)
        writer.start(profile="ros2", library="rosbag2")
        schema = writer.register_schema("geometry_msgs/msg/PoseStamped", "ros2msg", b"")
        for topic in ("/sensor/tip", "/sensor/base"):
            writer.add_message(writer.register_channel(topic, "cdr", schema), 0, bytes(64), 0)
        writer.finish()
    check_is_no_log(path, "a bag of ROS", "/sensor/tip, /sensor/base", "`ntagen match`")
    for start, says in ((b"SQLite format 3\0", "bags of ROS 2"), (b"#ROSBAG V2.0\n", "ROS 1")):
        path.write_bytes(start + bytes(100))
        check_is_no_log(path, says, "`ntagen match`")
        with pytest.raises(InputError, match="bag of ROS"):
            read_samples(path.rename(tmp_path / "bag.db3"))


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_log(tmp_path / "none.mcap")
    with pytest.raises(InputError, match="folder"):
        read_log(tmp_path)
    with pytest.raises(InputError, match="folder"):
        Log(tmp_path, {}, {})


MESSAGE = bytes([Opcode.MESSAGE]) + (22).to_bytes(8, "little") + bytes(22)
BOMB_BYTES = 1 << 28


def packed(compression: str) -> bytes:
    """256 MiB of empty messages, packed."""
    piece = MESSAGE * 100_000
    pieces = BOMB_BYTES // len(piece)
    if compression == "zstd":
        zstd = zstandard.ZstdCompressor(level=3, write_content_size=False).compressobj()
        return b"".join([*(zstd.compress(piece) for _ in range(pieces)), zstd.flush()])
    lz4_ = lz4.frame.LZ4FrameCompressor()
    return b"".join([lz4_.begin(), *(lz4_.compress(piece) for _ in range(pieces)), lz4_.flush()])


def bomb(path: Path, compression: str) -> Path:
    """A log with a chunk that says a small size and unpacks to 256 MiB."""
    data = packed(compression)
    chunk = RecordBuilder()
    Chunk(compression, data, 0, 0, 0, 1000).write(chunk)
    good = written(path).read_bytes()
    # After the good start, before anything that is known only at the end.
    end = good.index(bytes([Opcode.DATA_END]) + (4).to_bytes(8, "little"))
    path.write_bytes(good[:end] + chunk.end())
    return path


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="measured as Linux does it")
@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_log_that_unpacks_to_more_than_it_may_is_refused_in_little_memory(
    tmp_path: Path, compression: str
) -> None:
    path = bomb(tmp_path / "run.mcap", compression)
    assert path.stat().st_size < BOMB_BYTES / 100
    command = [sys.executable, "-c", MEASURED, str(path)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert "it unpacks to more than" in run.stderr
    assert int(run.stdout) < 200_000


MEASURED = """
import pathlib, re, sys
from ntagen.cli import main
code = main(["replay", sys.argv[1]])
# The usage of resources would hold the size of the process that started this one.
print(re.search(r"VmHWM:\\s+(\\d+) kB", pathlib.Path("/proc/self/status").read_text())[1])
sys.exit(code)
"""
"""Replays a log; prints the largest size of the process in KiB."""


@pytest.mark.parametrize("compression", list(CompressionType))
def test_logs_that_were_packed_anew_are_read(tmp_path: Path, compression: CompressionType) -> None:
    path = written(tmp_path / "run.mcap")
    expected = read_log(path)
    anew = tmp_path / "anew.mcap"
    anew.write_bytes(repacked(path.read_bytes(), compression, lambda record: record))
    assert read_log(anew) == expected


def test_a_second_run_into_the_same_log_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "run.mcap"
    with filled(path):
        before = path.read_bytes()
        code = main(["drive", str(ROOT / "examples" / "paper.nsl"), "--log", str(path)])
        assert path.read_bytes() == before
    assert code == 2
    assert "another run is writing to it" in capsys.readouterr().err
    assert read_log(path).records == (*MANY, ALARM)


def test_a_log_that_cannot_be_completed_has_all_records(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    log = filled(path)
    records = read_log(path).records
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (path.stat().st_size, old[1]))
    try:
        with pytest.raises(JournalError, match="the run is over, and its log has no index"):
            log.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
    assert read_log(path).records == records != ()


def test_a_full_disk_ends_the_log_with_a_whole_record(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (40_000, old[1]))
    log = filled(path)
    written_s: list[float] = []

    def go_on() -> None:
        while True:
            log.record(Command(20.0 + len(written_s), "push", 0.25))
            written_s.append(20.0 + len(written_s))

    try:
        with pytest.raises(JournalError, match=r"cannot write .*run\.mcap"):
            go_on()
        # The run ends with a fault, and others tell it: here nothing is kept any more.
        log.record(ALARM)
        log.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
    read = read_log(path)
    assert written_s
    assert [record.time_s for record in read.records[len(MANY) + 1 :]] == written_s
    assert read.torn_at_byte == path.stat().st_size


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("timeout_s", "nan"),
        ("timeout_s", "null"),
        ("spacing_mm", "0"),
        ("deviation_mm", '"far"'),
        ("force_n", "-1"),
        ("pull_mm", "2.0"),
        ("noise_mm", "0"),
        ("depth_mm", "[]"),
    ],
)
def test_settings_that_make_no_sense_are_refused(name: str, value: str) -> None:
    text = re.sub(rf'("{name}": )[^,}}]+', rf"\g<1>{value}", json.dumps(Settings().to_json()))
    with pytest.raises(InputError):
        Settings.from_json(json.loads(text.replace("nan", "NaN")))
