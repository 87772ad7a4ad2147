"""Regions from files: what they become, and the one message that each mistake gets."""

from __future__ import annotations

import builtins
import struct
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ntagen import nsl
from ntagen.nsl import SourceError
from ntagen.scene import Scene
from ntagen.shapes import Box, Capsule, Field, Sphere, turning
from tests import anatomy
from tests.anatomy import environment

MIDDLE = (2.0, -20.0, 4.0)
SIZE = (6.0, 4.0, 8.0)
VOXELS = np.zeros((12, 10, 9), dtype=np.uint8)
VOXELS[3:7, 2:8, 4:8] = 1
VOXELS[9, 9, 8] = 7


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """No field is taken from a run before."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.getbasetemp() / "cache"))


def load(folder: Path, *lines: str, frame: str = anatomy.FRAME) -> Scene:
    return nsl.loads(environment(*lines, frame=frame), str(folder / "e.nsl"))


def bounds(scene: Scene) -> np.ndarray:
    return np.array(scene.criticals[0].shape.bounds_mm())


def box_bounds(middle: np.ndarray, size: np.ndarray) -> np.ndarray:
    return np.array([middle - size / 2, middle + size / 2])


# ------------------------------------------------------------------------------------------- meshes

WRITERS: dict[str, Callable[[Path, np.ndarray, np.ndarray], None]] = {
    "m.stl": anatomy.write_stl,
    "text.stl": anatomy.write_text_stl,
    "m.obj": anatomy.write_obj,
    "m.ply": anatomy.write_ply,
}


@pytest.mark.parametrize("name", WRITERS)
def test_meshes_of_all_formats_are_read(name: str, tmp_path: Path) -> None:
    WRITERS[name](tmp_path / name, *anatomy.box(MIDDLE, SIZE))
    scene = load(tmp_path, f'critical C1 mesh "{name}" in LPS mm grid 1 mm')
    shape = scene.criticals[0].shape
    assert isinstance(shape, Field)
    assert np.allclose(bounds(scene), box_bounds(np.array(MIDDLE), np.array(SIZE)), atol=1e-5)
    assert shape.volume_mm3() == pytest.approx(6 * 4 * 8, rel=1e-5)
    assert shape.distance_at_mm(MIDDLE) < -1.0


@pytest.mark.parametrize(("unit", "factor"), [("mm", 1.0), ("cm", 10.0), ("m", 1000.0)])
def test_units_of_meshes_are_lengths(unit: str, factor: float, tmp_path: Path) -> None:
    points, faces = anatomy.box(MIDDLE, SIZE)
    anatomy.write_obj(tmp_path / "m.obj", points / factor, faces)
    scene = load(tmp_path, f'critical C1 mesh "m.obj" in {unit} LPS grid 1 mm')
    assert np.allclose(bounds(scene), box_bounds(np.array(MIDDLE), np.array(SIZE)))


def test_spaces_differ_in_two_signs(tmp_path: Path) -> None:
    anatomy.write_obj(tmp_path / "m.obj", *anatomy.box(MIDDLE, SIZE))
    found = {
        (of_file, of_frame): bounds(
            load(
                tmp_path,
                f'critical C1 mesh "m.obj" in {of_file} mm grid 1 mm',
                frame=anatomy.FRAME.replace("LPS", of_frame),
            )
        ).mean(axis=0)
        for of_file in ("LPS", "RAS")
        for of_frame in ("LPS", "RAS")
    }
    assert np.allclose(found["LPS", "LPS"], MIDDLE)
    assert np.allclose(found["RAS", "RAS"], MIDDLE)
    assert np.allclose(found["RAS", "LPS"], np.array(MIDDLE) * [-1, -1, 1])
    assert np.allclose(found["LPS", "RAS"], np.array(MIDDLE) * [-1, -1, 1])


def test_a_mesh_that_says_its_space_needs_no_words_for_it(tmp_path: Path) -> None:
    anatomy.write_ply(tmp_path / "m.ply", *anatomy.box(MIDDLE, SIZE), comment="SPACE=RAS")
    scene = load(tmp_path, 'critical C1 mesh "m.ply" in mm grid 1 mm')
    assert np.allclose(bounds(scene).mean(axis=0), np.array(MIDDLE) * [-1, -1, 1])


# --------------------------------------------------------------------------------------- transforms

TURN = turning((1.0, 2.0, -0.5), 0.7)
SHIFT = np.array([3.0, -5.0, 2.0])
MATRIX = np.concatenate([np.array(TURN).T, SHIFT[:, None]], axis=1)


def rows_of(matrix: np.ndarray) -> str:
    shown = (f"({a!r}, {b!r}, {c!r}, {d!r} mm)" for a, b, c, d in matrix.tolist())
    return ", ".join(shown).replace("-", " - ").replace("e - ", "e-")


def write_itk(path: Path, matrix: np.ndarray, center: np.ndarray) -> None:
    """The same motion, written about a centre."""
    turn, shift = matrix[:, :3], matrix[:, 3]
    moved = shift - center + turn @ center
    numbers = " ".join(map(repr, [*turn.ravel().tolist(), *moved.tolist()]))
    path.write_text(
        "#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
        f"Parameters: {numbers}\nFixedParameters: {' '.join(map(repr, center.tolist()))}\n",
        "utf-8",
    )


def frames(folder: Path) -> dict[str, str]:
    """The same motion in all the ways in which it can be written."""
    write_itk(folder / "there.tfm", MATRIX, np.array([7.0, 8.0, -9.0]))
    whole = np.vstack([MATRIX, [0, 0, 0, 1]])
    back = np.linalg.inv(whole)
    np.savetxt(folder / "back.txt", back, fmt="%.17g")
    half = np.diag([-1.0, -1.0, 1.0, 1.0])
    return {
        "rows": f"transform from LPS {rows_of(MATRIX)}",
        "rows back": f"transform to LPS {rows_of(back[:3])}",
        "RAS": f"transform from RAS {rows_of((whole @ half)[:3])}",
        "ITK": 'transform from LPS "there.tfm"',
        "text back": 'transform to LPS "back.txt"',
    }


@pytest.mark.parametrize("name", ["rows", "rows back", "RAS", "ITK", "text back"])
def test_transforms_place_imaging_space(name: str, tmp_path: Path) -> None:
    anatomy.write_markups(tmp_path / "p.mrk.json", anatomy.points(("F", MIDDLE)))
    line = 'critical C1 markups "p.mrk.json" radius 1 mm'
    scene = load(tmp_path, line, frame=frames(tmp_path)[name])
    expected = MATRIX[:, :3] @ np.array(MIDDLE) + SHIFT
    assert np.allclose(scene.criticals[0].center_mm, expected)


# ------------------------------------------------------------------------------------ segmentations


def voxel_bounds(affine: np.ndarray) -> np.ndarray:
    """The bounds of the part with label 1, whose voxels go along the axes."""
    ends = np.array([[2.5, 1.5, 3.5], [6.5, 7.5, 7.5]])
    placed = ends @ affine[:3, :3].T + affine[:3, 3]
    return np.array([placed.min(axis=0), placed.max(axis=0)])


def test_segments_are_found_by_their_names(tmp_path: Path) -> None:
    rows = ((1.5, 0, 0), (0, 1, 0), (0, 0, 2))
    anatomy.write_nrrd(
        tmp_path / "s.seg.nrrd",
        VOXELS,
        directions=rows,
        origin=(-5.0, -20.0, 1.0),
        segments=[("dot", 7), ("tumor", 1)],
    )
    scene = load(tmp_path, 'critical C1 segmentation "s.seg.nrrd" segment "tumor" grid 1 mm')
    affine = np.concatenate([np.diag([1.5, 1, 2]), [[-5], [-20], [1]]], axis=1)
    assert np.allclose(bounds(scene), voxel_bounds(affine))
    assert scene.criticals[0].shape.volume_mm3() == pytest.approx(4 * 6 * 4 * 3.0)
    dot = load(tmp_path, 'critical C1 segmentation "s.seg.nrrd" label 7 grid 1 mm')
    assert dot.criticals[0].shape.volume_mm3() == pytest.approx(3.0)


@pytest.mark.parametrize("axis", [0, 1, 2, 3])
def test_segments_in_layers_are_found(axis: int, tmp_path: Path) -> None:
    """Segments that overlap have a layer each; the axis without a direction counts them."""
    layers = np.stack([VOXELS == 1, VOXELS == 7], axis=axis).astype(np.uint8)
    names = [("tumor", 1, 0), ("dot", 1, 1)]
    anatomy.write_nrrd(tmp_path / "s.seg.nrrd", layers, segments=names, layers=axis)
    line = 'critical C1 segmentation "s.seg.nrrd" segment "{}" grid 1 mm'
    for name, volume in (("tumor", 4 * 6 * 4), ("dot", 1)):
        scene = load(tmp_path, line.format(name))
        assert scene.criticals[0].shape.volume_mm3() == pytest.approx(volume)
    load(tmp_path, line.format("tumor"))
    assert np.allclose(bounds(load(tmp_path, line.format("tumor"))), voxel_bounds(np.eye(4)))


@pytest.mark.parametrize("space", ["left-anterior-superior", "LAS", "Left-Anterior-Superior"])
def test_what_is_left_stays_left(space: str, tmp_path: Path) -> None:
    """In LAS only y is turned round on the way to LPS: x goes to the left in both."""
    anatomy.write_nrrd(tmp_path / "s.nrrd", VOXELS, space=space, origin=(20, 10, -20))
    scene = load(tmp_path, 'critical C1 segmentation "s.nrrd" label 1 grid 1 mm')
    to_lps = np.diag([1.0, -1, 1])
    affine = np.concatenate([to_lps, to_lps @ [[20], [10], [-20]]], axis=1)
    assert np.allclose(bounds(scene), voxel_bounds(affine))


def test_voxels_beside_their_header_are_read(tmp_path: Path) -> None:
    """A change of the voxels alone is a change of the scene: no field is taken from the cache."""
    line = 'critical C1 segmentation "s.nhdr" label 1 grid 1 mm'
    path = tmp_path / "s.nhdr"
    anatomy.write_nrrd(path, VOXELS, data_file="s.raw.gz")
    header = path.read_bytes()
    assert np.allclose(bounds(load(tmp_path, line)), voxel_bounds(np.eye(4)))
    anatomy.write_nrrd(path, VOXELS[::-1], data_file="s.raw.gz")
    assert path.read_bytes() == header
    assert not np.allclose(bounds(load(tmp_path, line)), voxel_bounds(np.eye(4)))


@pytest.mark.parametrize(("words", "x"), [("qform", 40.0), ("sform", 0.0)])
def test_a_matrix_of_nifti_can_be_named(words: str, x: float, tmp_path: Path) -> None:
    nifti(qform_at=(40.0, 0.0, 0.0))(tmp_path)
    scene = load(tmp_path, LABEL.replace("label", f"in RAS {words} label"))
    affine = np.diag([-1.0, -1, 1]) @ np.concatenate([np.eye(3), [[x], [0], [0]]], axis=1)
    assert np.allclose(bounds(scene), voxel_bounds(affine))


def test_names_in_any_script_are_found(tmp_path: Path) -> None:
    seg(segments=[("Gefäß", 1), ("Gefß", 7)])(tmp_path)
    scene = load(tmp_path, SEGMENT.replace("tumor", "Gefäß"))
    assert scene.criticals[0].shape.volume_mm3() == pytest.approx(4 * 6 * 4)


def test_a_text_in_capitals_is_read(tmp_path: Path) -> None:
    points, faces = anatomy.box(MIDDLE, SIZE)
    anatomy.write_text_stl(tmp_path / "m.stl", points, faces)
    path = tmp_path / "m.stl"
    path.write_text(path.read_text("utf-8").upper(), "utf-8")
    assert np.allclose(bounds(load(tmp_path, STL)), box_bounds(np.array(MIDDLE), np.array(SIZE)))


def test_a_mesh_that_moves_has_a_larger_grid(tmp_path: Path) -> None:
    mesh()(tmp_path)
    rest = load(tmp_path, MESH).criticals[0].shape
    moving = load(tmp_path, MESH + " moves 6 mm along +z every 4 s").criticals[0]
    assert isinstance(rest, Field)
    assert isinstance(moving.shape, Field)
    assert moving.motion is not None
    assert moving.shape.extent_mm[2] == pytest.approx(rest.extent_mm[2] + 12.0)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("name", ["s.nii", "s.nii.gz"])
def test_nifti_is_in_ras(name: str, mirrored: bool, tmp_path: Path) -> None:
    """Voxels that are counted from the other side are no mirrored anatomy."""
    affine = np.concatenate([np.diag([-1.0 if mirrored else 1.0, 1, 1]), [[2], [19], [1]]], axis=1)
    anatomy.write_nifti(tmp_path / name, VOXELS, affine)
    line = f'critical C1 segmentation "{name}" label 1 grid 1 mm'
    scene = load(tmp_path, line)
    expected = voxel_bounds(np.diag([-1, -1, 1]) @ affine)
    assert np.allclose(bounds(scene), expected)


# ------------------------------------------------------------------------------------------ markups


def test_points_lines_and_boxes_become_shapes(tmp_path: Path) -> None:
    turn = np.array(TURN).T
    roi = {"type": "ROI", "coordinateSystem": "RAS", "center": [1.0, 20.0, 3.0], "size": [4, 5, 6]}
    anatomy.write_markups(
        tmp_path / "p.mrk.json",
        anatomy.points(("A", (9.0, -20.0, 0.0)), ("B", (-9.0, -20.0, 0.0))),
        anatomy.points(("a", (0, -9, 9)), ("b", (2, -9, 9)), kind="Line"),
        roi | {"orientation": turn.ravel().tolist()},
    )
    scene = load(
        tmp_path,
        'critical M markups "p.mrk.json" radius 1 mm',
        'unexplored U markups "p.mrk.json" point "B" radius 3 mm',
        "detection D around M[3] margin 2 mm",
    )
    assert [region.name for region in scene.criticals] == ["M[1]", "M[2]", "M[3]", "M[4]"]
    one, two, line, box = (region.shape for region in scene.criticals)
    assert one == Sphere((9.0, -20.0, 0.0), 1.0)
    assert two == Sphere((-9.0, -20.0, 0.0), 1.0)
    assert line == Capsule((0.0, -9.0, 9.0), (2.0, -9.0, 9.0), 1.0, 1.0)
    assert isinstance(box, Box)
    assert box.middle_mm == pytest.approx((-1.0, -20.0, 3.0))
    assert np.allclose(np.array(box.axes), (np.diag([-1, -1, 1]) @ turn).T)
    assert scene.unexplored[0].shape == Sphere((-9.0, -20.0, 0.0), 3.0)
    assert scene.detections[0].shape == line.grown(2.0)


def test_targets_from_points_are_visited_in_their_order(tmp_path: Path) -> None:
    places = [("first", (0.0, -30.0, 0.0)), ("second", (0.0, -50.0, 0.0))]
    anatomy.write_markups(tmp_path / "p.mrk.json", anatomy.points(*places))
    scene = load(tmp_path, 'target T markups "p.mrk.json" radius 4 mm')
    assert [target.center_mm[1] for target in scene.targets] == [-30.0, -50.0]


# ----------------------------------------------------------------------------------------- mistakes

Prepare = Callable[[Path], None]


def mesh(name: str = "m.obj", change: Callable[..., object] | None = None) -> Prepare:
    def prepare(folder: Path) -> None:
        points, faces = anatomy.box(MIDDLE, SIZE)
        if change is not None:
            points, faces = change(points, faces)
        WRITERS[name](folder / name, points, faces)

    return prepare


def text(name: str, content: str | bytes) -> Prepare:
    data = content.encode() if isinstance(content, str) else content
    return lambda folder: (folder / name).write_bytes(data) and None


def many_triangles(folder: Path) -> None:
    """Ten million are announced; the rest of the file is a hole."""
    with (folder / "m.stl").open("wb") as file:
        file.write(b" " * 80 + struct.pack("<I", 10_000_000))
        file.truncate(84 + 50 * 10_000_000)


def many_faces(folder: Path) -> None:
    head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    head += "property float z\nelement face 10000000\nproperty list uchar int vertex_indices\n"
    (folder / "m.ply").write_text(head + "end_header\n", "utf-8")


def two_boxes(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A box, and a smaller one beside it that is turned inside out."""
    other = (points - np.array(MIDDLE)) * 0.5 + np.array(MIDDLE) + [8, 0, 0]
    return np.vstack([points, other]), np.vstack([faces, faces[:, ::-1] + 8])


