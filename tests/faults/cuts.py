"""A run that is cut off at a random moment, and the run that goes on from its log.

The needle stands behind an emulated controller on a simulated clock, and both survive the driver.
The log is what the driver had acknowledged when it died; where its computer lost its power, the
last seconds of that are missing. `ntagen.drive` knows nothing of this.
"""

from __future__ import annotations

import random
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ntagen.drive.configure import configure
from ntagen.drive.knowledge import told
from ntagen.drive.log import EARLIER, RESUMES, Log, metadata_of
from ntagen.drive.operator import Operator
from ntagen.drive.past import depth_mm, legs_of
from ntagen.drive.plant import simulated_axes
from ntagen.drive.reading import read_log
from ntagen.drive.real import RealRun
from ntagen.drive.records import Answered, Ended, Found, Journals, Record
from ntagen.drive.replay import replay
from ntagen.drive.shells import sensing_margin_mm
from ntagen.drive.simulate import synthesiser_for
from ntagen.drive.states import State
from ntagen.drive.stepped import Stepped
from ntagen.errors import DeviceError, InputError
from ntagen.grbl.actuator import GrblActuator
from ntagen.grbl.emulator import SimulatedPort
from ntagen.needle.measurement import Measurement
from ntagen.needle.phantom import PhantomNeedle
from ntagen.needle.virtual import Obstacle, VirtualNeedle
from ntagen.nsl import load
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene
from ntagen.tracking.plausible import LivePlausible
from tests.drive.runs import Diary
from tests.faults.connections import pull_cable
from tests.faults.runs import EXAMPLES, NEEDLES, SCENES, STILL, nearest_mm

LATEST_S = 45.0
"""A cut comes within this time; most runs take as long."""

_LOST_S = 15.0
"""At most so much of a log is not on the disk when the power fails."""

_SAMPLE_S = 0.05

_DEPTH_MM = 1.0
"""A driver that goes on must know the depth this well."""

_REFUSES_GO_ON = 0.1
"""This share of the operators wants the needle back although the driver could go on."""

_REPLAYED = 0.1
"""This share of the runs that went on is decided again."""


_OVER = frozenset({State.TARGET_REACHED.value, State.PULLED_OUT.value})


class _Death(BaseException):
    """The process of the driver is no more."""


@dataclass
class Trial:
    """What a run that went on came to.

    Attributes:
        cut: How the run before was cut off.
        outcome: How it ended, or why it did not begin.
        reason: The same in words.
        wrong: What must not have been.
    """

    cut: str
    outcome: str = ""
    reason: str = ""
    wrong: list[str] = field(default_factory=list)


class _Diary(Diary):
    """A diary that knows how long the log was at each moment."""

    def __init__(self, patient: Patient, path: Path) -> None:
        super().__init__()
        self._patient = patient
        self._path = path
        self.lengths: list[tuple[float, int]] = []

    def record(self, record: Record) -> None:
        super().record(record)
        now_s = self._patient.now_s()
        self.lengths.append((now_s, self._path.stat().st_size))


class Patient:
    """A needle in tissue, with its controller and its sensors.

    Args:
        scene: The actual scene.
        needle: ``virtual`` or ``phantom``.
        known: The critical regions that drivers know.
        seed: The seed of the needle.
    """

    measures_force = True

    def __init__(self, scene: Scene, needle: str, known: str, seed: int) -> None:
        self.scene, self.known = scene, known
        self.configuration = configure((), scene, known, needle)
        settings, make = self.configuration.settings, self.configuration.needle.make
        assert make is not None
        margin_mm = settings.sensing_margin_mm
        obstacles = tuple(
            Obstacle(one, sensing_margin_mm(one, scene.detections, margin_mm))
            for one in scene.criticals
        )
        speed_mm_per_s = scene.needle.speed_mm_per_s
        self.device = Stepped(make(scene.needle, obstacles, seed), speed_mm_per_s)
        self.is_hidden = False
        self.lost_position = False
        self._sample: Measurement | None = None
        self._sampled_s = 0.0

    def now_s(self) -> float:
        """The time on the clock of the controller, which goes on without a driver."""
        return self.device.emulator.now_s

    def rest(self, seconds: float) -> None:
        """Lets time pass."""
        self.device.emulator.advance(self.now_s() + seconds)

    def measure(self) -> Measurement:
        """A reading."""
        if self.is_hidden:
            raise DeviceError("the tracker does not see the needle")
        return self.device.measure()

    def newest(self) -> Measurement:
        """The newest sample of a tracker that makes twenty a second."""
        if self._sample is None or self.now_s() > self._sampled_s + _SAMPLE_S or self.is_hidden:
            self._sample, self._sampled_s = self.measure(), self.now_s()
        return self._sample

    @property
    def true_depth_mm(self) -> float:
        """How deep the needle is."""
        self.device._settle()
        needle = self.device._needle
        if isinstance(needle, PhantomNeedle):
            return needle._depth_mm
        assert isinstance(needle, VirtualNeedle)
        return needle._path.depth_mm


