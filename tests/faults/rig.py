"""A simulated run whose parts can be broken at any moment: device, sensors, planner, log, clock.

A needle (virtual or phantom) moves behind an emulated stepper controller on a simulated clock. All
parts are the real ones; each has a hook at which a fault breaks it. `ntagen.drive` knows nothing of
this.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from ntagen.drive.configure import Configuration, configure
from ntagen.drive.device import Sensor
from ntagen.drive.log import Log, metadata_of
from ntagen.drive.operator import Operator
from ntagen.drive.outcome import Driven
from ntagen.drive.real import RealRun
from ntagen.drive.records import Ended, Journal, Journals
from ntagen.drive.shells import sensing_margin_mm
from ntagen.drive.simulate import Simulated, simulate, synthesiser_for
from ntagen.drive.stepped import Stepped
from ntagen.grbl.emulator import Emulator
from ntagen.needle.measurement import Measurement
from ntagen.needle.virtual import Obstacle
from ntagen.plan.synthesise import Synthesis, Synthesiser
from ntagen.scene import Needle, Scene
from ntagen.tracking.plausible import LivePlausible, Plausible
from tests.drive.runs import Diary

_LEAST_S = 1e-6

Checked = TypeVar("Checked", Plausible, LivePlausible)

Reading = Callable[[Measurement], Measurement]
"""What becomes of a reading on its way to the driver."""


class Rig:
    """A run that is to be broken.

    Args:
        scene: The actual scene.
        needle: ``virtual`` or ``phantom``.
        known: The critical regions that the driver knows.
        seed: The seed of the needle.
        watched: Whether the driver is that of real needles, which watches each motion.
        folder: Where the log is written; without it there is none.
    """

    def __init__(
        self,
        scene: Scene,
        needle: str,
        known: str,
        seed: int,
        *,
        watched: bool = False,
        folder: Path | None = None,
    ) -> None:
        self.scene, self.known, self.seed, self.is_watched = scene, known, seed, watched
        self.configuration: Configuration = configure((), scene, known, needle)
        self.operator = Operator()
        self.diary = Diary()
        self.is_struck = False
        self.struck_mm = self.struck_s = 0.0
        self.after_way_mm = self.forward_mm = 0.0
        self.log_path = folder / "run.mcap" if folder else None
        self.distort: Reading = lambda reading: reading
        self.before_synthesis: Callable[[], None] = lambda: None
        self.suspended_s = 0.0
        self.clock_offset_s = 0.0
        self._log: Log | None = None
        self._syntheses = 0
        self.device: Stepped

    @property
    def emulator(self) -> Emulator:
        """The controller."""
        return self.device.emulator

    def strike(self) -> None:
        """Notes that the fault begins now."""
        self.is_struck = True
        self.struck_mm, self.struck_s = self.emulator.position[0], self.emulator.now_s

    def fill_disk(self) -> None:
        """From now on, nothing can be written to the log: no space is left."""
        assert self._log is not None
        full = os.open("/dev/full", os.O_WRONLY)
        os.dup2(full, self._log._file._descriptor)
        os.close(full)

    def drive(self, prepare: Callable[[Rig], None]) -> Driven:
        """Makes the run.

        Args:
            prepare: Is called when the device is made and nothing has moved.
        """
        settings = self.configuration.settings
        inner = synthesiser_for(settings, self.operator.listen)

        def synthesise(scene: Scene, asked: Scene | None = None) -> Synthesis:
            self._syntheses += 1
            self.before_synthesis()
            return inner(scene, asked)

        def run(*journals: Log) -> Driven:
            journal = Journals(*journals, self.diary)
            return (self._watched if self.is_watched else self._simulated)(
                synthesise, journal, prepare
            )

        if self.log_path is None:
            return run()
        metadata = metadata_of({"settings": settings.to_json()})
        with Log(self.log_path, metadata, {}) as log:
            self._log = log
            return run(log)

    def _make(self, needle: Needle, obstacles: tuple[Obstacle, ...], seed: int) -> Stepped:
        make = self.configuration.needle.make
        assert make is not None
        self.device = Stepped(make(needle, obstacles, seed), needle.speed_mm_per_s)
        self._hook_clock()
        return self.device

    def _simulated(
        self, synthesise: Synthesiser, journal: Journal, prepare: Callable[[Rig], None]
    ) -> Driven:
        """The run of `ntagen drive --needle grbl+sim`."""

        def make(needle: Needle, obstacles: tuple[Obstacle, ...], seed: int) -> Simulated:
            device = self._make(needle, obstacles, seed)
            prepare(self)
            return device

        return simulate(
            self.scene,
            synthesise,
            self.configuration.settings,
            journal,
            known=self.known,
            errors=self.configuration.errors,
            make=make,
            seed=self.seed,
            sense=lambda needle: self._sensor(Plausible, needle),
            listen=self.operator.listen,
        )

    def _watched(
        self, synthesise: Synthesiser, journal: Journal, prepare: Callable[[Rig], None]
    ) -> Driven:
        """The run of `ntagen drive --needle grbl:PORT`, with the simulated needle."""
        settings = self.configuration.settings
        obstacles = tuple(
            Obstacle(
                region,
                sensing_margin_mm(region, self.scene.detections, settings.sensing_margin_mm),
            )
            for region in self.scene.criticals
        )
        device = self._make(self.scene.needle, obstacles, self.seed)
        prepare(self)
        return RealRun(
            self.scene,
            device.actuator,
            self._sensor(LivePlausible, device),
            synthesise,
            settings,
            journal,
            known=self.known,
            listen=self.operator.listen,
        ).drive()

    def _sensor(self, kind: type[Checked], needle: Sensor) -> Checked:
        varies = self.configuration.needle.parameters is not None
        entry, clock = self.scene.needle.tip, self.device.now_s
        return kind(_Broken(self, needle), entry, clock, force_varies=varies)

    @property
    def syntheses(self) -> int:
        """How many syntheses have begun."""
        return self._syntheses

    @property
    def ended(self) -> Ended | None:
        """The record of the end, if there is exactly one."""
        found = [record for record in self.diary.records if isinstance(record, Ended)]
        return found[0] if len(found) == 1 else None

    def _hook_clock(self) -> None:
        """Lets faults suspend the driver's process, or set its clock."""
        port, emulator = self.device.port, self.device.emulator
        read = port.read

        def reading(timeout_s: float) -> bytes:
            if self.suspended_s > 0.0:
                pause_s, self.suspended_s = self.suspended_s, 0.0
                emulator.advance(emulator.now_s + pause_s)
            # With an offset, a rest of time can be too small to change the clock.
            return read(max(timeout_s, _LEAST_S))

        port.read = reading  # type: ignore[method-assign]
        port.now_s = lambda: emulator.now_s + self.clock_offset_s  # type: ignore[method-assign]


class _Broken:
    """A needle's sensors behind the fault."""

    measures_force = True

    def __init__(self, rig: Rig, needle: Sensor) -> None:
        self._rig = rig
        self._needle = needle

    def measure(self) -> Measurement:
        return self._rig.distort(self._needle.measure())

    def newest(self) -> Measurement:
        return self.measure()