def seg(**changes: object) -> Prepare:
    voxels = changes.pop("voxels", VOXELS)
    segments = changes.pop("segments", [("tumor", 1), ("vessel", 2)])

    def prepare(folder: Path) -> None:
        anatomy.write_nrrd(folder / "s.nrrd", voxels, segments=segments, **changes)  # type: ignore[arg-type]

    return prepare


def nifti(affine: np.ndarray | None = None, **changes: int) -> Prepare:
    grid = np.eye(4) if affine is None else affine
    return lambda folder: anatomy.write_nifti(folder / "s.nii", VOXELS, grid, **changes)


def extra(folder: Path) -> None:
    """A binary STL file with seven bytes too many."""
    mesh("m.stl")(folder)
    path = folder / "m.stl"
    path.write_bytes(path.read_bytes() + b"ntagen!")


def solid(change: Callable[[list[str]], list[str]]) -> Prepare:
    """A text STL file with changed lines."""

    def prepare(folder: Path) -> None:
        mesh("text.stl")(folder)
        lines = (folder / "text.stl").read_text("utf-8").splitlines()
        (folder / "m.stl").write_text("\n".join(change(lines)), "utf-8")

    return prepare


def ply(old: str, new: str) -> Prepare:
    """A text PLY file with a change."""

    def prepare(folder: Path) -> None:
        mesh("m.ply")(folder)
        text = (folder / "m.ply").read_text("utf-8")
        assert old in text
        (folder / "m.ply").write_text(text.replace(old, new, 1), "utf-8")

    return prepare


