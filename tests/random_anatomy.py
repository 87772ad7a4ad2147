"""Random files of anatomy with what is true of them, written by hand after the formats' texts.

No reader or writer of ntagen or of another package is used here. A sample has its files, and either
where its points are, or the word that a refusal must name.
"""

from __future__ import annotations

import bz2
import gzip
import math
import random
import struct
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

TO_LPS = {"LPS": (1.0, 1.0, 1.0), "RAS": (-1.0, -1.0, 1.0), "LAS": (1.0, -1.0, 1.0)}


@dataclass(frozen=True)
class Sample:
    """A random file.

    Attributes:
        name: Its name.
        files: The content of this file and of others that belong to it.
        part: The segment (text) or label (number) to look for.
        words: What the description has to say behind `in`.
        places_mm: Where the voxels of the part, or the corners of all triangles, are in LPS; sorted
            by nothing.
        refused: A word that the refusal has; empty if the file can be read.
        exact_mm: How far places may be off.
    """

    name: str
    files: dict[str, bytes]
    part: str | int | None
    words: str
    places_mm: np.ndarray
    refused: str = ""
    exact_mm: float = 1e-6

    def write(self, folder: Path) -> Path:
        """Writes the files, and returns the path of the one to read."""
        for name, data in self.files.items():
            (folder / name).write_bytes(data)
        return folder / self.name


def turn_of(chance: random.Random) -> np.ndarray:
    """Three directions at right angles in rows: along axes in any order and sense, or oblique."""
    if chance.random() < 0.4:
        rows = np.eye(3)[chance.sample(range(3), 3)]
    else:
        rows = np.linalg.qr(np.array([[chance.gauss(0, 1) for _ in "xyz"] for _ in "xyz"]))[0]
    return rows * [[chance.choice((-1.0, 1.0))] for _ in "xyz"]


def number_places(sizes: tuple[int, ...], chance: random.Random) -> np.ndarray:
    """Some indices of voxels, at least one."""
    count = chance.choice((1, 1, 2, 5))
    return np.unique([[chance.randrange(size) for size in sizes] for _ in range(count)], axis=0)


# ------------------------------------------------------------------------------------------- NRRD

SPACES = {
    **{"left-posterior-superior": "LPS", "right-anterior-superior": "RAS"},
    **{"left-anterior-superior": "LAS", "LPS": "LPS", "RAS": "RAS", "LAS": "LAS"},
}
UNNAMED = ("scanner-xyz", "3D-left-handed", "left-posterior-inferior", "PLS", "xyz")
NRRD_TYPES = {
    **{"signed char": "i1", "int8": "i1", "uchar": "u1", "unsigned char": "u1", "uint8_t": "u1"},
    **{"short": "i2", "short int": "i2", "int16_t": "i2", "ushort": "u2", "unsigned short": "u2"},
    **{"int": "i4", "int32": "i4", "uint": "u4", "unsigned int": "u4", "long long int": "i8"},
    **{"uint64": "u8", "float": "f4", "double": "f8"},
}
UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "micron": 0.001}
Cased = Callable[[str], str]


@dataclass(frozen=True)
class _Sides:
    """What a header says of the patient's sides.

    Attributes:
        line: The line of the header.
        has_time: Whether the space has a fourth axis.
        to_lps: The signs that bring coordinates to LPS.
        words: What the description has to say.
        refused: A word that the refusal names; empty if the space can be used.
    """

    line: str
    has_time: bool
    to_lps: tuple[float, float, float]
    words: str = ""
    refused: str = ""