class Driver:
    """A driver of a patient, as a process that can die.

    Args:
        patient: The patient.
        path: Where it writes its log.
        earlier: The log from which it goes on.
        draw: What is drawn.
    """

    def __init__(
        self, patient: Patient, path: Path, earlier: Path | None, draw: random.Random
    ) -> None:
        self._patient, self._earlier, self._draw = patient, earlier, draw
        self.asked_mm = 0.0
        self.path = path
        self.operator = Operator()
        self.port = SimulatedPort(patient.device.emulator)
        self.diary = _Diary(patient, path)
        self.wrong: list[str] = []
        self.acknowledged = b""
        self.is_dead = False

    def run(self) -> Ended:
        """Drives."""
        patient, settings = self._patient, self._patient.configuration.settings
        begins_at = patient.device.emulator.position
        inner = synthesiser_for(settings, self.operator.listen)

        def synthesise(scene: Scene, asked: Scene | None = None) -> Synthesis:
            return inner(scene, asked)

        def ask(question: str) -> bool:
            patient.rest(self._draw.choice([1.0, 20.0, 300.0]))
            if patient.device.emulator.position != begins_at:
                self.wrong.append("something moved before the question")
            self.asked_mm = patient.true_depth_mm
            back = "pulled back" in question
            return back or self._draw.random() >= _REFUSES_GO_ON

        axes = simulated_axes(patient.scene.needle.speed_mm_per_s)
        actuator = GrblActuator(self.port, axes)
        log_before = None if self._earlier is None else read_log(self._earlier)
        legs = () if log_before is None else legs_of(log_before)
        entry = None if legs else patient.scene.needle.tip
        is_noisy = patient.configuration.needle.parameters is not None
        sensor = LivePlausible(patient, entry, actuator.now_s, force_varies=is_noisy)
        metadata: dict[str, object] = {"settings": settings.to_json()}
        attachments = {}
        if log_before is not None:
            metadata[RESUMES] = {"file": log_before.path.name, "sha256": log_before.sha256}
            attachments[EARLIER] = log_before.path.read_bytes()
        with Log(self.path, metadata_of(metadata), attachments) as log:
            driven = RealRun(
                patient.scene,
                actuator,
                sensor,
                synthesise,
                settings,
                Journals(log, self.diary),
                known=patient.known,
                listen=self.operator.listen,
                legs=legs,
                ask=ask,
            ).drive()
        return driven.ended

    def die(self) -> None:
        """The process is killed: it writes nothing any more, neither to the log nor on the wire."""
        self.acknowledged = self.path.read_bytes() if self.path.exists() else b""
        self.port.write = lambda data: None  # type: ignore[method-assign]
        self.is_dead = True
        raise _Death


Cut = Callable[[Patient, Driver, random.Random], None]


def _kill(_: Patient, driver: Driver, __: random.Random) -> None:
    driver.die()


def _stop(_: Patient, driver: Driver, draw: random.Random) -> None:
    driver.operator.end(draw.choice(["interrupted by the operator", "ended by the system"]))


def _hide(patient: Patient, _: Driver, __: random.Random) -> None:
    patient.is_hidden = True


def _unplug(_: Patient, driver: Driver, __: random.Random) -> None:
    pull_cable(driver.port)


def _reset(patient: Patient, _: Driver, __: random.Random) -> None:
    patient.device.emulator.feed(b"\x18")


def _lose_power(patient: Patient, driver: Driver, _: random.Random) -> None:
    patient.device.emulator.power_on()
    patient.lost_position = True
    driver.die()


CUTS: dict[str, Cut] = {
    "kill": _kill,
    "power of the computer": _kill,
    "power of all": _lose_power,
    "stop": _stop,
    "tracker lost": _hide,
    "cable pulled": _unplug,
    "controller reset": _reset,
    "kill, then pulled by jogs": _kill,
    "kill, and again": _kill,
}
"""The ways in which a run is cut off."""


def attempt(cut: str, seed: int) -> Trial:
    """Cuts a run off at a random moment, goes on from its log, and looks at what came of it."""
    draw = random.Random(f"{cut} {seed}")
    scene = load(EXAMPLES / f"{draw.choice(SCENES)}.nsl")
    needle, known = draw.choice(NEEDLES), draw.choice(["all", "all", "none"])
    patient = Patient(scene, needle, known, seed)
    trial = Trial(cut)
    with tempfile.TemporaryDirectory() as folder:
        path: Path | None = None
        for number in range(2 if cut == "kill, and again" else 1):
            if number and not _can_go_on(trial, path):
                break
            driver = Driver(patient, Path(folder) / f"{number}.mcap", path, draw)
            path = _cut_off(cut, patient, driver, draw)
            trial.wrong += driver.wrong
        if _can_go_on(trial, path):
            _go_on(trial, patient, Driver(patient, Path(folder) / "last.mcap", path, draw), draw)
    for region in told(scene, known).criticals:
        away_mm = nearest_mm(patient.device.pierced, region)
        if away_mm <= 0.0:
            trial.wrong.append(f"{region.name} was pierced: {away_mm:.2f} mm")
    return trial


