"""Devices and trackers of other packages: found, opened, driven, and held to their word."""

from __future__ import annotations

import contextlib
import json
import math
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from ntagen.cli import main
from ntagen.drive.needles import choose
from ntagen.drive.plugin import PluginActuator, Speeds, open_device
from ntagen.errors import DeviceError, Halted, InputError
from ntagen.needle.measurement import Measurement
from ntagen.needle.virtual import Errors
from ntagen.plugins import IDENTITY, Watch, run_watched
from ntagen.tracking.plugin import PluginSource, PluginTracker, open_plugin
from ntagen.tracking.spec import open_tracker, parse_tracker

EXAMPLE = Path(__file__).parents[3] / "examples" / "plugin"
TASK = EXAMPLE.parent / "paper.nsl"

Install = Callable[..., None]


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Installs a package with one module and entry points, as pip would."""
    names = []

    def made(name: str, code: str, devices: str = "", trackers: str = "") -> None:
        names.append(name)
        folder = tmp_path / name
        info = folder / f"{name}-1.2.dist-info"
        info.mkdir(parents=True)
        (folder / f"{name}.py").write_text(code)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
        groups = f"[ntagen.devices]\n{devices}\n[ntagen.trackers]\n{trackers}\n"
        (info / "entry_points.txt").write_text(groups)
        monkeypatch.syspath_prepend(str(folder))

    yield made
    for name in names:
        sys.modules.pop(name, None)


@pytest.fixture
def example(install: Install) -> None:
    install(
        "mystage",
        (EXAMPLE / "mystage.py").read_text(),
        "mystage = mystage:open_stage",
        "mytracker = mystage:open_tracker",
    )


def test_the_example_says_in_its_project_what_the_tests_install() -> None:
    project = (EXAMPLE / "pyproject.toml").read_text()
    assert 'mystage = "mystage:open_stage"' in project
    assert 'mytracker = "mystage:open_tracker"' in project


@pytest.mark.usefixtures("example")
def test_a_plugin_is_a_real_needle_and_a_live_tracker() -> None:
    assert choose("mystage:simulated", Errors()).is_real
    source = parse_tracker("mytracker:simulated")
    assert source == PluginSource("mytracker", "simulated")
    with open_device("mystage", "simulated", Speeds(push_mm_per_s=50.0)) as device:
        calls: list[float] = []
        device.watch = lambda: calls.append(device.now_s())
        device.push(2.0)
        assert len(calls) >= 4
        assert device.ramp_mm_per_s2 == 100.0
        with open_tracker(source, IDENTITY, device.now_s) as tracker:
            assert tracker.measures_force
            assert tracker.measure().position_mm == (0.0, 0.0, 0.0)
    with (
        pytest.raises(InputError, match="where the scene lies"),
        open_tracker(source, None, lambda: 0.0),
    ):
        pass


@pytest.mark.usefixtures("example")
def test_check_prints_what_a_plugin_says_about_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["device", "check", "mystage:simulated"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("mystage:simulated: device of mystage 1.2\n")
    assert "a simulated stage with two axes" in out
    assert out.endswith("nothing was moved\n")
    assert main(["device", "check", "mytracker:simulated", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["plugins"][0]
    assert (found["kind"], found["position_mm"]) == ("tracker", [0.0, 0.0, 0.0])
    assert main(["device", "check", "mystage:elsewhere"]) == 5
    assert "no stage is called 'elsewhere'" in capsys.readouterr().err


@pytest.mark.usefixtures("example")
def test_unknown_names_list_what_is_installed(capsys: pytest.CaptureFixture[str]) -> None:
    for words in (
        ["device", "check", "yours:x"],
        ["device", "test", "yours:x", "--yes"],
        ["drive", str(TASK), "--needle", "yours:x"],
        ["drive", str(TASK), "--tracker", "yours:x"],
    ):
        assert main(words) == 2
        err = capsys.readouterr().err
        assert err.count("hint:") == 1
        assert "(mystage 1.2)" in err


@pytest.mark.usefixtures("example")
def test_a_plugin_needs_a_tracker_to_drive(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["drive", str(TASK), "--needle", "mystage:simulated", "--json"]
    assert main(words) == 2
    assert "nothing measures the needle" in capsys.readouterr().err
    tracker = ["--tracker", "mytracker:simulated", "--registration", "none"]
    assert main([*words, *tracker, "--set", "overrun 0.05 mm"]) == 2
    assert "goes on for 0.08 mm after a stop" in capsys.readouterr().err
    assert main([*words, *tracker, "--timeout", "20s"]) == 6
    assert json.loads(capsys.readouterr().out)["outcome"] == "no strategy in the time left"


LAB = """
import math, threading, time
from contextlib import contextmanager
from dataclasses import replace
from ntagen.needle.virtual import Errors, SimulatedClock, VirtualNeedle
from ntagen.scene import Needle, Pose

ENTRY = Pose((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))