def _sides(chance: random.Random) -> _Sides:
    """Any space of NRRD, in any case; some are none, or leave the sides to the description."""
    cased: Cased = chance.choice((str, str, str.upper, str.lower, str.title))
    has_time = chance.random() < 0.2
    kind = chance.random()
    if kind < 0.15:
        word = chance.choice(UNNAMED)
        return _Sides(f"space: {word + '-time' * has_time}", has_time, (1, 1, 1), "", word)
    if kind < 0.3:
        words = chance.choice(("LPS", "RAS"))
        line = "space: " + cased("3D-right-handed" + "-time" * has_time)
        if not has_time and chance.random() < 0.5:
            line = "space dimension: 3"
        return _Sides(line, has_time, TO_LPS[words], words)
    space = chance.choice(list(SPACES))
    ending = ("T" if len(space) == 3 else "-time") * has_time
    return _Sides(f"space: {cased(space + ending)}", has_time, TO_LPS[SPACES[space]])


@dataclass(frozen=True)
class _Axis:
    """An axis of a header: its size, its direction as text, its kind, and what it counts."""

    size: int
    direction: str
    kind: str
    counts: str


def _axes(
    chance: random.Random, rows: np.ndarray, sizes: tuple[int, ...], has_time: bool
) -> list[_Axis]:
    """Three axes in space, perhaps one of layers, perhaps one of time with one moment."""
    axes = []
    for size, row in zip(sizes, rows.tolist(), strict=True):
        numbers = [*row, *([0.0] if has_time else [])]
        axes.append(_Axis(size, f"({','.join(map(repr, numbers))})", "domain", "space"))
    if chance.random() < 0.5:
        kind = chance.choice(("list", "vector", "???"))
        layers = _Axis(chance.choice((2, 3)), "none", kind, "layers")
        axes.insert(chance.randint(0, 3), layers)
    if has_time and chance.random() < 0.7:
        direction = chance.choice(("(0,0,0,0.5)", "none"))
        axes.insert(chance.randint(0, len(axes)), _Axis(1, direction, "time", "time"))
    return axes


def random_nrrd(chance: random.Random) -> Sample:
    """A NRRD file: attached or detached, any axes, layers, types, encodings and units."""
    sizes = tuple(chance.randint(1, 6) for _ in "xyz")
    digits = chance.choice((17, 17, 17, 7))
    spacing = np.array([round(chance.uniform(0.2, 4), 3) for _ in "xyz"])
    rows = rounded(turn_of(chance) * spacing[:, None], digits)
    origin = rounded(np.array([chance.uniform(-300, 300) for _ in "xyz"]), digits)
    sides = _sides(chance)
    axes = _axes(chance, rows, sizes, sides.has_time)
    layers = sum(axis.size for axis in axes if axis.counts == "layers") or 1
    layer = chance.randrange(layers)
    type_name = chance.choice(list(NRRD_TYPES))
    dtype = np.dtype(NRRD_TYPES[type_name]).newbyteorder(chance.choice("<>"))
    voxels = np.zeros([axis.size for axis in axes], dtype=dtype)
    others = [[chance.randrange(axis.size) for axis in axes] for _ in range(4)]
    voxels[tuple(np.array(others).T)] = 9
    places = number_places(sizes, chance)
    columns = iter(places.T)
    at = {"layers": layer, "time": 0}
    voxels[tuple(next(columns) if a.counts == "space" else at[a.counts] for a in axes)] = 3
    values = {"ID": "Segment_{}", "Name": "part {} ä", "LabelValue": "3", "Layer": "{}"}
    keys = [f"Segment{n}_{k}:={v.format(n)}" for n in range(layers) for k, v in values.items()]
    part: str | int = f"part {layer} ä" if layers > 1 or chance.random() < 0.5 else 3
    unit = chance.choice(list(UNITS)) if chance.random() < 0.3 else None
    unit_mm = UNITS[unit] if unit else 1.0
    lines = [f"dimension: {len(axes)}", sides.line]
    lines += ["type: " + chance.choice((str, str.upper))(type_name)]
    lines += ["sizes: " + " ".join(str(axis.size) for axis in axes)]
    lines += ["space directions: " + chance.choice((" ", "  ")).join(a.direction for a in axes)]
    ends = [*origin.tolist(), *([0.0] if sides.has_time else [])]
    lines += [f"space origin: ({chance.choice((',', ', ')).join(map(repr, ends))})"]
    if chance.random() < 0.8 or any(axis.kind == "time" for axis in axes):
        lines += ["kinds: " + " ".join(axis.kind for axis in axes)]
    if unit is not None:
        lines += ["space units: " + " ".join([f'"{unit}"'] * 3 + ['"s"'] * sides.has_time)]
    if chance.random() < 0.1:
        lengths = iter(spacing.tolist())
        shown = [repr(next(lengths)) if axis.counts == "space" else "nan" for axis in axes]
        lines += ["spacings: " + " ".join(shown)]
    if chance.random() < 0.3:
        lines += ["# a comment", "content: nothing", "measurement frame: (1,0,0) (0,1,0) (0,0,1)"]
    places_mm = ((origin + places @ rows) * sides.to_lps) * unit_mm
    exact_mm = 1e-6 if digits == 17 else 1e-5 * max(1.0, unit_mm)
    sample = Sample("", {}, part, sides.words, places_mm, sides.refused, exact_mm)
    return _nrrd_file(chance, lines, keys, voxels, sample)


