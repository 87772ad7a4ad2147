"""One run with one fault, and what must be true of it."""

from __future__ import annotations

import math
import random
import re
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

from ntagen.drive.knowledge import told
from ntagen.drive.outcome import Driven
from ntagen.drive.reading import read_log
from ntagen.drive.records import Command, Ended, Transition
from ntagen.drive.replay import replay
from ntagen.drive.simulate import synthesiser_for
from ntagen.needle.kinematics import Arc
from ntagen.nsl import load
from ntagen.scene import Region, Vector
from tests.faults.catalogue import Fault
from tests.faults.rig import Rig

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SCENES = ("paper", "scenarios/small_mid_cr", "scenarios/surface_crs", "scenarios/tunnel_crs")
NEEDLES = ("virtual", "phantom")

OVER = "over before the fault"
"""The outcome of a run that had ended when the fault came."""

LATEST_S = 50.0
"""A fault strikes before this time; most runs take as long."""

LOGGED = 0.1
"""This share of the runs is logged and decided again; the others keep their records in memory."""

STEP_MM = 2.0
"""A step of the model: the needle must not go deeper by more after a fault."""

PULLED_MM = 5.01
"""The longest motion back, in the open channel, that the program leaves to the controller."""

STILL = 1e-6
_SPACING_MM = 0.02
_GRACE_S = 0.2
"""A fault in the last moment of a run finds nothing left to do."""


@dataclass
class Finding:
    """What a run came to.

    Attributes:
        outcome: How it ended.
        wrong: What must not have been.
        deeper_mm: How far the axes went deeper after the fault was there.
        late_s: How long after the fault the run ended.
    """

    outcome: str
    wrong: list[str] = field(default_factory=list)
    deeper_mm: float = 0.0
    late_s: float = 0.0


def run(fault: Fault, needle: str, seed: int) -> Finding:
    """Makes the run of a seed with a fault at a random moment, and looks at it."""
    draw = random.Random(f"{fault.name} {needle} {seed}")
    scene = load(EXAMPLES / f"{draw.choice(SCENES)}.nsl")
    known = draw.choice(["all", "all", "none"])
    with tempfile.TemporaryDirectory() as folder:
        watched, is_logged = draw.random() < 0.5, draw.random() < LOGGED
        its_folder = Path(folder) if fault.needs_log or is_logged else None
        rig = Rig(scene, needle, known, seed, watched=watched, folder=its_folder)
        return _Examined(fault, rig, draw).finding