def header_alone(folder: Path) -> None:
    """The header of a file whose voxels are lost."""
    anatomy.write_nrrd(folder / "s.nhdr", VOXELS, data_file="s.raw")
    (folder / "s.raw").unlink()


def two_layers(*segments: tuple[str, int, int]) -> Prepare:
    """Two layers with the same number."""
    layers = np.stack([VOXELS == 1, VOXELS == 7]).astype(np.uint8)
    return seg(voxels=layers, layers=0, segments=segments)


def marks(*lists: dict[str, object]) -> Prepare:
    return lambda folder: anatomy.write_markups(folder / "p.mrk.json", *lists)


MESH = 'critical C1 mesh "m.obj" in LPS mm grid 1 mm'
STL = 'critical C1 mesh "m.stl" in LPS mm'
SEGMENT = 'critical C1 segmentation "s.nrrd" segment "tumor" grid 1 mm'
PLY = 'critical C1 mesh "m.ply" in LPS mm grid 1 mm'
HEADER = 'critical C1 segmentation "s.nhdr" label 1 grid 1 mm'
LABEL = 'critical C1 segmentation "s.nii" label 1 grid 1 mm'
MARKS = 'critical C1 markups "p.mrk.json" radius 1 mm'
POINT = anatomy.points(("F-1", MIDDLE))

