"""The file of a registration: JSON that `ntagen calibrate` writes and `ntagen drive` reads."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Final

from ntagen.errors import InputError
from ntagen.files import read_file
from ntagen.needle.vectors import cross, dot
from ntagen.scene import Vector
from ntagen.tracking.frames import Transform
from ntagen.tracking.hand_eye import HandEye
from ntagen.tracking.pivot import rms
from ntagen.tracking.registration import Fit

FORMAT: Final = "ntagen-registration"
VERSION: Final = 1

_LARGEST_BYTES: Final = 2**20
_TOLERANCE: Final = 1e-6


def to_json(fit: Fit) -> dict[str, Any]:
    """The document of a registration, with its errors."""
    return {
        **transform_to_json(fit.transform),
        "fre_mm": fit.fre_mm,
        "fle_mm": fit.fle_mm,
        "points": [
            {"name": name, "residual_mm": residual_mm, "left_out_mm": left_out_mm}
            for name, residual_mm, left_out_mm in zip(
                fit.names, fit.residuals_mm, fit.left_out_mm, strict=True
            )
        ],
    }


def stage_to_json(found: HandEye) -> dict[str, Any]:
    """The document of a registration from poses of a stage and a tracker, with its errors."""
    return {
        **transform_to_json(found.transform),
        "rms_mm": rms(found.residuals_mm),
        "rms_deg": rms(found.residuals_deg),
        "left_out_rms_mm": known(rms(found.left_out_mm)),
        "left_out_rms_deg": known(rms(found.left_out_deg)),
        "turns_deg": list(found.turns_deg),
        "sensor": {
            "rotation": [list(row) for row in found.sensor.rotation],
            "translation_mm": list(found.sensor.translation_mm),
        },
        "poses": [
            {
                "name": name,
                "residual_mm": residual_mm,
                "residual_deg": residual_deg,
                "left_out_mm": known(left_out_mm),
                "left_out_deg": known(left_out_deg),
            }
            for name, residual_mm, residual_deg, left_out_mm, left_out_deg in zip(
                found.names,
                found.residuals_mm,
                found.residuals_deg,
                found.left_out_mm,
                found.left_out_deg,
                strict=True,
            )
        ],
    }


def known(number: float) -> float | None:
    """A number for JSON, which has no nan: `None` if it is not known."""
    return number if math.isfinite(number) else None


def transform_to_json(transform: Transform) -> dict[str, Any]:
    """What `read_transform` reads: the transform alone, without its errors."""
    return {
        "format": FORMAT,
        "version": VERSION,
        "from": transform.source,
        "to": transform.target,
        "rotation": [list(row) for row in transform.rotation],
        "translation_mm": list(transform.translation_mm),
    }


def read_transform(path: Path) -> Transform:
    """The transform in the file of a registration.

    Raises:
        InputError: The file cannot be read, or its transform is not rigid.
    """
    try:
        text = read_file(path, _LARGEST_BYTES)
    except OSError as error:
        raise InputError(f"cannot read {path}: {(error.strerror or str(error)).lower()}") from error
    return transform_in(text, str(path))


def transform_in(text: str | bytes, name: str) -> Transform:
    """The transform in the text of a registration.

    Args:
        text: The text, in JSON.
        name: What it is, for messages.

    Raises:
        InputError: It is no registration, or its transform is not rigid.
    """
    try:
        document = json.loads(text)
        if document["format"] != FORMAT or document["version"] != VERSION:
            raise ValueError("it has another format or version")
        x, y, z = (_vector(row) for row in document["rotation"])
        transform = Transform(
            str(document["from"]),
            str(document["to"]),
            (x, y, z),
            _vector(document["translation_mm"]),
        )
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
        raise InputError(
            f"{name}: this is not a registration: {error}\n"
            "hint: make one with `ntagen calibrate POINTS -o FILE`"
        ) from None
    products = [
        dot(x, x) - 1.0,
        dot(y, y) - 1.0,
        dot(x, y),
        *(a - b for a, b in zip(cross(x, y), z, strict=True)),
    ]
    if max(abs(one) for one in products) > _TOLERANCE:
        raise InputError(f"{name}: the rotation is not a rotation: it scales, shears or mirrors")
    return transform


def _vector(values: Any) -> Vector:  # noqa: ANN401  from JSON
    x, y, z = (float(value) for value in values)
    if not all(map(math.isfinite, (x, y, z))):
        raise ValueError("a number is not finite")
    return (x, y, z)