class Lab:
    ramp_mm_per_s2 = 1000.0
    measures_force = True

    def __init__(self, speeds):
        self.watch, self.speeds, self.lock = lambda: None, speeds, threading.Lock()
        needle = Needle(ENTRY, 30.0, speeds.push_mm_per_s)
        self.needle = VirtualNeedle(needle, (), Errors(), 1, SimulatedClock(), reports_pose=True)

    now_s = staticmethod(time.monotonic)

    def _go(self, command, way, speed):
        last, left = time.monotonic(), abs(way)
        while left > 0.0:
            self.watch()
            time.sleep(0.002)
            now = time.monotonic()
            step, last = min(left, speed * (now - last)), now
            left -= step
            command(math.copysign(step, way))

    def push(self, way): self._go(self.needle.push, way, self.speeds.push_mm_per_s)
    def pull(self, way): self._go(self.needle.pull, way, self.speeds.pull_mm_per_s)
    def roll(self, way): self._go(self.needle.roll, way, self.speeds.roll_rad_per_s)
    def stop(self): pass
    def newest(self): return replace(self.needle.measure(), time_s=self.clock())
    measure = newest

LABS = []

@contextmanager
def stage(_, speeds):
    LABS.append(Lab(speeds))
    yield LABS[-1]

@contextmanager
def tracker(_, transform, now_s):
    LABS[-1].clock = now_s
    yield LABS[-1]
"""


@pytest.mark.slow
def test_a_needle_of_plugins_is_steered_to_the_target(
    install: Install, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    install("thelab", LAB, "thelab = thelab:stage", "thelab = thelab:tracker")
    task = tmp_path / "fast.nsl"
    text = TASK.read_text()
    task.write_text(text.replace("speed 1 mm/s", "speed 10 mm/s").replace("step 2 s", "step 0.2 s"))
    settings = "overrun 0.8 mm  roll speed 720 deg/s  force noise 0"
    options = ["--set", settings, "--json"]
    tracker = ["--tracker", "thelab", "--registration", "none"]
    assert main(["drive", str(task), "--needle", "thelab:x", *tracker, *options]) == 0
    assert json.loads(capsys.readouterr().out)["outcome"] == "target reached"


BROKEN = {
    "import nowhere_at_all": "ModuleNotFoundError: No module named 'nowhere_at_all'",
    "open_it = 3": "is no factory",
    "other = 3": "AttributeError",
    "raise SystemExit(7)": "SystemExit: 7",
    "def open_it(): pass": "TypeError",
    "def open_it(*_): return None": "which is no context manager",
    "def open_it(*_): raise ValueError('no\\nlicence')": "ValueError: no licence",
    "from contextlib import nullcontext\ndef open_it(*_): return nullcontext(3)": "has no now_s",
    "from contextlib import contextmanager\n@contextmanager\ndef open_it(*_):\n  if 0: yield": (
        "didn't yield"
    ),
}


@pytest.mark.parametrize("code", BROKEN)
def test_a_broken_plugin_gives_one_message_with_its_name(
    code: str, install: Install, capsys: pytest.CaptureFixture[str]
) -> None:
    install("broken", code, "bad = broken:open_it", "")
    assert main(["device", "check", "bad:x"]) == 5
    out, err = capsys.readouterr()
    assert out == ""
    assert "the plugin 'bad'" in err
    assert BROKEN[code] in err
    assert "Traceback" not in err
    assert err.count("hint:") == 1


def test_two_plugins_of_one_name_are_refused(install: Install) -> None:
    for package in ("one", "two"):
        install(package, "", f"same = {package}:open_it")
    with (
        pytest.raises(InputError, match=r"(one 1.2 and two|two 1.2 and one) 1.2"),
        open_device("same", "", Speeds()),
    ):
        pass


def test_an_error_while_a_plugin_is_closed_hides_no_earlier_one(install: Install) -> None:
    code = """
from types import SimpleNamespace as N
from contextlib import contextmanager
@contextmanager
def open_it(*_):
    try:
        yield N(now_s=lambda: 0.0, push=abs, roll=abs, pull=abs, stop=int)
    finally:
        raise OSError("it is stuck")
