"""Writes biopsy.seg.nrrd: anatomy that nobody has, as a segmentation with named segments.

It is a part of a trunk: two ribs before the entry, a vessel that winds across the straight way, and
a tumour behind it. The voxels are not cubes, and the volume is tilted, as those of scanners are.
Run it from this folder::

    python make_segmentation.py

The file is small, so it is kept beside this script; a test makes it anew and compares.
"""

from __future__ import annotations

import gzip
import itertools
import math
from pathlib import Path

import numpy as np

SIZES = (92, 100, 56)
SPACING_MM = (0.8, 0.8, 1.2)
TILT_RAD = math.radians(12.0)
SEGMENTS = {"ribs": 1, "vessel": 2, "tumor": 3}

MIDDLE_LPS = np.array([-60.0, 20.0, 110.0])
"""The middle of the volume, in mm: somewhere in the patient's right side."""


def directions() -> np.ndarray:
    """The unit vectors of the voxels' axes in LPS, as rows: tilted about the axis left-right."""
    cosine, sine = math.cos(TILT_RAD), math.sin(TILT_RAD)
    return np.array([[1, 0, 0], [0, cosine, sine], [0, -sine, cosine]])


def corner() -> np.ndarray:
    """The centre of the first voxel in LPS."""
    half = (np.array(SIZES) - 1) * np.array(SPACING_MM) / 2
    return MIDDLE_LPS - half @ directions()


def places() -> np.ndarray:
    """The centres of the voxels in LPS, seen from the middle of the volume."""
    index = np.stack(np.meshgrid(*map(np.arange, SIZES), indexing="ij"), axis=-1)
    return corner() - MIDDLE_LPS + (index * np.array(SPACING_MM)) @ directions()


def tube(points: np.ndarray, line: np.ndarray, radius_mm: float) -> np.ndarray:
    """Whether points lie at most a radius from a line through some points."""
    near = np.full(points.shape[:-1], np.inf)
    for start, end in itertools.pairwise(line):
        way = end - start
        share = np.clip((points - start) @ way / (way @ way), 0.0, 1.0)
        near = np.minimum(near, np.linalg.norm(points - start - share[..., None] * way, axis=-1))
    return near <= radius_mm


def labels() -> np.ndarray:
    """The labels of the voxels. Front is -y in LPS: there the needle comes in."""
    seen = places()
    found = np.zeros(SIZES, dtype=np.uint8)
    x = np.linspace(-45.0, 45.0, 31)
    for height in (-15.0, 13.0):
        rib = np.stack([x, -27.0 + x**2 / 130.0, height + 0.12 * x], axis=1)
        found[tube(seen, rib, 4.0)] = SEGMENTS["ribs"]
    z = np.linspace(-34.0, 34.0, 41)
    vessel = np.stack([4.0 * np.sin(z / 9.0) - 1.0, 3.0 + 4.0 * np.cos(z / 14.0), z], axis=1)
    found[tube(seen, vessel, 3.2)] = SEGMENTS["vessel"]
    offset = (seen - np.array([2.0, 29.0, 2.0])) / np.array([8.5, 7.5, 8.0])
    bumps = 1.0 + 0.12 * np.sin(4.0 * seen[..., 0] / 6.0) * np.cos(5.0 * seen[..., 2] / 6.0)
    found[np.linalg.norm(offset, axis=-1) <= bumps] = SEGMENTS["tumor"]
    return found


def main() -> None:
    """Writes the file."""
    rows = directions() * np.array(SPACING_MM)[:, None]
    head = [
        "NRRD0004",
        "type: unsigned char",
        "dimension: 3",
        "space: left-posterior-superior",
        "sizes: " + " ".join(map(str, SIZES)),
        "space directions: " + " ".join(vector(row) for row in rows),
        "kinds: domain domain domain",
        "encoding: gzip",
        f"space origin: {vector(corner())}",
    ]
    for number, (name, label) in enumerate(SEGMENTS.items()):
        head += [
            f"Segment{number}_ID:=Segment_{number + 1}",
            f"Segment{number}_Layer:=0",
            f"Segment{number}_LabelValue:={label}",
            f"Segment{number}_Name:={name}",
        ]
    data = gzip.compress(labels().tobytes(order="F"), 9, mtime=0)
    text = "\n".join(head) + "\n\n"
    Path(__file__).with_name("biopsy.seg.nrrd").write_bytes(text.encode("ascii") + data)


def vector(values: np.ndarray) -> str:
    """Three numbers as NRRD has them."""
    return "(" + ",".join(f"{value:.9g}" for value in values.tolist()) + ")"


if __name__ == "__main__":
    main()