MISTAKES: dict[str, tuple[Prepare, str, str, str, str]] = {
    "missing file": (lambda _: None, MESH, "N001", "there is no file", "folder of the"),
    "folder": (lambda f: (f / "m.obj").mkdir(), MESH, "N002", "cannot read", "name a file"),
    "empty file": (text("m.obj", ""), MESH, "N005", "is empty", "once more"),
    "no triangles": (text("m.obj", "v 0 0 0\n"), MESH, "N101", "has no triangles", "surface"),
    "no mesh": (text("m.stl", "hello"), STL, "N101", "is no STL file", "once more"),
    "unknown ending": (
        text("m.off", "OFF"),
        'critical C1 mesh "m.off" in LPS mm',
        "N101",
        "no mesh",
        ".stl, .obj or .ply",
    ),
    "outside of the folder": (
        lambda _: None,
        'critical C1 mesh "../m.obj" in LPS mm',
        "N044",
        "not below",
        "--include",
    ),
    "hole": (mesh(change=lambda p, f: (p, f[:-1])), MESH, "N103", "not closed: 3 edges", "holes"),
    "flat": (mesh(change=lambda p, f: (p * [1, 1, 0], f)), MESH, "N103", "no volume", "closed"),
    "inverted": (mesh(change=lambda p, f: (p, f[:, ::-1])), MESH, "N104", "inwards", "flip"),
    "one triangle turned": (
        mesh(change=lambda p, f: (p, np.vstack([f[:1, ::-1], f[1:]]))),
        MESH,
        "N104",
        "3 edges",
        "consistent",
    ),
    "one part inverted": (mesh(change=two_boxes), MESH, "N104", "inwards", "flip"),
    "NaN": (
        mesh("m.stl", lambda p, f: (p * [np.nan, 1, 1], f)),
        STL,
        "N101",
        "not finite numbers",
        "once more",
    ),
    "ten million triangles": (many_triangles, STL, "N102", "10,000,000 triangles", "decimate"),
    "ten million faces": (
        many_faces,
        'critical C1 mesh "m.ply" in LPS mm',
        "N102",
        "10,000,000 triangles",
        "decimate",
    ),
    "a triangle twice": (
        mesh(change=lambda p, f: (p, np.vstack([f, f[:1]]))),
        MESH,
        "N103",
        "repeats 1 of its triangles",
        "remove the copies",
    ),
    "bytes behind the last triangle": (
        extra,
        STL,
        "N101",
        "7 bytes behind the last of its 12 triangles",
        "longer file",
    ),
    "STL cut off": (
        text("m.stl", b" " * 80 + b"\x0c\0\0\0" + b"\0" * 100),
        STL,
        "N101",
        "12 triangles, and has bytes for 2",
        "cut off",
    ),
    "facet of four": (
        solid(lambda lines: [*lines[:3], lines[3], *lines[3:]]),
        STL,
        "N101",
        "4 corners in line 8",
        "once more",
    ),
    "facet without an end": (solid(lambda lines: lines[:6]), STL, "N101", "ends in", "cut off"),
    "line of no STL": (
        solid(lambda lines: [*lines[:2], "vertices 1 2 3", *lines[3:]]),
        STL,
        "N101",
        "`vertices 1 2 3` cannot stand in line 3",
        "once more",
    ),
    "point of OBJ that is not there": (
        text("m.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n"),
        MESH,
        "N101",
        "point 2 (counted from 0), and 2 points",
        "once more",
    ),
    "point 0 of OBJ": (text("m.obj", "v 0 0 0\nf 0 1 1\n"), MESH, "N101", "point `0`", "once"),
    "huge point of OBJ": (
        text("m.obj", "v 0 0 0\nf 1 1 99999999999999999999\n"),
        MESH,
        "N101",
        "point 99999999999999999998 in line 2",
        "once more",
    ),
    "number of OBJ": (text("m.obj", "v 0 0 zero\n"), MESH, "N101", "`0 0 zero`", "once"),
    "curve of OBJ": (text("m.obj", "curv 0 1 1 2\n"), MESH, "N101", "line 1: `curv", "once"),
    "point of PLY that is not there": (
        ply("3 0 1 3", "3 0 1 8"),
        PLY,
        "N101",
        "point 8 (counted from 0), and 8 points",
        "once more",
    ),
    "a billion points": (
        ply("vertex 8", "vertex 1000000000000"),
        PLY,
        "N102",
        "1,000,000,000,000 points, more than",
        "decimate",
    ),
    "too few lines of PLY": (ply("vertex 8", "vertex 900"), PLY, "N101", "is too short", "cut off"),
    "too many lines of PLY": (ply("face 12", "face 11"), PLY, "N101", "has more lines", "once"),
    "far away": (
        mesh(change=lambda p, f: (p * 1e200, f)),
        MESH,
        "N101",
        "units away from its origin",
        "once more",
    ),
    "grid too fine": (
        mesh(),
        MESH.replace("1 mm", "0.05 mm"),
        "N102",
        "more than 2,097,152",
        "write for example `grid 0.",
    ),
    "space not said": (
        mesh(),
        'critical C1 mesh "m.obj" in mm',
        "N105",
        "LPS or in RAS",
        "`in LPS` or `in RAS`",
    ),
    "space contradicted": (
        lambda f: anatomy.write_stl(f / "m.stl", *anatomy.box(MIDDLE, SIZE), b"SPACE=RAS"),
        STL,
        "N105",
        "says that it is in RAS",
        "`in RAS`",
    ),
    "unit missing": (
        mesh(),
        'critical C1 mesh "m.obj" in RAS',
        "N106",
        "in which unit",
        "`in RAS mm`",
    ),
    "segment not there": (
        seg(),
        SEGMENT.replace("tumor", "tumour"),
        "N107",
        "no segment `tumour`",
        "did you mean `tumor`?",
    ),
    "no segment named": (
        seg(),
        'critical C1 segmentation "s.nrrd"',
        "N107",
        "nothing says which part",
        "`tumor`, `vessel`",
    ),
    "segment without voxels": (
        seg(),
        SEGMENT.replace("tumor", "vessel"),
        "N107",
        "no voxel",
        "viewer",
    ),
    "no names": (seg(segments=[]), SEGMENT, "N107", "no named segments", "label 1"),
    "label not there": (nifti(), LABEL.replace("label 1", "label 3"), "N107", "no voxel", "viewer"),
    "segment of NIfTI": (
        nifti(),
        LABEL.replace("label 1", 'segment "tumor"'),
        "N107",
        "numbers, not names",
        "label 1",
    ),
    "spacing 0": (
        seg(directions=((1, 0, 0), (0, 0, 0), (0, 0, 1))),
        SEGMENT,
        "N108",
        "spacing",
        "greater than 0",
    ),
    "skewed directions": (
        seg(directions=((1, 0.5, 0), (0, 1, 0), (0, 0, 1))),
        SEGMENT,
        "N108",
        "skews",
        "right angles",
    ),
    "flat directions": (
        seg(directions=((1, 0, 0), (1, 0, 0), (0, 0, 1))),
        SEGMENT,
        "N108",
        "flat",
        "right angles",
    ),
    "flat affine": (nifti(np.diag([1.0, 1, 0, 1])), LABEL, "N108", "spacing", "greater than 0"),
    "no affine": (nifti(sform=0), LABEL, "N108", "neither an sform", "geometry"),
    "NRRD without space": (seg(space=""), SEGMENT, "N105", "LPS or in RAS", "`in LPS`"),
    **{
        f"space {name}": (seg(space=name), SEGMENT, "N105", f"`space: {name}`", "save it in left")
        for name in ("scanner-xyz", "3D-left-handed", "scanner-xyz-time", "left-superior")
    },
    "space without sides": (
        seg(space="3D-right-handed"),
        SEGMENT,
        "N105",
        "LPS or in RAS; it says `space: 3D-right-handed`",
        "`in LPS`",
    ),
    "LAS contradicted": (
        seg(space="LAS"),
        SEGMENT.replace("segment ", "in RAS segment "),
        "N105",
        "says that it is in LAS, and this says RAS",
        "leave out `RAS`; what is in LAS is brought to LPS",
    ),
    "two units": (
        seg(more=['space units: "mm" "cm" "mm"']),
        SEGMENT,
        "N106",
        '`space units: "mm" "cm" "mm"`',
        "save it in mm",
    ),
    "spacings that disagree": (
        seg(more=["spacings: 1 2 1"]),
        SEGMENT,
        "N101",
        "`spacings: 1 2 1` in",
        "remove the field",
    ),
    "field twice": (seg(more=["encoding: raw"]), SEGMENT, "N101", "`encoding` stands", "remove"),
    "no field of NRRD": (
        seg(more=["Segment0_Name: tumor"]),
        SEGMENT,
        "N101",
        "`Segment0_Name: tumor` in the header",
        "`:=` if it is a key",
    ),
    "two layers with a number": (
        two_layers(("tumor", 1, 0), ("dot", 1, 1)),
        SEGMENT.replace('segment "tumor"', "label 1"),
        "N107",
        "2 layers of",
        "those with this number are `tumor`, `dot`",
    ),
    "two segments with a name": (
        two_layers(("tumor", 1, 0), ("tumor", 1, 1)),
        SEGMENT,
        "N107",
        "2 segments with the name `tumor`",
        "another name",
    ),
    "two segments with a number": (
        seg(segments=[("tumor", 1), ("rest", 1)]),
        SEGMENT,
        "N107",
        "`tumor` and `rest` of",
        "in Slicer",
    ),
    "layer that is not there": (
        two_layers(("tumor", 1, 2)),
        SEGMENT,
        "N107",
        "`Segment0_Layer`",
        "in Slicer",
    ),
    "voxels in another folder": (
        text(
            "s.nhdr",
            "NRRD0004\ntype: uchar\ndimension: 3\nspace: LPS\nsizes: 1 1 1\n"
            "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
            "encoding: raw\ndata file: ../s.raw\n",
        ),
        HEADER,
        "N101",
        "`data file: ../s.raw` in",
        "data attached",
    ),
    "voxels that are missing": (header_alone, HEADER, "N001", "s.raw", "folder"),
    "too few voxels": (
        text(
            "s.nrrd",
            "NRRD0004\ntype: uchar\ndimension: 3\nspace: LPS\nsizes: 9 9 9\n"
            "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
            "encoding: raw\n\n12345",
        ),
        SEGMENT.replace('segment "tumor"', "label 1"),
        "N101",
        "fewer voxels than its sizes say (9 x 9 x 9)",
        "cut off",
    ),
    "10^12 voxels": (
        text(
            "s.nrrd",
            "NRRD0004\ntype: uchar\ndimension: 3\nspace: LPS\nsizes: 9999 9999 9999\n"
            "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
            "encoding: raw\n\n12345",
        ),
        SEGMENT.replace('segment "tumor"', "label 1"),
        "N102",
        "999,700,029,999 voxels",
        "coarser",
    ),
    "matrices that disagree": (
        nifti(qform_at=(40.0, 0.0, 0.0)),
        LABEL,
        "N111",
        "place the same voxel up to 40 mm apart",
        "`in qform` or `in sform`",
    ),
    "qform that is not there": (
        nifti(),
        LABEL.replace("label", "in qform label"),
        "N108",
        "it has no qform",
        "geometry",
    ),
    "qform of NRRD": (
        seg(),
        SEGMENT.replace("segment ", "in qform segment "),
        "N111",
        "has no qform",
        "leave out",
    ),
    "unit of NIfTI not said": (nifti(units=0), LABEL, "N106", "in which unit", "`in mm`"),
    "unknown unit of NIfTI": (nifti(units=5), LABEL, "N106", "`xyzt_units` in", "in mm"),
    "unit contradicted": (
        nifti(),
        LABEL.replace("label 1", "in cm label 1"),
        "N106",
        "its unit is 1 mm",
        "leave the unit out",
    ),
    "damaged NRRD": (text("s.nrrd", "NRRD0004\ntype: x\n"), SEGMENT, "N101", "`sizes`", "once"),
    "damaged NIfTI": (text("s.nii", b"\0" * 400), LABEL, "N101", "no NIfTI", "once more"),
    "point not there": (
        marks(POINT),
        MARKS.replace("radius", 'point "F-2" radius'),
        "N107",
        "no point `F-2`",
        "did you mean `F-1`?",
    ),
    "no radius": (
        marks(POINT),
        'critical C1 markups "p.mrk.json"',
        "N107",
        "no thickness",
        "radius 2 mm",
    ),
    "no points": (marks(anatomy.points()), MARKS, "N107", "has no points", "place the points"),
    "markups without space": (
        marks(POINT | {"coordinateSystem": None}),
        MARKS,
        "N105",
        "LPS",
        "in",
    ),
    "NaN in markups": (
        text(
            "p.mrk.json", '{"markups": [{"type": "ROI", "center": [NaN, 0, 0], "size": [1, 1, 1]}]}'
        ),
        MARKS,
        "N101",
        "not finite",
        "once more",
    ),
    "no JSON": (text("p.mrk.json", "{"), MARKS, "N101", "no file of markups", "once more"),
    "angle": (marks(POINT | {"type": "Angle"}), MARKS, "N101", "kind Angle", "lines"),
}


