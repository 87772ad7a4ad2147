"""Runs in which something else than the needle measures it."""

from __future__ import annotations

import json
import socket
import threading
from pathlib import Path
from typing import Any

import pytest

from ntagen.cli import main
from ntagen.drive.reading import read_log
from ntagen.drive.records import Command, Measured, Record
from ntagen.openigtlink.messages import Columns, Transform
from ntagen.openigtlink.packets import Packet
from ntagen.openigtlink.server import Server
from ntagen.scene import Vector

ROOT = Path(__file__).parents[2]
PAPER = str(ROOT / "examples" / "paper.nsl")
RUN = ["drive", PAPER, "--noise", "0.1mm", "--seed", "3"]

# The scene lies turned about z by a quarter, and shifted, for the tracker.
REGISTRATION = {
    "format": "ntagen-registration",
    "version": 1,
    "from": "bench",
    "to": "scene",
    "rotation": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    "translation_mm": [100, -20, 7],
}


def on_bench(point_mm: Vector) -> Vector:
    """A point of the scene for the tracker."""
    x, y, z = point_mm[0] - 100.0, point_mm[1] + 20.0, point_mm[2] - 7.0
    return (y, -x, z)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a run in which the needle measured itself."""
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    assert main([*RUN, "--log", str(path), "--quiet"]) == 0
    return path


def decided(path: Path) -> list[Record]:
    return [record for record in read_log(path).records if record.decided]


def table(log: Path, path: Path, *, rows: int | None = None, force: bool = True) -> None:
    """Writes the measurements of a run as the tracker on the bench would have made them."""
    head = "time_s,bench_x_mm,bench_y_mm,bench_z_mm" + (",force_n" if force else "")
    lines = [
        ",".join(
            map(repr, (one.time_s, *on_bench(one.position_mm), one.force_n)[: 5 if force else 4])
        )
        for one in read_log(log).records
        if isinstance(one, Measured)
    ]
    path.write_text("\n".join([head, *lines[:rows]]) + "\n")


def registration(tmp_path: Path, **changes: Any) -> str:  # noqa: ANN401
    path = tmp_path / "registration.json"
    path.write_text(json.dumps({**REGISTRATION, **changes}))
    return str(path)


def test_a_log_as_a_tracker_leads_to_the_same_decisions(log: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.mcap"
    assert main([*RUN, "--tracker", f"mcap:{log}", "--log", str(again), "--quiet"]) == 0
    assert decided(again) == decided(log)
    assert read_log(again).metadata["tracker"] == f"mcap:{log}"


def test_a_table_in_another_frame_leads_to_the_same_end(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "bench.csv"
    table(log, path)
    options = ["--tracker", f"csv:{path}", "--registration", registration(tmp_path), "--json"]
    assert main([*RUN, *options]) == 0
    found = json.loads(capsys.readouterr().out)
    last = read_log(log).records[-2:]
    assert found["outcome"] == "target reached"
    assert found["depth_mm"] == pytest.approx(max(getattr(r, "depth_mm", 0.0) for r in last))


def test_a_simulated_tracker_on_the_network_leads_to_the_same_end(
    log: Path, tmp_path: Path
) -> None:
    again = tmp_path / "again.mcap"
    options = ["--tracker", "openigtlink+sim", "--log", str(again), "--quiet"]
    assert main([*RUN, *options]) == 0
    first, second = decided(log), decided(again)
    # 32-bit numbers on the way change what is estimated a little, but not what is done.
    commands = [[r for r in run if isinstance(r, Command)] for run in (first, second)]
    assert [(one.kind, pytest.approx(one.value, abs=1e-3)) for one in commands[0]] == [
        (one.kind, one.value) for one in commands[1]
    ]
    assert type(first[-1]) is type(second[-1])


def refused(
    capsys: pytest.CaptureFixture[str], log: Path, code: int, match: str, *options: str
) -> None:
    """The run ends with this code and message, and nothing was moved."""
    assert main([*RUN, "--log", str(log), *options]) == code
    said = capsys.readouterr()
    assert match in said.out + said.err
    if log.exists():
        commands = [one for one in read_log(log).records if isinstance(one, Command)]
        assert {one.kind for one in commands} <= {"stop"}


def test_a_recording_that_is_too_short_is_a_fault(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "short.csv"
    table(log, path, rows=30)
    options = ["--tracker", f"csv:{path}", "--registration", registration(tmp_path)]
    assert main([*RUN, *options]) == 5
    assert "short.csv has ended: it has" in capsys.readouterr().out


def test_a_registration_of_another_place_moves_nothing(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, run = tmp_path / "bench.csv", tmp_path / "new.mcap"
    table(log, path)
    wrong = registration(tmp_path, translation_mm=[100, -20, 70])
    options = ["--tracker", f"csv:{path}", "--registration", wrong]
    refused(capsys, run, 5, "63.0 mm from the entry", *options)


def test_a_tracker_without_force_must_be_accepted(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, run = tmp_path / "bench.csv", tmp_path / "new.mcap"
    table(log, path, force=False)
    options = ["--tracker", f"csv:{path}", "--registration", registration(tmp_path)]
    refused(capsys, run, 2, "measures no force, and the driver watches the force", *options)
    assert not run.exists()
    assert main([*RUN, *options, "--force-sensing", "off", "--quiet"]) in (0, 1, 4, 5, 6)
    assert "measures no force" not in capsys.readouterr().err


def test_wrong_options_cost_no_log(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "new.mcap"
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    live = ["--tracker", f"openigtlink:127.0.0.1:{port}"]
    refused(capsys, run, 5, "connection refused", *live, "--registration", "none")
    refused(capsys, run, 2, "nothing says where the scene lies", *live)
    refused(capsys, run, 2, "there is no tracker 'polaris'", "--tracker", "polaris")
    refused(capsys, run, 2, "--registration is for a tracker", "--registration", "none")
    refused(capsys, run, 2, "in the scene's frame already", "--tracker", f"mcap:{log}",
            "--registration", registration(tmp_path))  # fmt: skip
    named = [f"{live[1]}:TipToReference"]
    refused(capsys, run, 2, "comes in the frame Reference, but the registration is from bench",
            "--tracker", *named, "--registration", registration(tmp_path))  # fmt: skip
    assert not run.exists()


COLUMNS: Columns = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("device", "columns", "match"),
    [
        ("Other", COLUMNS, "does not send the position of 'Needle'; it sends 'Other'"),
        ("Needle", (*COLUMNS[:3], (0.0, 400.0, 0.0)), "400.0 mm from the entry"),
        ("Needle", (*COLUMNS[:3], (float("nan"), 0.0, 0.0)), "not a number"),
        ("Needle", (COLUMNS[0], COLUMNS[1], (0.0, 0.0, -1.0), COLUMNS[3]), "it mirrors"),
        ("Needle", COLUMNS, "heading that is 90 deg from that of the scene"),
    ],
)
def test_a_server_that_sends_something_else_moves_nothing(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    device: str,
    columns: Columns,
    match: str,
) -> None:
    with Server() as server:
        # A sender that sends changes only: the one message waits for the client.
        text = f"openigtlink:127.0.0.1:{server.port}:Needle,sends=changes"

        def send() -> None:
            if server.wait_for_clients(1, 20.0):
                server.send(Packet(device, Transform(columns)))

        sender = threading.Thread(target=send)
        sender.start()
        options = ["--tracker", text, "--registration", "none", "--force-sensing", "off"]
        refused(capsys, tmp_path / "new.mcap", 5, match, *options)
        sender.join()
