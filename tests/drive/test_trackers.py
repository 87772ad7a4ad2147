"""Runs in which something else than the needle measures it."""

from __future__ import annotations

import json
import math
import re
import socket
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ntagen.cli import main
from ntagen.drive.device import Device
from ntagen.drive.reading import read_log
from ntagen.drive.records import Command, Measured, Record
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate, synthesiser_for
from ntagen.drive.states import State
from ntagen.needle.measurement import Measurement
from ntagen.needle.virtual import Errors, Obstacle, SimulatedClock, VirtualNeedle
from ntagen.nsl import load
from ntagen.openigtlink.messages import Columns, Freedom, Position, Tool, TrackingData, Transform
from ntagen.openigtlink.packets import Packet
from ntagen.openigtlink.samples import Policy
from ntagen.openigtlink.server import Server
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Needle, Scene, Vector
from ntagen.tracking import frames
from ntagen.tracking.live import LiveTracker, Source
from ntagen.tracking.mount import Mount
from ntagen.tracking.plausible import Plausible
from ntagen.tracking.simulated import NEEDLE, SimulatedTracker
from tests.faults.connections import drop_clients

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


@pytest.mark.slow
@pytest.mark.parametrize("needle", ["phantom", "grbl+sim"])
def test_other_needles_are_measured_by_the_network_too(tmp_path: Path, needle: str) -> None:
    runs = []
    for name, options in (("direct", []), ("network", ["--tracker", "openigtlink+sim"])):
        path = tmp_path / f"{name}.mcap"
        words = ["drive", PAPER, "--needle", needle, "--seed", "3", "--log", str(path), "--quiet"]
        assert main([*words, *options]) == 0
        runs.append([one for one in read_log(path).records if isinstance(one, Command)])
    assert len(runs[0]) == len(runs[1])
    for one, other in zip(*runs, strict=True):
        assert (one.kind, one.value) == (other.kind, pytest.approx(other.value, abs=1e-2))


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
    assert main([*RUN, *options, "--set", "force sensing off", "--quiet"]) in (0, 1, 4, 5, 6)
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
        options = ["--tracker", text, "--registration", "none", "--set", "force sensing off"]
        refused(capsys, tmp_path / "new.mcap", 5, match, *options)
        sender.join()


# A whole path: tool, tracker's frame, network, registration.


class Bench:
    """A tracker of five degrees of freedom on a bench, which sees a tool behind the needle's tip.

    The tool's z axis points backwards. Its roll about the needle is chance, as for such trackers.
    """

    TIP_MM = (0.0, 0.0, -120.0)

    def __init__(self, needle: Device, transform: frames.Transform) -> None:
        self._needle = needle
        self._server = Server()
        self._inverse = np.array(transform.rotation).T
        self._shift = np.array(transform.translation_mm)
        self._random = np.random.default_rng(4)
        mount = Mount("-z", tip_mm=self.TIP_MM)
        source = Source("127.0.0.1", self._server.port, "Needle", mount, policy=Policy(stale_s=9.0))
        self._tracker = LiveTracker(source, transform, needle.now_s)
        assert self._server.wait_for_clients(1, 20.0)

    def measure(self) -> Measurement:
        found = self._needle.measure()
        assert found.heading is not None
        z = -self._inverse @ found.heading
        across = self._random.normal(size=3)
        x = across - (across @ z) * z
        x /= np.linalg.norm(x)
        origin = self._inverse @ (np.array(found.position_mm) - self._shift) - self.TIP_MM[2] * z
        x, y, z, origin = (tuple(map(float, one)) for one in (x, np.cross(z, x), z, origin))
        asked_s = self._tracker.client.now_s()
        tool = Tool("Needle", Freedom.HEADING, (x, y, z, origin))
        self._server.send(Packet("Tracker", TrackingData((tool,))))
        return self._tracker.measure_after(asked_s)

    def close(self) -> None:
        self._tracker.close()
        self._server.close()


def test_a_tool_behind_the_tip_in_another_frame_steers_as_the_needle_itself() -> None:
    scene = load(PAPER)
    settings = Settings()
    turn = Rotation.from_euler("xyz", [0.4, -1.1, 2.5]).as_matrix()
    x, y, z = (tuple(map(float, row)) for row in turn)
    transform = frames.Transform("bench", "scene", (x, y, z), (300.0, -45.0, 812.0))
    benches: list[Bench] = []

    def sense(needle: Device) -> Plausible:
        benches.append(Bench(needle, transform))
        return Plausible(benches[0], scene.needle.tip)

    def make(needle: Needle, obstacles: tuple[Obstacle, ...], seed: int) -> VirtualNeedle:
        return VirtualNeedle(needle, obstacles, Errors(), seed, SimulatedClock(), reports_pose=True)

    journals = Kept(), Kept()
    synthesise = synthesiser_for(settings)
    direct = simulate(scene, synthesise, settings, journals[0], make=make)
    try:
        tracked = simulate(scene, synthesise, settings, journals[1], make=make, sense=sense)
    finally:
        benches[0].close()
    assert tracked.ended.outcome == direct.ended.outcome == State.TARGET_REACHED.value
    commands = [[r for r in one.records if isinstance(r, Command)] for one in journals]
    assert len(commands[0]) == len(commands[1])
    for one, other in zip(*commands, strict=True):
        assert (one.kind, one.value) == (other.kind, pytest.approx(other.value, abs=1e-3))
    seen = [[r for r in one.records if isinstance(r, Measured)] for one in journals]
    for one, other in zip(*seen, strict=True):
        assert math.dist(one.position_mm, other.position_mm) < 1e-3
        assert math.dist(one.heading, other.heading) < 1e-5
        assert other.bevel == ()