def mistake(folder: Path, *lines: str, frame: str = anatomy.FRAME) -> nsl.Diagnostic:
    """The only diagnostic of an environment."""
    with pytest.raises(SourceError) as caught:
        load(folder, *lines, frame=frame)
    (found,) = caught.value.diagnostics
    return found


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_gets_one_message(name: str, tmp_path: Path) -> None:
    prepare, line, code, message, hint = MISTAKES[name]
    prepare(tmp_path)
    found = mistake(tmp_path, line)
    assert found.code == code
    assert message in found.message
    assert found.hint is not None
    assert hint in found.hint
    assert found.line == 4


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("target T1 sphere (2, -20, 4) mm radius 1 mm", "N076"),
        ('unexplored U1 mesh "m.obj" in LPS mm grid 1 mm', "N080"),
    ],
)
def test_what_lies_in_a_mesh_is_seen(line: str, code: str, tmp_path: Path) -> None:
    """A target in a rib is an error; a tip in something unexplored is a warning."""
    mesh()(tmp_path)
    if code == "N076":
        assert mistake(tmp_path, MESH, line).code == code
        return
    frame = anatomy.FRAME.replace(
        "0, 0 mm), (0, 1, 0, 0 mm), (0, 0, 1, 0", "0, -2 mm), (0, 1, 0, 20 mm), (0, 0, 1, -4"
    )
    task = nsl.loads_task(environment(line, frame=frame), str(tmp_path / "e.nsl"))
    assert [warning.code for warning in task.warnings] == [code]


