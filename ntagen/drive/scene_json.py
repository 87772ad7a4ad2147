"""A scene as JSON, exactly: what a run was told travels in its log."""

from __future__ import annotations

import dataclasses
import json
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.scene import (
    Limits,
    NamedQuery,
    Needle,
    Pose,
    Region,
    Scene,
    Tissue,
    Vector,
)

VERSION: Final = 1


def scene_to_json(scene: Scene) -> str:
    """The scene as a JSON text; floats keep all their digits."""
    return json.dumps({"version": VERSION, "scene": dataclasses.asdict(scene)}, indent=1)


def scene_from_json(text: str | bytes) -> Scene:
    """The scene of such a text.

    Raises:
        InputError: The text is no scene.
    """
    try:
        document = json.loads(text)
        if document["version"] != VERSION:
            raise InputError(f"scene of version {document['version']}: only {VERSION} is known")
        return _scene(document["scene"])
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(f"the scene of the run cannot be read: {error!r}") from error


def _scene(fields: dict[str, Any]) -> Scene:
    needle = fields["needle"]
    limits = fields["limits"] | {"roll_angles_rad": tuple(fields["limits"]["roll_angles_rad"])}
    return Scene(
        name=fields["name"],
        needle=Needle(
            Pose(**{name: _vector(value) for name, value in needle["tip"].items()}),
            needle["radius_mm"],
            needle["speed_mm_per_s"],
            needle["length_mm"],
        ),
        axis=_vector(fields["axis"]),
        limits=Limits(**limits),
        targets=_regions(fields["targets"]),
        criticals=_regions(fields["criticals"]),
        detections=_regions(fields["detections"]),
        tissue=Tissue(**fields["tissue"]),
        resolution_per_mm=fields["resolution_per_mm"],
        safety=fields["safety"],
        queries=tuple(NamedQuery(**query) for query in fields["queries"]),
    )


def _regions(items: list[dict[str, Any]]) -> tuple[Region, ...]:
    return tuple(Region(**(item | {"center_mm": _vector(item["center_mm"])})) for item in items)


def _vector(value: list[float]) -> Vector:
    x, y, z = value
    return (x, y, z)