# What goes wrong in the middle of a run.


class Failing:
    """A tracker on the network of this machine that goes wrong at one of its measurements."""

    def __init__(self, needle: Device, at: int, fault: str) -> None:
        self._needle = needle
        self._left = at
        self._fault = fault
        policy = Policy(stale_s=0.3, first_delay_s=0.01)
        self.tracker = SimulatedTracker(self, needle.now_s, policy=policy)
        self._send = self.tracker.server.send
        self.tracker.server.send = self._sent  # type: ignore[method-assign]

    def measure(self) -> Measurement:
        return self._needle.measure()

    def _sent(self, *packets: Packet) -> None:
        self._left -= 1
        if self._left >= 0:
            self._send(*packets)
            return
        force, pose = packets
        data = bytearray(pose.to_bytes())
        data[-1] ^= 1
        mirrored = ((-1.0, 0.0, 0.0), *COLUMNS[1:])
        match self._fault:
            case "vanishes":
                self.tracker.server.close()
            case "hangs up":
                drop_clients(self.tracker.server)
            case "wrong checksums":
                self.tracker.server.send_bytes(bytes(data))
            case "no number":
                self._send(force, Packet(NEEDLE, Position((math.nan, 0.0, 0.0))))
            case "jump":
                self._send(force, Packet(NEEDLE, Position((0.0, 300.0, 0.0))))
            case "mirrored":
                self._send(force, Packet(NEEDLE, Transform(mirrored)))
            case "another name":
                self._send(force, Packet("Stylus", pose.content))
            case "garbage":
                self.tracker.server.send_bytes(b"GET / HTTP/1.1\r\n" * 10)


FAULTS = {
    "vanishes": "has closed the connection|is lost|is stale",
    "hangs up": "has closed the connection|is lost|nothing of use|is stale",
    "silent": "is stale",
    "wrong checksums": "is stale",
    "no number": "not a number",
    "jump": "jumped by",
    "mirrored": "it mirrors",
    "another name": "is stale",
    "garbage": "this is not OpenIGTLink|has closed|is lost|nothing of use",
}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("at", [1, 12])
def test_a_tracker_that_fails_stops_the_needle(fault: str, at: int) -> None:
    scene = load(PAPER)
    settings = Settings()
    journal = Kept()
    failing: list[Failing] = []

    def sense(needle: Device) -> Plausible:
        failing.append(Failing(needle, at, fault))
        return Plausible(failing[0].tracker, scene.needle.tip)

    try:
        result = simulate(scene, synthesiser_for(settings), settings, journal, sense=sense)
    finally:
        failing[0].tracker.__exit__()
    assert result.ended.outcome == State.FAULTED.value
    assert re.search(FAULTS[fault], result.ended.reason), result.ended.reason
    assert result.clearance_mm > 0.0
    kinds = [type(record) for record in journal.records]
    last = len(kinds) - 1 - kinds[::-1].index(Measured)
    # At most the motion after which nothing was measured, and then the stop.
    after = [one.kind for one in journal.records[last:] if isinstance(one, Command)]
    assert after[-1] == "stop"
    assert len([kind for kind in after if kind != "stop"]) <= 2
    assert kinds.count(Measured) == at


class Kept:
    """A journal that keeps the records."""

    def __init__(self) -> None:
        self.records: list[Record] = []

    def record(self, record: Record) -> None:
        self.records.append(record)

    def started(self, scene: Scene) -> None:
        pass

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        pass


def test_a_tracker_in_the_task_counts_where_a_registration_is_given(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    task = tmp_path / "task.nsl"
    words = f'  tracker openigtlink "127.0.0.1:{port}" "Needle"\n}}\n'
    task.write_text(Path(PAPER).read_text().rstrip().removesuffix("}") + words)
    assert main(["drive", str(task), "--quiet"]) == 0
    assert main(["drive", str(task), "--quiet", "--registration", "none"]) == 5
    assert f"127.0.0.1:{port}: connection refused" in capsys.readouterr().err
