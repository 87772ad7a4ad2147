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


def test_segments_in_layers_are_found(tmp_path: Path) -> None:
    """Segments that overlap have a layer each, as in files of Slicer."""
    layers = np.stack([VOXELS == 1, VOXELS == 7]).astype(np.uint8)
    path = tmp_path / "s.seg.nrrd"
    anatomy.write_nrrd(path, layers, segments=[("tumor", 1), ("dot", 1)])
    data = path.read_bytes().replace(b"space directions: ", b"space directions: none ")
    data = data.replace(b"kinds: ", b"kinds: list ").replace(b"1_Layer:=0", b"1_Layer:=1")
    path.write_bytes(data)
    line = 'critical C1 segmentation "s.seg.nrrd" segment "{}" grid 1 mm'
    for name, volume in (("tumor", 4 * 6 * 4), ("dot", 1)):
        scene = load(tmp_path, line.format(name))
        assert scene.criticals[0].shape.volume_mm3() == pytest.approx(volume)


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


def marks(*lists: dict[str, object]) -> Prepare:
    return lambda folder: anatomy.write_markups(folder / "p.mrk.json", *lists)


MESH = 'critical C1 mesh "m.obj" in LPS mm grid 1 mm'
STL = 'critical C1 mesh "m.stl" in LPS mm'
SEGMENT = 'critical C1 segmentation "s.nrrd" segment "tumor" grid 1 mm'
LABEL = 'critical C1 segmentation "s.nii" label 1 grid 1 mm'
MARKS = 'critical C1 markups "p.mrk.json" radius 1 mm'
POINT = anatomy.points(("F-1", MIDDLE))

MISTAKES: dict[str, tuple[Prepare, str, str, str, str]] = {
    "missing file": (lambda _: None, MESH, "N001", "there is no file", "folder of the"),
    "folder": (lambda f: (f / "m.obj").mkdir(), MESH, "N002", "cannot read", "name a file"),
    "empty file": (text("m.obj", ""), MESH, "N005", "is empty", "once more"),
    "no triangles": (text("m.obj", "v 0 0 0\n"), MESH, "N101", "has no triangles", "surface"),
    "no mesh": (text("m.stl", "hello"), STL, "N101", "has no triangles", "surface"),
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
        "`in LPS mm`",
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
    "unit of NIfTI not said": (nifti(units=0), LABEL, "N106", "in which unit", "mm"),
    "unit contradicted": (
        nifti(),
        LABEL.replace("label 1", "in cm label 1"),
        "N106",
        "its unit is 1 mm",
        "leave the unit out",
    ),
    "damaged NRRD": (text("s.nrrd", "NRRD0004\ntype: x\n"), SEGMENT, "N101", "no NRRD", "once"),
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


@pytest.mark.parametrize(
    ("module", "package", "line"),
    [("trimesh", "trimesh", MESH), ("nrrd", "pynrrd", SEGMENT), ("nibabel", "nibabel", LABEL)],
)
def test_a_package_that_is_missing_is_named(
    module: str, package: str, line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for prepare in (mesh(), seg(), nifti()):
        prepare(tmp_path)
    monkeypatch.setitem(sys.modules, module, None)
    # A field that is in the cache needs no package.
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    found = mistake(tmp_path, line)
    assert found.code == "N100"
    assert f"package {package}," in found.message
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