def rounded(numbers: np.ndarray, digits: int) -> np.ndarray:
    """Numbers as a file has them that writes so many digits."""
    return np.array([float(f"{n:.{digits}g}") for n in numbers.flat]).reshape(numbers.shape)


def _nrrd_file(
    chance: random.Random, lines: list[str], keys: list[str], voxels: np.ndarray, sample: Sample
) -> Sample:
    """The same sample with its files."""
    encoding = chance.choice(("raw", "gzip", "gz", "bzip2", "txt"))
    data = voxels.tobytes(order="F")
    if encoding == "txt":
        data = "\n".join(map(str, voxels.flatten(order="F").tolist())).encode()
    skip = b""
    if chance.random() < 0.2:
        skip = bytes(chance.randrange(1, 40))
        lines = [*lines, f"byte skip: {len(skip)}"]
    elif encoding == "raw" and chance.random() < 0.1:
        skip, lines = b"xyz", [*lines, "byte skip: -1"]
    data = skip + data
    if encoding[0] == "g":
        data = gzip.compress(data, mtime=0)
    elif encoding[0] == "b":
        data = bz2.compress(data)
    if chance.random() < 0.1:
        data, lines = b"one line\n" + data, [*lines, "line skip: 1"]
    endian = "little" if voxels.dtype.byteorder in "<=|" else "big"
    lines = [*lines, f"encoding: {encoding}", f"endian: {endian}"]
    # The dimension and the space come before what depends on them.
    first = [line for line in lines if line.startswith(("dimension", "space: ", "space dim"))]
    rest = [line for line in lines if line not in first]
    chance.shuffle(rest)
    lines = first + rest
    name = chance.choice(("a.nrrd", "a.seg.nrrd", "a.nhdr", "A.NRRD"))
    other = "a.raw" if name == "a.nhdr" or chance.random() < 0.1 else None
    if other is not None:
        lines += [chance.choice((f"data file: {other}", f"datafile: {other}"))]
    end = chance.choice(("\n", "\n", "\r\n"))
    head = end.join([f"NRRD000{chance.choice('45')}", *lines, *keys, "", ""]).encode()
    files = {name: head + data} if other is None else {name: head, other: data}
    return replace(sample, name=name, files=files)


# ------------------------------------------------------------------------------------------ NIfTI

