"""What a log says about its run besides the records: the options, the true scene, its source."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from ntagen.drive.configure import Configuration
from ntagen.drive.log import ACTUAL, SOURCE, metadata_of
from ntagen.drive.scene_json import scene_to_json
from ntagen.files import read_file
from ntagen.nsl.source import MAX_SOURCE_BYTES
from ntagen.scene import Scene
from ntagen.version import VERSION


def facts_of(
    environment: Path, scene: Scene, configuration: Configuration, known: str, tracker: str = ""
) -> tuple[dict[str, str], dict[str, bytes]]:
    """The metadata and the attachments for `ntagen.drive.log.Log`.

    Args:
        environment: The file of the scene.
        scene: The actual scene.
        configuration: The settings and the needle.
        known: The critical regions that the driver knows, in words.
        tracker: What measures, in words; empty if the needle measures itself.
    """
    errors, needle = configuration.errors, configuration.needle
    metadata: dict[str, Any] = {
        "program": f"ntagen {VERSION}",
        "started_at": datetime.now(tz=UTC).isoformat(timespec="milliseconds"),
        "environment": environment.name.encode(errors="replace").decode(),
        "known": known,
        "tracker": tracker,
        "settings": configuration.settings.to_json(),
        "origins": dict(configuration.origins),
        **needle.facts(),
    }
    attachments = {}
    if not needle.is_real:
        metadata |= {
            "seed": configuration.seed,
            "noise_mm": needle.error("noise_mm"),
            "roll_error_rad": errors.roll_rad,
            "true_radius_mm": errors.true_needle(scene.needle).radius_mm,
            "true_bevel_rad": errors.bevel_rad,
        }
        actual = replace(scene, needle=errors.true_needle(scene.needle))
        attachments[ACTUAL] = scene_to_json(actual).encode()
    # A pipe can be read only once.
    if environment.is_file():
        attachments[SOURCE] = read_file(environment, MAX_SOURCE_BYTES)
    return metadata_of(metadata), attachments
