"""Makes the picture of a scene with its plans, or of a run from its log."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Final

from ntagen.drive.reading import RunLog
from ntagen.drive.records import (
    Breathed,
    Ended,
    Estimated,
    Followed,
    Foreseen,
    Guaranteed,
    Learned,
    Measured,
    Predicted,
    Record,
    Synthesised,
    Transition,
    Truth,
)
from ntagen.drive.settings import Settings
from ntagen.drive.story import guaranteed, tell
from ntagen.errors import InputError
from ntagen.files import json_of
from ntagen.needle.path import sample_poses
from ntagen.plan.actions import Plan, Push
from ntagen.plan.branches import path_of
from ntagen.plan.document import plan_from_json
from ntagen.plan.synthesise import Synthesis
from ntagen.plan.wording import clearance_of, counted, ranked_by
from ntagen.plot.picture import GAP_MM, Curve, Moment, Picture, Planned
from ntagen.plot.strategy import FOLLOWED_LABEL, OTHER_LABEL, branches_of, curve_of
from ntagen.scene import Needle, Scene, Vector

_SPACING_MM: Final = 0.5
_LONGEST: Final = 200
_SCENE_OF: Final = re.compile(r"rebuild-(\d{4,9})/scene\.json", re.ASCII)


def picture_of_plans(scene: Scene, synthesis: Synthesis | None, shown: int) -> Picture:
    """The picture of a scene with its best plans, at most `shown` of them.

    Without a synthesis it shows the scene alone.
    """
    candidates = () if synthesis is None else synthesis.candidates
    plans = [candidate.plan for candidate in candidates[:shown]]
    caption = (
        ""
        if synthesis is None
        else counted(synthesis.found, len(candidates), is_complete=synthesis.is_complete)
    )
    if candidates:
        clearance = clearance_of(candidates[0].certificate)
        caption += f"; best: {_shortened(str(candidates[0].plan))}{clearance and f', {clearance}'}"
        caption += f"\n{ranked_by(synthesis.ranking)}" if synthesis is not None else ""
    bent, spun = parts_of(plans[0], scene.needle) if plans else ((), ())
    return Picture(
        scene=scene,
        best=curve(plans[0], scene.needle) if plans else (),
        bent=bent,
        spun=spun,
        others=[curve(plan, scene.needle) for plan in plans[1:]],
        caption=caption,
        clock_s=0.0 if scene.breath is None else scene.breath.clock_s,
    )


def picture_of_run(log: RunLog, shown: int) -> Picture:
    """The picture of a run: the regions, also learned ones, the last plans, and the tip's path.

    Raises:
        InputError: The log has no scene, or one that cannot be read.
    """
    actual, told = log.actual, log.scene
    names = {region.name for region in actual.regions}
    learned = tuple(region for region in last_scene(log).regions if region.name not in names)
    plans, needle = _last_plans(log, shown)
    best = curve(plans[0], needle) if plans else ()
    bent, spun = parts_of(plans[0], needle) if plans else ((), ())
    others, labels = [curve(plan, needle) for plan in plans[1:]], ("last plan", "other plans")
    followed = _followed(log, shown)
    if followed is not None:
        (best, others), labels = followed, (FOLLOWED_LABEL, OTHER_LABEL)
        bent, spun = (), ()
    ends = [record for record in log.records if isinstance(record, Ended)]
    return Picture(
        scene=actual.with_regions(*learned),
        best=best,
        bent=bent,
        spun=spun,
        others=others,
        best_label=labels[0],
        other_label=labels[1],
        true_path=_split([r.position_mm for r in log.records if isinstance(r, Truth)]),
        measured=[r.position_mm for r in log.records if isinstance(r, Measured)],
        learned=frozenset(region.name for region in learned),
        unknown=frozenset(names - {region.name for region in told.regions}),
        title=f"{actual.name}, a run with seed {log.metadata.get('seed', '?')}",
        caption=_outcome(ends[-1], log.records) if ends else "the log is torn",
        moments=moments_of(log.records),
        appears_s=_learned_at(log.records),
        clock_s=clock_at_start_s(log),
        plans=[] if followed is not None else _plans_of(log),
        limits=limits_of(log.settings),
        **_tubes(log),
    )


def moments_of(records: Sequence[Record]) -> list[Moment]:
    """The moments of a run: one for each time at which something was measured, done or told."""
    at: dict[float, Moment] = {}
    for record in records:
        moment = at.get(record.time_s, Moment(record.time_s))
        seen = _seen(record)
        if (text := tell(record)) is not None:
            seen["said"] = (*moment.said, text)
        if seen:
            at[record.time_s] = replace(moment, **seen)
    return [at[time_s] for time_s in sorted(at)]


def _seen(record: Record) -> dict[str, Any]:
    """What a record tells of its moment, besides words."""
    match record:
        case Truth():
            return {"true_mm": record.position_mm}
        case Measured():
            return {
                "measured_mm": record.position_mm,
                "depth_mm": record.depth_mm,
                "force_n": record.force_n,
            }
        case Predicted():
            return {"tip_mm": record.position_mm, "off_mm": record.deviation_mm}
        case Estimated():
            return {"tip_mm": record.position_mm}
        case Transition():
            return {"state": record.following}
        case Ended():
            return {"state": record.outcome}
    return {}


def limits_of(settings: Settings) -> dict[str, float]:
    """The limits that a run keeps to and that a chart can show, by the fields of `Moment`."""
    return {"off_mm": settings.deviation_mm}


def _learned_at(records: Sequence[Record]) -> dict[str, float]:
    """When each region was learned first."""
    learned = [record for record in records if isinstance(record, Learned)]
    return {record.name: record.time_s for record in reversed(learned)}


def clock_at_start_s(log: RunLog) -> float:
    """The time on the clock of the breath at the time 0 of the run, in s; 0 without a breath."""
    if log.actual.breath is None:
        return 0.0
    heard = (one for one in log.records if isinstance(one, Breathed))
    first = next(heard, Breathed(0.0, log.actual.breath.clock_s))
    return first.clock_s - first.time_s


def curve(plan: Plan, needle: Needle) -> Curve:
    """The points of the path of a needle that follows a plan."""
    poses = sample_poses(plan.arcs(needle), _SPACING_MM)
    return [pose.position_mm for pose in poses]


def parts_of(plan: Plan, needle: Needle) -> tuple[Sequence[Curve], Sequence[Curve]]:
    """The parts of a plan's path without a spin, and those with one; none if none has."""
    pushes = [action for action in plan.actions if isinstance(action, Push)]
    if not any(push.spin for push in pushes):
        return (), ()
    parts: dict[bool, list[Curve]] = {False: [], True: []}
    for push, arc in zip(pushes, plan.arcs(needle), strict=True):
        poses = sample_poses((arc,), _SPACING_MM)
        parts[push.spin > 0.0].append([pose.position_mm for pose in poses])
    return parts[False], parts[True]