NIFTI_TYPES = {2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8", 256: "i1", 512: "u2", 768: "u4"}
NIFTI_UNITS = {1: 1000.0, 2: 1.0, 3: 0.001}


def random_nifti(chance: random.Random) -> Sample:
    """A NIfTI file of version 1 or 2, either byte order, with qform, sform, or both."""
    version, order = chance.choice((1, 2)), chance.choice("<>")
    sizes = tuple(chance.randint(1, 6) for _ in "xyz")
    spacing = np.array([chance.uniform(0.2, 4) for _ in "xyz"])
    rows = turn_of(chance)
    origin = np.array([chance.uniform(-300, 300) for _ in "xyz"])
    real = np.float32 if version == 1 else np.float64
    quaternion, sense = _quaternion(rows)
    quaternion, origin = quaternion.astype(real).astype(float), origin.astype(real).astype(float)
    spacing = spacing.astype(real).astype(float)
    if 1e-7 < 1.0 - (quaternion @ quaternion) < 1e-5:
        # Readers do not agree whether this is half a turn.
        return random_nifti(chance)
    of_qform = _rows_of(quaternion, sense) * spacing[:, None]
    of_sform = (rows * spacing[:, None]).astype(real).astype(float)
    codes = chance.choice(((1, 0), (0, 1), (1, 1), (2, 4), (1, 2), (0, 0)))
    words, refused, moved = "", "", origin
    unit = chance.choice((1, 2, 2, 2, 3, 0))
    if 0 not in codes and chance.random() < 0.5:
        # An atlas: turned and moved.
        of_sform = of_sform[[1, 2, 0]]
        moved = moved + np.eye(3)[0] * chance.choice((-40.0, 40.0)) / NIFTI_UNITS.get(unit, 1.0)
        moved = moved.astype(real).astype(float)
        words, refused = chance.choice((("", "qform"), ("qform", ""), ("sform", "")))
    elif codes == (0, 0):
        refused = "neither an sform nor a qform"
    takes_qform = codes[1] == 0 or words == "qform"
    if unit == 0:
        words = (words + " mm").strip()
    code = chance.choice(list(NIFTI_TYPES))
    dtype = np.dtype(NIFTI_TYPES[code]).newbyteorder(order)
    slope, intercept = chance.choice(((0, 0), (1, 0), (2, 1), (math.nan, math.nan), (0.5, -1)))
    voxels = np.zeros(sizes, dtype=dtype)
    places = number_places(sizes, chance)
    voxels[tuple(places.T)] = 6
    scaled = slope and not math.isnan(slope)
    part = int(slope * 6 + intercept) if scaled else 6
    start = (352 if version == 1 else 544) + 16 * chance.randint(0, 3)
    dim = [3 + chance.choice((0, 0, 1, 2)), *sizes, 1, 1, 1, 1]
    head = bytearray(start)
    put: Callable[..., None] = lambda at, kind, *values: struct.pack_into(  # noqa: E731
        order + kind, head, at, *values
    )
    zooms = [sense, *spacing.tolist(), 0, 0, 0, 0]
    matrix = [[*column, o] for column, o in zip(of_sform.T.tolist(), moved.tolist(), strict=True)]
    flat = [number for row in matrix for number in row]
    b, c, d = quaternion.tolist()
    bits = dtype.itemsize * 8
    if version == 1:
        put(0, "i", 348), put(40, "8h", *dim), put(70, "hh", code, bits), put(76, "8f", *zooms)
        put(108, "3f", start, slope, intercept), put(252, "hh", *codes)
        put(256, "6f", b, c, d, *origin), put(280, "12f", *flat)
        head[123] = unit | 8
        head[344:348] = b"n+1\0"
    else:
        put(0, "i", 540), put(12, "hh", code, bits), put(16, "8q", *dim), put(104, "8d", *zooms)
        put(168, "q", start), put(176, "2d", slope, intercept), put(344, "ii", *codes)
        put(352, "6d", b, c, d, *origin), put(400, "12d", *flat), put(500, "i", unit | 8)
        head[4:12] = b"n+2\0\r\n\x1a\n"
    data = bytes(head) + voxels.tobytes(order="F") + bytes(chance.choice((0, 0, 5)))
    name = chance.choice(("a.nii", "a.nii.gz", "A.NII.GZ"))
    if name.lower().endswith("gz"):
        data = gzip.compress(data, mtime=0)
    found = origin + places @ of_qform if takes_qform else moved + places @ of_sform
    # Directions of 32 bits are at right angles to seven digits only; a field says by how much.
    unit_mm = NIFTI_UNITS.get(unit, 1.0)
    return Sample(
        name,
        {name: data},
        part,
        words,
        found * TO_LPS["RAS"] * unit_mm,
        refused,
        1e-6 if len(places) == 1 or version == 2 else 1e-5 * max(1.0, unit_mm),
    )


def _quaternion(rows: np.ndarray) -> tuple[np.ndarray, float]:
    """``b, c, d`` and ``qfac`` of directions in rows."""
    sense = 1.0 if np.linalg.det(rows) > 0.0 else -1.0
    turn = (rows * np.array([[1.0], [1.0], [sense]])).T
    values, vectors = np.linalg.eigh(_symmetric(turn))
    a, b, c, d = vectors[:, int(np.argmax(values))]
    return np.array([b, c, d]) * (1.0 if a >= 0.0 else -1.0), sense


def _symmetric(turn: np.ndarray) -> np.ndarray:
    """A matrix whose first eigenvector is the quaternion of a turn (Bar-Itzhack 2000)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = turn
    return np.array(
        [
            [xx + yy + zz, zy - yz, xz - zx, yx - xy],
            [zy - yz, xx - yy - zz, xy + yx, xz + zx],
            [xz - zx, xy + yx, yy - xx - zz, yz + zy],
            [yx - xy, xz + zx, yz + zy, zz - xx - yy],
        ]
    )


def _rows_of(quaternion: np.ndarray, sense: float) -> np.ndarray:
    """The directions of a quaternion, as nifti1.h and its library give them."""
    b, c, d = quaternion
    square = 1.0 - b * b - c * c - d * d
    if square < 1e-7:
        # Half a turn, but for rounding.
        b, c, d = quaternion / math.sqrt(b * b + c * c + d * d)
    a = math.sqrt(square) if square >= 1e-7 else 0.0
    turn = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * b * c - 2 * a * d, 2 * b * d + 2 * a * c],
            [2 * b * c + 2 * a * d, a * a + c * c - b * b - d * d, 2 * c * d - 2 * a * b],
            [2 * b * d - 2 * a * c, 2 * c * d + 2 * a * b, a * a + d * d - c * c - b * b],
        ]
    )
    return turn.T * np.array([[1.0], [1.0], [sense]])


# ----------------------------------------------------------------------------------------- meshes


def random_mesh(chance: random.Random) -> Sample:
    """A box in STL, OBJ or PLY, in one of the ways in which such a file can be written."""
    ends = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    size = [chance.uniform(1, 20) for _ in "xyz"]
    points = (ends * size) @ turn_of(chance) + [chance.uniform(-100, 100) for _ in "xyz"]
    unit, unit_mm = chance.choice((("mm", 1.0), ("cm", 10.0), ("m", 1000.0)))
    space = chance.choice(("LPS", "RAS"))
    points = points.astype(np.float32).astype(float)
    quads = np.array(BOX_QUADS)
    if np.linalg.det(points[[4, 2, 1]] - points[0]) < 0.0:
        quads = quads[:, ::-1]
    order = [chance.sample(range(4), 1)[0] for _ in quads]
    quads = np.array([np.roll(quad, turn) for quad, turn in zip(quads, order, strict=True)])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    if chance.random() < 0.1:
        # The same triangle twice, or one too few.
        faces, refused = chance.choice(
            ((np.vstack([faces, faces[:1]]), "repeats 1"), (faces[1:], "not closed"))
        )
    else:
        refused = ""
    write = chance.choice((_stl, _text_stl, _obj, _ply, _ply))
    polygons = [list(face) for face in faces.tolist()]
    if not refused and chance.random() < 0.4:
        polygons = quads.tolist()
    name, data = write(chance, points, polygons, faces)
    places = points[faces].reshape(-1, 3) * TO_LPS[space] * unit_mm
    return Sample(name, {name: data}, None, f"{space} {unit}", places, refused)


BOX_QUADS = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
Written = tuple[str, bytes]


def _stl(chance: random.Random, points: np.ndarray, _: object, faces: np.ndarray) -> Written:
    head = chance.choice((b"", b"solid box", b"SOLID facet")).ljust(80, b" ")
    rows = [bytes(12) + points[face].astype("<f4").tobytes() + bytes(2) for face in faces]
    return "m.stl", head + struct.pack("<I", len(rows)) + b"".join(rows)


def _text_stl(chance: random.Random, points: np.ndarray, _: object, faces: np.ndarray) -> Written:
    lines = ["solid facet of a box"]
    for face in faces:
        lines += ["  facet normal 0 0 0", "    outer loop"]
        lines += ["      vertex " + " ".join(map(repr, points[i].tolist())) for i in face]
        lines += ["    endloop", "  endfacet"]
    text = "\n".join([*lines, "endsolid", ""])
    return "m.stl", chance.choice((str, str.upper))(text).encode()


def _obj(
    chance: random.Random, points: np.ndarray, polygons: list[list[int]], _: np.ndarray
) -> Written:
    tail = chance.choice(("", "", " 1", " 0.5 0.5 0.5"))
    lines = ["# a box", "mtllib box.mtl", "o box"]
    lines += [" ".join(["v", *map(repr, point)]) + tail for point in points.tolist()]
    lines += ["vn 0 0 1", "vt 0 0", "s off"]
    corner = chance.choice(("{}", "{}/1", "{}//1", "{}/1/1"))
    back = len(points) if chance.random() < 0.3 else -1
    for polygon in polygons:
        words = [corner.format(i - back if back > 0 else i + 1) for i in polygon]
        lines += [("f " if chance.random() < 0.8 else "f \\\n ") + " ".join(words)]
    return "m.obj", (chance.choice(("\n", "\r\n")).join([*lines, ""])).encode()


def _ply(
    chance: random.Random, points: np.ndarray, polygons: list[list[int]], _: np.ndarray
) -> Written:
    kind = chance.choice(("ascii", "binary_little_endian", "binary_big_endian"))
    real, code = chance.choice((("float", "f"), ("float32", "f"), ("double", "d")))
    whole, of_whole = chance.choice((("int", "i"), ("uint32", "I"), ("uchar", "B"), ("short", "h")))
    names = chance.choice((("x", "y", "z"), ("z", "x", "y"), ("x", "nx", "y", "z", "red")))
    has_edges = chance.random() < 0.3
    head = ["ply", f"format {kind} 1.0", "comment a box", f"element vertex {len(points)}"]
    head += [f"property {'uchar' if name == 'red' else real} {name}" for name in names]
    if has_edges:
        head += ["element edge 2", "property int a", "property list uchar float b"]
    head += [
        f"element face {len(polygons)}",
        f"property list uchar {whole} " + chance.choice(("vertex_indices", "vertex_index")),
        "property uchar flags",
    ]
    rows: list[list[tuple[str, float]]] = []
    for point in points.tolist():
        values = dict(zip("xyz", point, strict=True)) | {"nx": 0.25, "red": 200}
        rows.append([("B" if name == "red" else code, values[name]) for name in names])
    rows += [[("i", 7), ("B", 2), ("f", 0.5), ("f", 1.5)]] * 2 * has_edges
    rows += [[("B", len(p)), *((of_whole, i) for i in p), ("B", 1)] for p in polygons]
    start = ("\n".join([*head, "end_header"]) + "\n").encode()
    if kind == "ascii":
        lines = [" ".join(repr(value) for _, value in row) for row in rows]
        return "m.ply", start + ("\n".join(lines) + "\n").encode()
    order = "<" if kind == "binary_little_endian" else ">"
    return "m.ply", start + b"".join(struct.pack(order + c, v) for row in rows for c, v in row)