FRAMES: dict[str, tuple[str, str, str]] = {
    "scaled": (anatomy.FRAME.replace("(1, 0", "(1.01, 0"), "N108", "scales"),
    "huge": (anatomy.FRAME.replace("(1, 0", "(1e200, 0"), "N108", "flat"),
    "mirrored": (anatomy.FRAME.replace("(1, 0", "(-1, 0"), "N108", "mirrors"),
    "flat": (anatomy.FRAME.replace("(0, 1", "(0, 0"), "N108", "flat"),
    "two rows": ("transform from LPS (1, 0, 0, 0 mm), (0, 1, 0, 0 mm)", "N037", "three or four"),
    "three components": (anatomy.FRAME.replace("0, 0 mm)", "0)", 1), "N037", "four components"),
    "no unit": (anatomy.FRAME.replace(" mm", "", 1), "N031", "unit"),
    "unknown space": (anatomy.FRAME.replace("LPS", "XYZ"), "N025", "XYZ"),
    "unknown direction": (anatomy.FRAME.replace("from", "into"), "N025", "into"),
    "missing file": ('transform from LPS "no.tfm"', "N001", "no file"),
    "RAS of ITK": ('transform from RAS "there.tfm"', "N105", "LPS by its standard"),
    "numbers": ('transform from RAS "short.txt"', "N101", "3 numbers"),
    "scaled file": ('transform from RAS "scaled.txt"', "N108", "scales"),
    "NaN": ('transform from RAS "nan.txt"', "N108", "not finite"),
}


