"""A scene as exact JSON, for the log of a run.

The samples of shapes from files are large, and many scenes of a log have the same ones. A shape
names its samples by a digest, and each text has those that the first scene of the log has not.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from typing import Any, Final, cast

from ntagen.drive.json_values import value_from_json
from ntagen.errors import InputError
from ntagen.files import json_of
from ntagen.imaging.store import digest_of, from_entry, to_entry
from ntagen.motion import Motion
from ntagen.scene import Region, Scene, Tissue
from ntagen.shapes import Box, Capsule, Cylinder, Ellipsoid, Field, HalfSpace, Shape, Sphere

VERSION: Final = 1

_KINDS: Final = ("targets", "criticals", "detections", "unexplored", "safe")

_LATER_KINDS: Final = ("unexplored", "safe")
"""Entries that earlier logs do not have; they are written only where there are such regions."""

_SHAPES: Final[dict[str, type[Shape]]] = {
    "box": Box,
    "capsule": Capsule,
    "cylinder": Cylinder,
    "ellipsoid": Ellipsoid,
    "halfspace": HalfSpace,
}
"""The shapes besides the sphere, which is written as centre and radius, as in earlier logs."""


def scene_to_json(scene: Scene, known: Mapping[str, str] | None = None) -> str:
    """The scene as a JSON text; floats keep all their digits.

    Args:
        scene: The scene.
        known: Samples that are elsewhere, as `samples_in` gives them; they are left out.
    """
    samples: dict[str, str] = {}
    entries = _entries(scene)
    for kind in _KINDS:
        regions: tuple[Region, ...] = getattr(scene, kind)
        entries[kind] = [_from_region(region, samples) for region in regions]
    for kind in _LATER_KINDS:
        if not entries[kind]:
            del entries[kind]
    if scene.breath is None:
        del entries["breath"]
    if scene.tissue.kind == "static":
        # As logs have it that were written before there was another.
        entries["tissue"] = {"kind": scene.tissue.kind}
    limits = _entries(scene.limits)
    if not scene.limits.spins:
        del limits["spins"]
    entries["limits"] = limits
    document: dict[str, object] = {"version": VERSION, "scene": entries}
    missing = {digest: text for digest, text in samples.items() if digest not in (known or {})}
    if missing:
        document["samples"] = missing
    return json.dumps(document, indent=1, default=_entries)


def _entries(value: Any) -> dict[str, Any]:  # noqa: ANN401  any dataclass
    """The fields by name; the JSON writer asks for those of a field that has fields itself."""
    return {one.name: getattr(value, one.name) for one in dataclasses.fields(value)}


def samples_in(text: str | bytes) -> dict[str, str]:
    """The samples in such a text by their digests; none if it is not one."""
    try:
        found = json_of(text).get("samples", {})
    except (AttributeError, ValueError, RecursionError):
        return {}
    return dict(found) if isinstance(found, dict) else {}


def scene_from_json(text: str | bytes, known: Mapping[str, str] | None = None) -> Scene:
    """The scene of such a text.

    Args:
        text: The text.
        known: Samples that it leaves out.

    Raises:
        InputError: The text is not a scene, or the scene breaks the rules.
    """
    try:
        document = json_of(text)
        if document["version"] != VERSION:
            raise InputError(
                f"the scene of the run has version {document['version']!r}, but this ntagen reads "
                f"only version {VERSION}"
            )
        entries = {kind: [] for kind in _LATER_KINDS} | {"breath": None} | document["scene"]
        entries["tissue"] = dataclasses.asdict(Tissue()) | entries["tissue"]
        entries["limits"] = {"spins": []} | entries["limits"]
        samples = {**(known or {}), **document.get("samples", {})}
        regions = {
            kind: tuple(_to_region(entry, samples) for entry in entries[kind]) for kind in _KINDS
        }
        rest = value_from_json(entries | {kind: [] for kind in _KINDS}, Scene)
        return dataclasses.replace(rest, **cast("Any", regions))
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise InputError(f"the scene of the run cannot be read: {error!r}") from error


@dataclasses.dataclass(frozen=True, slots=True)
class _Ball:
    """A sphere as a log has it."""

    name: str
    kind: str
    center_mm: tuple[float, float, float]
    radius_mm: float
    around: str | None = None


@dataclasses.dataclass(frozen=True, slots=True)
class _Solid:
    """A region of another shape as a log has it; the measures of the shape are read by its name."""

    name: str
    kind: str
    form: str
    shape: dict[str, object]
    around: str | None = None


def _from_region(region: Region, samples: dict[str, str]) -> dict[str, object]:
    """A region's entry; only that of one that moves has a motion."""
    entry = _from_shape(region, samples)
    if region.motion is not None:
        entry["motion"] = region.motion
    return entry


def _from_shape(region: Region, samples: dict[str, str]) -> dict[str, object]:
    shape, around = region.shape, region.around
    if isinstance(shape, Sphere):
        ball = _Ball(region.name, region.kind, shape.middle_mm, shape.radius_mm, around)
        return _entries(ball)
    if isinstance(shape, Field):
        values = to_entry(shape)
        digest = digest_of(shape.samples)
        samples[digest] = values["samples"]
        values["samples"] = digest
        return _entries(_Solid(region.name, region.kind, "field", values, around))
    form = next(form for form, kind in _SHAPES.items() if type(shape) is kind)
    return _entries(_Solid(region.name, region.kind, form, _entries(shape), around))


def _to_region(entry: dict[str, object], samples: Mapping[str, str]) -> Region:
    if "motion" not in entry:
        return _to_still(entry, samples)
    still = _to_still({name: value for name, value in entry.items() if name != "motion"}, samples)
    return dataclasses.replace(still, motion=value_from_json(entry["motion"], Motion))


def _to_still(entry: dict[str, object], samples: Mapping[str, str]) -> Region:
    if "form" not in entry:
        ball = value_from_json(entry, _Ball)
        sphere = Sphere(ball.center_mm, ball.radius_mm)
        return Region(ball.name, cast("Any", ball.kind), sphere, ball.around)
    solid = value_from_json(entry, _Solid)
    if solid.form == "field":
        digest = str(solid.shape["samples"])
        field = from_entry({**solid.shape, "samples": samples[digest]})
        if digest_of(field.samples) != digest:
            raise ValueError("the samples of a shape are damaged")
        shape: Shape = field
    else:
        shape = value_from_json(solid.shape, _SHAPES[solid.form])
    return Region(solid.name, cast("Any", solid.kind), shape, solid.around)