def _cut_off(cut: str, patient: Patient, driver: Driver, draw: random.Random) -> Path:
    """Drives until the cut; returns the log."""
    strike, at_s = CUTS[cut], draw.uniform(0.0, LATEST_S)
    is_over = False

    def struck() -> None:
        if not is_over:
            strike(patient, driver, draw)

    patient.device.emulator.after(at_s, struck)
    try:
        driver.run()
    except BaseException as error:
        # Whatever a dead process does is not done; and a cable may be pulled before there is a log.
        if not driver.is_dead and (driver.path.exists() or not isinstance(error, DeviceError)):
            raise
    is_over = True
    data = driver.acknowledged
    if not driver.is_dead and driver.path.exists():
        data = driver.path.read_bytes()
    if cut.startswith("power of"):
        data = _less(data, driver.diary.lengths, draw.uniform(0.0, _LOST_S))
    driver.path.write_bytes(data)
    # The controller ends the piece that it has.
    patient.rest(draw.choice([6.0, 60.0, 3000.0]))
    patient.is_hidden = False
    _after(cut, patient, draw)
    return driver.path


def _less(data: bytes, lengths: Sequence[tuple[float, int]], lost_s: float) -> bytes:
    """A log without the last seconds, perhaps in the middle of a record."""
    if not lengths:
        return data
    at_s = lengths[-1][0] - lost_s
    kept = [length for time_s, length in lengths if time_s <= at_s]
    return data[: (kept[-1] if kept else lengths[0][1]) + 7]


def _after(cut: str, patient: Patient, draw: random.Random) -> None:
    """What somebody does before the run goes on."""
    emulator = patient.device.emulator
    if cut == "controller reset":
        emulator.feed(b"\x18")
        patient.rest(5.0)
        emulator.feed(b"$X\n")
        patient.rest(1.0)
    if cut == "kill, then pulled by jogs":
        back_mm = draw.uniform(1.0, 12.0)
        emulator.feed(f"$J=G91 G21 X-{back_mm:.3f} F300\n".encode())
        patient.rest(20.0)
    emulator.take()


def _can_go_on(trial: Trial, path: Path | None) -> bool:
    """Whether a log is one from which a run can go on, as `ntagen drive --resume` looks at it."""
    assert path is not None
    try:
        legs = legs_of(read_log(path))
    except InputError:
        trial.outcome = "no log"
        return False
    ended = legs[-1].ended
    pending = [leg.pending for leg in legs if leg.pending is not None]
    if ended is not None and ended.outcome in _OVER:
        trial.outcome = "over before the cut"
        return False
    if depth_mm(legs) <= 0.0 and not any(one.kind == "push" for one in pending):
        trial.outcome = "not inserted by its log"
        return False
    return True


def _go_on(trial: Trial, patient: Patient, driver: Driver, draw: random.Random) -> None:
    """Goes on from a log."""
    try:
        last = driver.run()
    except (DeviceError, InputError) as error:
        trial.outcome, trial.reason = "not begun", str(error)
    else:
        trial.outcome, trial.reason = last.outcome, last.reason
    trial.wrong += driver.wrong
    _examine(trial, patient, driver)
    if trial.outcome != "not begun" and draw.random() < _REPLAYED:
        settings = patient.configuration.settings
        again = replay(read_log(driver.path), synthesiser_for(settings))
        if not (again.is_same and again.complete):
            trial.wrong.append(f"decided again, it is another run: {again}")


def _examine(trial: Trial, patient: Patient, driver: Driver) -> None:
    wrong, diary = trial.wrong, driver.diary
    found = next(iter(diary.of(Found)), None)
    went_on = any(one.agrees and "go on" in one.question for one in diary.of(Answered))
    agreed = any(one.agrees for one in diary.of(Answered))
    if trial.outcome == State.FAULTED.value and not agreed:
        trial.outcome = "refused"
    if found is not None and went_on:
        if found.lack:
            wrong.append(f"it went on although {found.lack}")
        if abs(found.depth_mm - driver.asked_mm) > _DEPTH_MM:
            wrong.append(f"it found {found.depth_mm:.2f} mm, and was {driver.asked_mm:.2f} mm deep")
    if found is not None and found.lack:
        trial.reason = found.lack
    if went_on and patient.lost_position:
        wrong.append("it went on after the controller had lost its position")
    if trial.outcome == State.TARGET_REACHED.value:
        outside_mm = patient.scene.targets[-1].distance_mm(patient.device.true_tip.position_mm)
        if outside_mm > 0.0:
            wrong.append(f"the tip is {outside_mm:.2f} mm outside of the target")
    if trial.outcome == State.PULLED_OUT.value and patient.true_depth_mm > _DEPTH_MM:
        wrong.append(f"the needle is {patient.true_depth_mm:.2f} mm deep after it was pulled out")
    before = patient.device.emulator.position
    patient.rest(20.0)
    if any(
        abs(a - b) > STILL for a, b in zip(before, patient.device.emulator.position, strict=True)
    ):
        wrong.append("something moved after the end")
