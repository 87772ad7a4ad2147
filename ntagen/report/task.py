"""What a log says of its task: regions, needle, limits, settings, and how things were measured.

Values are in mm, degrees, s and N; what is infinite or not known is null.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, Final

from ntagen.drive.log import ACTUAL, SOURCE
from ntagen.drive.reading import RunLog
from ntagen.drive.records import Learned
from ntagen.drive.settings import STEERING, Settings, value_of
from ntagen.files import json_of
from ntagen.plot.run import last_scene
from ntagen.scene import Region, Scene
from ntagen.units import deg_from_rad

_DEFAULT: Final = "default"

_NEEDLE_FACTS: Final = (
    "seed",
    "noise_mm",
    "roll_error_rad",
    "true_radius_mm",
    "true_bevel_rad",
)
"""What the metadata of a simulated run say of the true needle."""


def task_of(log: RunLog) -> dict[str, Any]:
    """The task: its file, what the driver was told, its regions, limits, tissue and breath.

    Raises:
        InputError: The log has no scene, or one that cannot be read.
    """
    scene = log.actual
    source = log.attachments.get(SOURCE)
    return {
        "name": scene.name,
        "file": log.metadata.get("environment", ""),
        "text": None if source is None else source.decode(errors="replace"),
        "known": log.metadata.get("known", "all"),
        "regions": list(_regions(log)),
        "limits": _limits(scene),
        "tissue": _tissue(scene),
        "breath": _breath(scene),
        "safety": scene.safety,
        "resolution_per_mm": scene.resolution_per_mm,
    }


def _regions(log: RunLog) -> Iterator[dict[str, Any]]:
    """All regions with their bounds: those of the true scene, then those that were learned."""
    actual, told = log.actual, {region.name for region in log.scene.regions}
    for region in actual.regions:
        yield _region(region, "told" if region.name in told else "not told")
    names = {region.name for region in actual.regions}
    for region in last_scene(log).regions:
        if region.name not in names:
            yield _region(region, "learned") | {"learned_s": _learned_s(log, region.name)}


def _learned_s(log: RunLog, name: str) -> float | None:
    """When a region was learned first."""
    learned = (one for one in log.records if isinstance(one, Learned) and one.name == name)
    first = next(learned, None)
    return None if first is None else first.time_s


def _region(region: Region, known: str) -> dict[str, Any]:
    low, high = region.shape.bounds_mm()
    motion = region.motion
    return {
        "name": region.name,
        "kind": region.kind,
        "shape": type(region.shape).__name__.lower(),
        "low_mm": [finite(part) for part in low],
        "high_mm": [finite(part) for part in high],
        "error_mm": region.shape.error_mm,
        "moves_mm": None if motion is None else motion.reach_mm,
        "moves_every_s": None if motion is None else motion.period_s,
        "known": known,
        "learned_s": None,
    }


def _limits(scene: Scene) -> dict[str, Any]:
    limits = scene.limits
    return {
        "step_mm": limits.step_s * scene.needle.speed_mm_per_s,
        "roll_angles_deg": [_degrees(angle) for angle in limits.roll_angles_rad],
        "max_rolls": limits.max_rolls,
        "min_roll_distance_mm": limits.min_roll_distance_mm,
        "free_bevel": limits.free_bevel,
        "spins": list(limits.spins),
    }


def _tissue(scene: Scene) -> dict[str, Any]:
    tissue = scene.tissue
    return {
        "kind": tissue.kind,
        "curvature_ratio": tissue.curvature_ratio,
        "roll_deg": _degrees(tissue.roll_rad),
        "tip_mm": tissue.tip_mm,
    }


def _breath(scene: Scene) -> dict[str, Any] | None:
    breath = scene.breath
    if breath is None:
        return None
    return {
        "period_s": breath.period_s,
        "wait_s": breath.wait_s,
        "max_pauses": breath.max_pauses,
        "clock_at_start_s": breath.clock_s,
    }


def needle_of(log: RunLog) -> dict[str, Any]:
    """The needle as the driver took it to be, and what the log says of the true one."""
    needle, metadata = log.scene.needle, log.metadata
    found: dict[str, Any] = {
        "name": metadata.get("needle", ""),
        "is_simulated": ACTUAL in log.attachments,
        "entry_mm": list(needle.tip.position_mm),
        "heading": list(needle.tip.heading),
        "bevel": list(needle.tip.bevel),
        "radius_mm": needle.radius_mm,
        "speed_mm_per_s": needle.speed_mm_per_s,
        "length_mm": needle.length_mm,
    }
    found |= {name: value_in(metadata, name) for name in _NEEDLE_FACTS if name in metadata}
    phantom = value_in(metadata, "phantom")
    return found | {"phantom": _flat(phantom) if isinstance(phantom, dict) else {}}


def settings_of(log: RunLog) -> list[dict[str, Any]]:
    """All settings of the driver: words, field, value, the value in its usual unit, and its origin.

    Raises:
        InputError: The log has no settings.
    """
    settings, origins = log.settings, origins_of(log)
    return [
        {
            "words": one.words,
            "field": one.field,
            "value": _listed(value_of(settings, one.field)),
            "shown": one.shown(value_of(settings, one.field)),
            "origin": origins.get(one.field, _DEFAULT),
        }
        for one in STEERING
    ]


def origins_of(log: RunLog) -> dict[str, str]:
    """Where each value comes from that is not a default, by its field."""
    origins = value_in(log.metadata, "origins")
    if not isinstance(origins, dict):
        return {}
    return {str(name): str(origin) for name, origin in origins.items()}


def measuring_of(log: RunLog) -> list[dict[str, str]]:
    """What measured the needle and how well, as the driver took it: rows of name, value, origin."""
    settings, origins = log.settings, origins_of(log)
    return [
        {"name": name, "value": value, "origin": origins.get(field, _DEFAULT) if field else "log"}
        for name, value, field in _measuring(log, settings)
    ]


def _measuring(log: RunLog, settings: Settings) -> Iterator[tuple[str, str, str]]:
    """Each row: its name, its value, and the field of the setting that says so, if one does."""
    tracker = log.metadata.get("tracker", "")
    priors = settings.priors
    yield "tracker", tracker or "the needle measures itself", ""
    frame = "positions are in the frame of the scene, in mm"
    if tracker:
        frame += "; the log does not have the registration of the tracker"
    yield "frame", frame, ""
    yield "noise of a position", f"{priors.noise_mm:.4g} mm", "priors.noise_mm"
    yield "distortion of positions", f"{priors.distortion_mm:.4g} mm", "priors.distortion_mm"
    yield "error of the entry", f"{priors.position_mm:.4g} mm", "priors.position_mm"
    heading_deg, bevel_deg = deg_from_rad(priors.heading_rad), deg_from_rad(priors.bevel_rad)
    yield "error of the first heading", f"{heading_deg:.4g} deg", "priors.heading_rad"
    yield "error of the first bevel", f"{bevel_deg:.4g} deg", "priors.bevel_rad"
    yield (
        "error of the curvature",
        f"{100 * priors.curvature_ratio:.4g} %",
        "priors.curvature_ratio",
    )
    yield "error of a roll", f"{deg_from_rad(priors.roll_rad):.4g} deg", "priors.roll_rad"
    if settings.force_sensing:
        rise = f"{settings.force_rise_n_per_mm:.4g} N/mm"
        yield "noise of a force", f"{settings.force_noise_n:.4g} N", "force_noise_n"
        yield "rise of the force near a region", rise, "force_rise_n_per_mm"
    else:
        yield "force", "not watched", "force_sensing"


def value_in(metadata: Mapping[str, str], name: str) -> Any:  # noqa: ANN401  what the log has
    """A value of the metadata; a text that is no JSON as it is, and None if there is none."""
    text = metadata.get(name)
    if text is None:
        return None
    try:
        value = json_of(text)
    except (ValueError, RecursionError):
        return text
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _flat(values: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Values within values by their names with dots between."""
    found: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            found |= _flat(value, f"{before}{name}.")
        else:
            found[before + name] = value
    return found


def _listed(value: Any) -> Any:  # noqa: ANN401  the value of any setting
    """The value as JSON gives it back."""
    return list(value) if isinstance(value, tuple) else value


def finite(value: float) -> float | None:
    """The value; None if it is infinite, which JSON cannot say."""
    return value if math.isfinite(value) else None


def _degrees(angle_rad: float) -> float:
    return round(deg_from_rad(angle_rad), 9)