def planned(time_s: float, plan: Plan | None, needle: Needle) -> Planned:
    """A plan that is followed from a moment on."""
    if plan is None:
        return Planned(time_s)
    bent, spun = parts_of(plan, needle)
    return Planned(time_s, bent if spun else (curve(plan, needle),), spun)


def tube_of(foreseen: Foreseen, accept: float) -> Planned:
    """How far the tip is expected from its plan, at a confidence."""
    return Planned(foreseen.time_s, tube=foreseen.tube(accept))


def tube_label(accept: float) -> str:
    """What tubes are called."""
    return f"tube ({100.0 * accept:g} %)"


def _shortened(plan: str) -> str:
    """A plan in words; one with very many waits is cut off."""
    return plan if len(plan) <= _LONGEST else plan[:_LONGEST].rpartition(",")[0] + ", …"


def _outcome(ended: Ended, records: Sequence[Record]) -> str:
    outcome = f"{ended.outcome} after {ended.time_s:.0f} s"
    kept = [guaranteed(record) for record in records if isinstance(record, Guaranteed)]
    count = f"{ended.syntheses} syntheses, {ended.adjustments} adjustments"
    made = [] if kept and not ended.syntheses else [count]
    return "\n".join(["; ".join([outcome, *made]), *kept])


def _followed(log: RunLog, shown: int) -> tuple[Curve, list[Curve]] | None:
    """The way through a strategy that was followed, and all its branches; None after plans."""
    course = log.course
    ways = [record.way for record in log.records if isinstance(record, Followed)]
    if course is None or course.tree is None or not ways:
        return None
    if any(isinstance(record, Synthesised) for record in log.records):
        return None
    try:
        way = path_of(course.tree, log.scene, tuple(map(int, ways[-1])))
    except IndexError as error:
        raise InputError(f"the strategy of the run has no such branch: {error}") from error
    return curve_of(way), branches_of(course.tree, log.scene) if shown else []


def last_scene(log: RunLog) -> Scene:
    """The scene that the driver knew at the last synthesis."""
    found = map(_SCENE_OF.fullmatch, log.attachments)
    numbers = [int(one[1]) for one in found if one]
    return log.scene_of(max(numbers)) if numbers else log.scene


def _last_plans(log: RunLog, shown: int) -> tuple[list[Plan], Needle]:
    """The plans of the last synthesis that had plans, best first, and the needle at their start."""
    numbers = [r.number for r in log.records if isinstance(r, Synthesised) and r.plan]
    for number in reversed(numbers):
        folder = f"rebuild-{number:04d}"
        if f"{folder}/plans.json" in log.attachments:
            scene = log.scene_of(number)
            with log.naming():
                return _plans_in(log.attachments[f"{folder}/plans.json"], shown), scene.needle
    return [], log.scene.needle


def _plans_of(log: RunLog) -> list[Planned]:
    """The best plan of each synthesis from then on."""
    found = []
    for record in log.records:
        if not isinstance(record, Synthesised):
            continue
        name = f"rebuild-{record.number:04d}/plans.json"
        plan, needle = None, log.scene.needle
        if record.plan and name in log.attachments:
            needle = log.scene_of(record.number).needle
            with log.naming():
                plan = next(iter(_plans_in(log.attachments[name], 1)), None)
        found.append(planned(record.time_s, plan, needle))
    return found


def _plans_in(data: bytes, shown: int) -> list[Plan]:
    """The first plans of an attachment.

    Raises:
        InputError: It has none.
    """
    try:
        items = json_of(data)["plans"][:shown]
        return [plan_from_json(item["actions"]) for item in items]
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise InputError(f"the plans of the run cannot be read: {error!r}") from error


def _tubes(log: RunLog) -> dict[str, Any]:
    """How far from its plans the tip was expected, at the confidence that was asked for."""
    foreseen = [record for record in log.records if isinstance(record, Foreseen)]
    if not foreseen:
        return {}
    accept = log.settings.accept
    tubes = [tube_of(one, accept) for one in foreseen]
    return {"tubes": tubes, "tube_label": tube_label(accept)}


def _split(points: list[Vector]) -> list[Curve]:
    curves: list[list[Vector]] = []
    for point in points:
        if curves and math.dist(curves[-1][-1], point) <= GAP_MM:
            curves[-1].append(point)
        else:
            curves.append([point])
    return [curve for curve in curves if len(curve) > 1]
