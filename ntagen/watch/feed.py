"""What the page of a run takes while the run goes on.

The driver gives each event to the feed and goes on at once; what the page shows of it is worked out
when the page asks, in the thread that answers. An event has a number, so a page that is loaded
again asks from the first one on, and misses nothing.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import Any, cast

from ntagen.drive.records import (
    Breathed,
    Ended,
    Foreseen,
    Forgotten,
    Learned,
    Record,
    Synthesised,
)
from ntagen.drive.settings import Settings
from ntagen.plan.actions import Plan
from ntagen.plan.synthesise import Synthesis
from ntagen.plot.picture import Picture
from ntagen.plot.run import limits_of, moments_of, planned, tube_label, tube_of
from ntagen.plot.viewer import region_data, run_data
from ntagen.scene import Needle, Region, RegionKind, Scene
from ntagen.shapes import Sphere


@dataclass(frozen=True, slots=True)
class _Found:
    """What is kept of a synthesis: its best plan, the needle at its start, the known regions."""

    plan: Plan | None
    needle: Needle
    regions: tuple[Region, ...]


class Feed:
    """A journal of a run, which pages ask for what is new."""

    def __init__(self, scene: Scene, settings: Settings) -> None:
        """Begins without events.

        Args:
            scene: The true scene.
            settings: The settings of the run.
        """
        self._scene = scene
        self._settings = settings
        self._lock = threading.Lock()
        self._records: list[Record] = []
        self._found: dict[int, _Found] = {}
        self._told = scene
        self._is_ended = False

    def record(self, record: Record) -> None:
        """Takes an event."""
        with self._lock:
            self._records.append(record)
            self._is_ended = self._is_ended or isinstance(record, Ended)

    def started(self, scene: Scene) -> None:
        """Takes the scene that the driver was told."""
        with self._lock:
            self._told = scene

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Takes the best plan of a synthesis."""
        plan = None if synthesis.best is None else synthesis.best.plan
        scene = synthesis.scene
        with self._lock:
            self._found[number] = _Found(plan, scene.needle, scene.regions)

    def picture(self) -> Picture:
        """What the page shows before the first event."""
        known = {region.name for region in self._told.regions}
        names = {region.name for region in self._scene.regions}
        breath = self._scene.breath
        return Picture(
            scene=self._scene,
            unknown=frozenset(names - known),
            title=self._scene.name,
            clock_s=0.0 if breath is None else breath.clock_s,
            limits=limits_of(self._settings),
            tube_label=tube_label(self._settings.accept),
        )

    def since(self, number: int) -> dict[str, Any]:
        """What is new from the event with this number on, as plain data."""
        with self._lock:
            records, found = self._records[number:], dict(self._found)
            is_ended = self._is_ended
        tubes = [
            tube_of(record, self._settings.accept)
            for record in records
            if isinstance(record, Foreseen)
        ]
        plans, regions, forgotten = [], dict[str, dict[str, Any]](), list[str]()
        clocks = [
            record.clock_s - record.time_s for record in records if isinstance(record, Breathed)
        ]
        for record in records:
            match record:
                case Synthesised():
                    one = found[record.number]
                    plans.append(planned(record.time_s, one.plan, one.needle))
                    regions |= self._learned(one.regions, record.time_s)
                case Learned():
                    # Its shape is known at the next synthesis; until then it is a ball.
                    ball = Sphere(record.center_mm, record.radius_mm)
                    region = Region(record.name, cast("RegionKind", record.kind), ball)
                    regions |= self._learned((region,), record.time_s)
                case Forgotten():
                    regions.pop(record.name, None)
                    forgotten.append(record.name)
        return run_data(moments_of(records), plans, tubes) | {
            "regions": list(regions.values()),
            "forgotten": forgotten,
            "clock": clocks[0] if clocks else None,
            "next": number + len(records),
            "ended": is_ended,
        }

    def _learned(self, regions: tuple[Region, ...], time_s: float) -> dict[str, dict[str, Any]]:
        """Those of the regions that the driver has learned."""
        names = {region.name for region in self._scene.regions}
        learned = (region for region in regions if region.name not in names)
        return {region.name: region_data(region, "learned", time_s) for region in learned}