class _Examined:
    """A run that was made, and everything that is wrong about it."""

    def __init__(self, fault: Fault, rig: Rig, draw: random.Random) -> None:
        self._fault, self._rig = fault, rig
        self.finding = Finding("")
        result, error = self._drive(draw)
        self.finding.outcome = self._outcome(result, error)
        self._require_end(result, error)
        self._require_way()
        self._require_clear()
        if result is not None:
            self._require_story(result)
        self._require_stillness()

    def _drive(self, draw: random.Random) -> tuple[Driven | None, BaseException | None]:
        fault = self._fault
        number, at_s = draw.randint(1, 3), draw.uniform(0.0, LATEST_S)

        def prepare(rig: Rig) -> None:
            def strike() -> None:
                rig.strike()
                fault.strike(rig, draw)

            def in_synthesis() -> None:
                if rig.syntheses == number:
                    strike()

            if fault.in_synthesis:
                rig.before_synthesis = in_synthesis
            else:
                rig.emulator.after(at_s, strike)

        try:
            return self._rig.drive(prepare), None
        except BaseException as error:
            if fault.raises is not None and isinstance(error, fault.raises):
                return None, error
            self._wrong(f"the run raised {error!r}")
            return None, error

    def _wrong(self, what: str) -> None:
        self.finding.wrong.append(what)

    def _outcome(self, result: Driven | None, error: BaseException | None) -> str:
        if not self._rig.is_struck:
            return OVER
        return result.ended.outcome if result else type(error).__name__

    def _require_end(self, result: Driven | None, error: BaseException | None) -> None:
        fault, rig = self._fault, self._rig
        if not rig.is_struck:
            return
        self.finding.late_s = rig.emulator.now_s - rig.struck_s
        if result is None:
            return
        if fault.raises is not None:
            self._wrong(f"nothing was raised: {result.ended}")
        if fault.outcome is None or self._is_over():
            return
        ended = result.ended
        if ended.outcome != fault.outcome.value:
            self._wrong(f"the run ended as '{ended.outcome}': {ended.reason}")
        elif not re.search(fault.words, ended.reason):
            self._wrong(f"the reason has other words: {ended.reason}")

    def _is_over(self) -> bool:
        """Whether the fault came when nothing was left to do."""
        ended = self._rig.ended
        if ended is None:
            return False
        return self._rig.struck_s > ended.time_s - self._rig.clock_offset_s - _GRACE_S

    def _require_way(self) -> None:
        """The axes must not go on after a fault that is noticed at once."""
        fault, rig = self._fault, self._rig
        if not rig.is_struck or fault.hides_motion:
            return
        way_mm = rig.emulator.position[0] - rig.struck_mm
        self.finding.deeper_mm = max(0.0, way_mm)
        if (fault.outcome or fault.raises) and not -PULLED_MM <= way_mm <= STEP_MM:
            self._wrong(f"the needle went on for {way_mm:.2f} mm")

    def _require_clear(self) -> None:
        """No region that the driver knew at the start is pierced, by arithmetic of our own."""
        rig = self._rig
        for region in told(rig.scene, rig.known).criticals:
            distance_mm = nearest_mm(rig.device.pierced, region)
            if distance_mm <= 0.0:
                self._wrong(f"{region.name} was pierced: {distance_mm:.2f} mm")

    def _require_story(self, result: Driven) -> None:
        """The records must say what happened, and end with it."""
        records = self._rig.diary.records
        ends = [i for i, record in enumerate(records) if isinstance(record, Ended)]
        turns = [i for i, record in enumerate(records) if isinstance(record, Transition)]
        if len(ends) != 1 or not turns:
            self._wrong(f"the journal has {len(ends)} ends and {len(turns)} transitions")
            return
        last = records[turns[-1]]
        assert isinstance(last, Transition)
        if last.following != result.ended.outcome or not result.ended.reason:
            self._wrong(f"the journal's last transition is {last}, the end {result.ended}")
        kinds = [r.kind for r in records[turns[-1] :] if isinstance(r, Command)]
        if kinds != ["stop"]:
            self._wrong(f"after the end was decided, there are the commands {kinds}")
        self._require_log()

    def _require_log(self) -> None:
        """A log that broke off is readable, and has everything up to there."""
        path = self._rig.log_path
        if path is None:
            return
        logged = list(read_log(path).records)
        told_too = self._rig.diary.records
        is_cut_off = self._fault.name == "disk full" and self._rig.is_struck
        expected = told_too[: len(logged)] if is_cut_off else told_too
        if not logged or logged != expected:
            self._wrong(f"the log has {len(logged)} records of {len(told_too)}")
        # The clock of a replay is that of the log, so what a changed clock ends is not decided so.
        if self._fault.changes_clock:
            return
        again = replay(read_log(path), synthesiser_for(self._rig.configuration.settings))
        if not again.is_same or again.complete == is_cut_off:
            self._wrong(f"decided again, it is another run: {again}")

    def _require_stillness(self) -> None:
        """Waits, and presses the resume button, after the fault is over."""
        emulator = self._rig.emulator
        emulator.faults.pace, emulator.faults.is_silent = 1.0, False
        if self._fault.name == "serial EIO":
            # Nobody can stop a controller that cannot be reached: it ends the piece that it has.
            emulator.advance(emulator.now_s + 20.0)
            self._require_way()
            return
        before = emulator.position
        for button in (b"", b"~"):
            emulator.feed(button)
            emulator.advance(emulator.now_s + 20.0)
        if any(abs(a - b) > STILL for a, b in zip(before, emulator.position, strict=True)):
            self._wrong("something moved after the end")


def nearest_mm(arcs: tuple[Arc, ...], region: Region) -> float:
    """The distance of arcs to a region's surface, by points on them; too great by 0.01 mm at most.

    It shares no code with `ntagen`. The bevel points away from the circle's centre.
    """
    nearest = math.inf
    for arc in arcs:
        count = max(1, math.ceil(arc.length_mm / _SPACING_MM))
        for index in range(count + 1):
            point = _point(arc, arc.length_mm * index / count)
            nearest = min(nearest, math.dist(point, region.center_mm))
    return nearest - region.radius_mm


def _point(arc: Arc, length_mm: float) -> Vector:
    angle = length_mm / arc.radius_mm
    along, aside = arc.radius_mm * math.sin(angle), arc.radius_mm * (1.0 - math.cos(angle))
    p, h, b = arc.start.position_mm, arc.start.heading, arc.start.bevel
    x, y, z = (p[i] + along * h[i] - aside * b[i] for i in range(3))
    return (x, y, z)
