"""Small files of anatomy for tests, written by hand so that no reader's own writer is trusted."""

from __future__ import annotations

import gzip
import json
import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np

Place = tuple[float, float, float]

BOX_FACES = (
    *((0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1)),
    *((2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)),
)
FRAME = "transform from LPS (1, 0, 0, 0 mm), (0, 1, 0, 0 mm), (0, 0, 1, 0 mm)"


def box(middle: Place, size: Place) -> tuple[np.ndarray, np.ndarray]:
    """The corners and the triangles of a box."""
    ends = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    return np.array(middle) + np.array(ends) * np.array(size), np.array(BOX_FACES)


def write_stl(path: Path, points: np.ndarray, faces: np.ndarray, head: bytes = b"") -> None:
    """A binary STL file."""
    parts = [head.ljust(80, b" "), struct.pack("<I", len(faces))]
    for face in faces:
        corners = points[face].astype("<f4").tobytes()
        parts.append(b"\0" * 12 + corners + b"\0\0")
    path.write_bytes(b"".join(parts))


def write_text_stl(path: Path, points: np.ndarray, faces: np.ndarray) -> None:
    """A text STL file."""
    lines = ["solid box"]
    for face in faces:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(map(repr, map(float, points[i]))) for i in face]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid box", ""]), "utf-8")


def write_obj(path: Path, points: np.ndarray, faces: np.ndarray) -> None:
    """An OBJ file."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist()]
    path.write_text("\n".join([*lines, ""]), "utf-8")


def write_ply(path: Path, points: np.ndarray, faces: np.ndarray, comment: str = "") -> None:
    """A text PLY file."""
    lines = ["ply", "format ascii 1.0", *([f"comment {comment}"] if comment else [])]
    lines += [f"element vertex {len(points)}", *(f"property double {c}" for c in "xyz")]
    lines += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    lines += [f"{x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    lines += [f"3 {a} {b} {c}" for a, b, c in faces.tolist()]
    path.write_text("\n".join([*lines, ""]), "utf-8")


def write_nrrd(
    path: Path,
    voxels: np.ndarray,
    *,
    directions: Sequence[Place] = ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    origin: Place = (0.0, 0.0, 0.0),
    space: str = "left-posterior-superior",
    segments: Sequence[tuple[str, int] | tuple[str, int, int]] = (),
    layers: int | None = None,
    more: Sequence[str] = (),
    data_file: str | None = None,
) -> None:
    """A NRRD file with named segments: their names, numbers and perhaps layers.

    `layers` is the axis that counts layers. `more` are lines of the header. With `data_file`, the
    voxels are in that file beside the header.
    """
    head = ["NRRD0004", "type: unsigned char", f"dimension: {voxels.ndim}"]
    head += [f"space: {space}"] if space else ["space dimension: 3"]
    head += ["sizes: " + " ".join(map(str, voxels.shape))]
    shown = [f"({','.join(f'{c:g}' for c in row)})" for row in directions]
    kinds = ["domain"] * 3
    if layers is not None:
        shown.insert(layers, "none")
        kinds.insert(layers, "list")
    head += ["space directions: " + " ".join(shown), "kinds: " + " ".join(kinds)]
    head += ["encoding: gzip", f"space origin: ({','.join(f'{c:g}' for c in origin)})", *more]
    for number, (name, label, *layer) in enumerate(segments):
        head += [f"Segment{number}_Name:={name}", f"Segment{number}_LabelValue:={label}"]
        head += [f"Segment{number}_ID:=Segment_{number}"]
        head += [f"Segment{number}_Layer:={layer[0] if layer else 0}"]
    data = gzip.compress(voxels.astype("u1").tobytes(order="F"), mtime=0)
    if data_file is not None:
        head += [f"data file: {data_file}"]
        (path.parent / data_file).write_bytes(data)
        data = b""
    path.write_bytes(("\n".join(head) + "\n\n").encode() + data)


def write_nifti(
    path: Path,
    voxels: np.ndarray,
    affine: np.ndarray,
    *,
    sform: int = 1,
    units: int = 2,
    qform_at: Place | None = None,
) -> None:
    """A NIfTI-1 file of bytes in one piece; units: 1 m, 2 mm, 3 um, 0 unknown.

    With `qform_at` it has a qform as well, which does not turn and has its origin there.
    """
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, *voxels.shape, 1, 1, 1, 1)
    struct.pack_into("<hh", head, 70, 2, 8)
    struct.pack_into("<8f", head, 76, 1, 1, 1, 1, 0, 0, 0, 0)
    struct.pack_into("<f", head, 108, 352.0)
    struct.pack_into("<f", head, 112, 1.0)
    head[123] = units
    struct.pack_into("<hh", head, 252, int(qform_at is not None), sform)
    struct.pack_into("<6f", head, 256, 0, 0, 0, *(qform_at or (0, 0, 0)))
    struct.pack_into("<12f", head, 280, *np.asarray(affine, dtype=float)[:3].ravel())
    head[344:348] = b"n+1\0"
    data = bytes(head) + voxels.astype("u1").tobytes(order="F")
    path.write_bytes(gzip.compress(data, mtime=0) if path.suffix == ".gz" else data)


def write_markups(path: Path, *lists: dict[str, object]) -> None:
    """A file of markups."""
    path.write_text(json.dumps({"markups": list(lists)}), "utf-8")


def points(
    *named: tuple[str, Place], kind: str = "Fiducial", space: str = "LPS"
) -> dict[str, object]:
    """A list of points as Slicer writes it."""
    controls = [
        {"id": str(i), "label": label, "position": list(place), "positionStatus": "defined"}
        for i, (label, place) in enumerate(named)
    ]
    return {
        "type": kind,
        "coordinateSystem": space,
        "coordinateUnits": "mm",
        "controlPoints": controls,
    }


def environment(*lines: str, frame: str = FRAME) -> str:
    """A description with these lines; it has a target if none of them is one."""
    body = "\n  ".join((frame, *lines))
    if not any(line.split()[0] == "target" for line in lines):
        body += "\n  target T1 sphere (0, -50, 0) mm  radius 5 mm"
    return (
        f"environment e {{\n  needle {{ radius 30 mm  speed 1 mm/s  length 70 mm }}\n  {body}\n}}\n"
    )