@pytest.mark.parametrize("name", FRAMES)
def test_a_transform_that_is_wrong_gets_one_message(name: str, tmp_path: Path) -> None:
    frame, code, message = FRAMES[name]
    frames(tmp_path)
    (tmp_path / "short.txt").write_text("1 2 3\n", "utf-8")
    (tmp_path / "scaled.txt").write_text("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n", "utf-8")
    (tmp_path / "nan.txt").write_text("nan 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", "utf-8")
    marks(POINT)(tmp_path)
    found = mistake(tmp_path, MARKS, frame=frame)
    assert found.code == code
    assert message in found.message
    assert found.line == 3


def test_without_a_transform_nothing_is_guessed(tmp_path: Path) -> None:
    mesh()(tmp_path)
    found = mistake(tmp_path, MESH, frame="")
    assert found.code == "N109"
    assert found.hint is not None
    assert "transform from LPS" in found.hint


def test_a_package_that_is_missing_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nifti()(tmp_path)
    monkeypatch.setitem(sys.modules, "nibabel", None)
    # A field that is in the cache needs no package.
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    found = mistake(tmp_path, LABEL)
    assert found.code == "N100"
    assert "package nibabel," in found.message
    assert found.hint == "install it with `python -m pip install 'ntagen[imaging]'`"