"""
    install("stuck", code, "stuck = stuck:open_it")

    def use(error: Exception | None) -> None:
        with open_device("stuck", "", Speeds()):
            if error is not None:
                raise error

    with pytest.raises(DeviceError, match="failed to be closed: OSError: it is stuck"):
        use(None)
    with pytest.raises(DeviceError, match="the first"):
        use(DeviceError("the first"))


class Inner:
    """A device whose push does what a test wants."""

    def __init__(self, push: Callable[[Inner], object]) -> None:
        self.watch: Watch = lambda: None
        self.stops = 0
        self.times = [0.5]
        self._push = push

    def now_s(self) -> float:
        return self.times.pop(0)

    def push(self, _: float) -> None:
        self._push(self)

    roll = pull = push

    def stop(self) -> None:
        self.stops += 1


def around(push: Callable[[Inner], object]) -> tuple[PluginActuator, Inner]:
    inner = Inner(push)
    return PluginActuator("it", inner), inner


def swallow(inner: Inner) -> None:
    with contextlib.suppress(BaseException):
        inner.watch()


def replace(inner: Inner) -> None:
    try:
        inner.watch()
    except BaseException:
        raise ValueError("something else") from None


def pass_on(inner: Inner) -> None:
    try:
        inner.watch()
    except Halted as halted:
        halted.part = 0.25
        raise


@pytest.mark.parametrize("error", [DeviceError("stale"), KeyboardInterrupt(), OSError("own")])
@pytest.mark.parametrize("push", [swallow, replace, pass_on])
def test_what_the_watch_raises_reaches_the_driver_whatever_a_plugin_does(
    error: BaseException, push: Callable[[Inner], object]
) -> None:
    device, inner = around(push)

    def watch() -> None:
        raise error

    device.watch = watch
    with pytest.raises(type(error)) as raised:
        device.push(1.0)
    assert raised.value is error
    assert inner.stops == (0 if push is pass_on else 1)


def test_a_halted_motion_without_a_part_is_a_fault() -> None:
    def watch() -> None:
        raise Halted("the force")

    device, _ = around(pass_on)
    device.watch = watch
    with pytest.raises(Halted) as raised:
        device.push(1.0)
    assert raised.value.part == 0.25
    for push in (swallow, replace):
        device, inner = around(push)
        device.watch = watch
        with pytest.raises(DeviceError, match="nobody knows how far"):
            device.push(1.0)
        assert inner.stops == 1

    def wrong(inner: Inner) -> None:
        try:
            inner.watch()
        except Halted as halted:
            halted.part = math.nan
            raise

    device, _ = around(wrong)
    device.watch = watch
    with pytest.raises(DeviceError, match="nan of the motion"):
        device.push(1.0)


@pytest.mark.slow
@pytest.mark.parametrize("error", [None, OSError("stopped")])
def test_a_device_that_does_not_call_its_watch_is_stopped(error: Exception | None) -> None:
    class Deaf(Inner):
        stopped = threading.Event()

        def stop(self) -> None:
            super().stop()
            self.stopped.set()

    def push(inner: Inner) -> None:
        assert isinstance(inner, Deaf)
        assert inner.stopped.wait(20.0)
        if error is not None:
            raise error

    inner = Deaf(push)
    inner.stopped.clear()
    device = PluginActuator("it", inner)
    with pytest.raises(DeviceError, match="did not call its watch for 1 s"):
        device.push(1.0)
    assert inner.stops == 1


def test_impossible_commands_never_reach_a_plugin() -> None:
    device, _ = around(lambda _: pytest.fail("it was pushed"))
    for value in (-1.0, math.nan, math.inf):
        with pytest.raises(DeviceError, match="refuses to push"):
            device.push(value)
    with pytest.raises(DeviceError, match="refuses to roll"):
        device.roll(math.nan)


def test_a_clock_that_goes_back_is_a_fault() -> None:
    device, inner = around(lambda _: None)
    # It counts from when it was opened.
    inner.times = [1.0, 2.0, 1.5]
    assert [device.now_s(), device.now_s()] == [0.5, 1.5]
    with pytest.raises(DeviceError, match=r"it is 1.5 s, after 2.0 s"):
        device.now_s()


@pytest.mark.parametrize("gives", [None, Measurement(0.0, (math.nan, 0.0, 0.0), 0.0), OSError()])
def test_a_tracker_that_gives_no_measurement_is_a_fault(gives: object) -> None:
    class Sensor:
        measures_force = False

        def measure(self) -> object:
            if isinstance(gives, Exception):
                raise gives
            return gives

        newest = measure

    tracker = PluginTracker("it", Sensor())
    for look in (tracker.measure, tracker.newest):
        with pytest.raises(DeviceError, match="the plugin 'it'"):
            look()
    with pytest.raises(InputError), open_plugin(PluginSource("it", ""), IDENTITY, lambda: 0.0):
        pass


def test_a_blocking_call_is_watched_and_stopped() -> None:
    stopped = threading.Event()
    calls: list[int] = []

    def watch() -> None:
        calls.append(1)
        if len(calls) == 5:
            raise Halted("enough")

    with pytest.raises(Halted) as raised:
        run_watched(stopped.wait, watch, stopped.set, lambda: 0.5)
    assert raised.value.part == 0.5
    assert len(calls) == 5
    with pytest.raises(ZeroDivisionError):
        run_watched(lambda: 1 / 0, lambda: None, stopped.set)
    with pytest.raises(DeviceError, match="did not end within"):
        run_watched(threading.Event().wait, watch_once(), lambda: None, end_s=0.05)
    with pytest.raises(Halted):
        run_watched(lambda: pytest.fail("it moved"), watch_once(0), lambda: None)


def watch_once(passes: int = 1) -> Watch:
    """A watch that raises after some calls."""
    left = [None] * passes

    def watch() -> None:
        if not left:
            raise Halted("of a test")
        left.pop()

    return watch
