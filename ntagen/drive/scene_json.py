"""A scene as exact JSON, for the log of a run."""

from __future__ import annotations

import dataclasses
import json
from typing import Final

from ntagen.drive.json_values import value_from_json
from ntagen.errors import InputError
from ntagen.scene import Scene

VERSION: Final = 1

_LATER_KINDS: Final = ("unexplored", "safe")
"""Entries that earlier logs do not have; they are written only where there are such regions."""


def scene_to_json(scene: Scene) -> str:
    """The scene as a JSON text; floats keep all their digits."""
    entries = dataclasses.asdict(scene)
    for kind in _LATER_KINDS:
        if not entries[kind]:
            del entries[kind]
    return json.dumps({"version": VERSION, "scene": entries}, indent=1)


def scene_from_json(text: str | bytes) -> Scene:
    """The scene of such a text.

    Raises:
        InputError: The text is not a scene, or the scene breaks the rules.
    """
    try:
        document = json.loads(text)
        if document["version"] != VERSION:
            raise InputError(
                f"the scene of the run has version {document['version']!r}, but this ntagen reads "
                f"only version {VERSION}"
            )
        return value_from_json({kind: [] for kind in _LATER_KINDS} | document["scene"], Scene)
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise InputError(f"the scene of the run cannot be read: {error!r}") from error