def test_little_is_read_of_a_mesh_that_is_too_large(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    many_triangles(tmp_path)
    monkeypatch.setattr("ntagen.imaging.reading.read_file", builtins.exit)
    assert mistake(tmp_path, STL).code == "N102"


def test_a_changed_file_gives_a_changed_scene(tmp_path: Path) -> None:
    mesh()(tmp_path)
    before = load(tmp_path, MESH)
    assert load(tmp_path, MESH) == before
    mesh(change=lambda p, f: (p + np.array([0.25, 0, 0]), f))(tmp_path)
    after = load(tmp_path, MESH)
    assert after != before
    assert after.criticals[0].shape.bounds_mm()[0][0] == pytest.approx(MIDDLE[0] - 3.0 + 0.25)


def test_words_of_files_are_names_elsewhere(tmp_path: Path) -> None:
    text = environment(
        "let grid = 3 mm",
        "critical mesh sphere (0, -20, 0) mm radius grid",
        "critical label box (9, -20, 0) mm size (1, 1, 1) * grid",
        "detection point around mesh margin grid",
    )
    scene = nsl.loads(text, str(tmp_path / "e.nsl"))
    assert [region.name for region in scene.avoided] == ["mesh", "label", "point"]


def test_the_layout_of_regions_from_files() -> None:
    text = environment(
        'critical C1 mesh   "m.obj" in LPS  mm grid 1   mm',
        'target T segmentation "s.seg.nrrd" segment "a b"',
        frame='transform from   LPS "a.tfm"',
    )
    written = nsl.format_text(text)
    assert 'critical C1  mesh "m.obj" in LPS mm  grid 1 mm\n' in written
    assert 'segmentation "s.seg.nrrd"  segment "a b"\n' in written
    assert '  transform from LPS "a.tfm"\n' in written
    assert nsl.format_text(written) == written
