"""Files of points, and the file of a registration."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.errors import InputError
from ntagen.tracking.frames import LPS, RAS
from ntagen.tracking.points import Points, pair, read_points
from ntagen.tracking.registration import Pairs, register
from ntagen.tracking.transform_file import read_transform, to_json

FCSV = """\
# Markups fiducial file version = 4.10
# CoordinateSystem = {frame}
# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID
vtkMRMLMarkupsFiducialNode_0,1.5,-2,3e1,0,0,0,1,1,1,0,F-1,,
vtkMRMLMarkupsFiducialNode_1,4,5,6,0,0,0,1,1,1,0,"F, two",,
"""


def read(tmp_path: Path, name: str, text: str, *frames: str) -> list[Points]:
    path = tmp_path / name
    path.write_text(text)
    return read_points(path, iter(frames))


@pytest.mark.parametrize(
    ("word", "frame"), [("0", RAS), ("1", LPS), ("RAS", RAS), ("LPS", LPS), ("lps", LPS)]
)
def test_markups_of_slicer_name_their_frame(tmp_path: Path, word: str, frame: str) -> None:
    (points,) = read(tmp_path, "p.fcsv", FCSV.format(frame=word))
    assert points == Points(frame, {"F-1": (1.5, -2.0, 30.0), "F, two": (4.0, 5.0, 6.0)})


def test_a_frame_of_voxels_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"p.fcsv:2: the coordinate system 2 is neither"):
        read(tmp_path, "p.fcsv", FCSV.format(frame=2))


def test_a_file_that_does_not_name_its_frame_is_never_guessed(tmp_path: Path) -> None:
    text = "\n".join(FCSV.splitlines()[2:])
    with pytest.raises(InputError, match="does not say in which frame"):
        read(tmp_path, "p.fcsv", text)
    (points,) = read(tmp_path, "p.fcsv", text, "ras")
    assert points.frame == RAS
    with pytest.raises(InputError, match="does not say in which frame"):
        read(tmp_path, "p.csv", "name,x_mm,y_mm,z_mm\nA,1,2,3\n")


def markups(**changes: Any) -> str:  # noqa: ANN401
    point = {"id": "1", "label": "F-1", "position": [1.0, 2.0, 3.0], "positionStatus": "defined"}
    one = {"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": [point], **changes}
    return json.dumps({"markups": [one]})


def test_new_markups_of_slicer(tmp_path: Path) -> None:
    (points,) = read(tmp_path, "p.mrk.json", markups())
    assert points == Points(LPS, {"F-1": (1.0, 2.0, 3.0)})
    (points,) = read(tmp_path, "p.mrk.json", markups(coordinateUnits=["m", "m", "m"]))
    assert points.positions_mm["F-1"] == (1000.0, 2000.0, 3000.0)
    (points,) = read(tmp_path, "p.mrk.json", markups(coordinateSystem=None), "LPS")
    assert points.frame == LPS


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("{", "this is not JSON"),
        ("[" * 100_000, "this is not JSON"),
        ("[]", "not one list of points"),
        ('{"markups": []}', "not one list of points"),
        (markups(coordinateSystem="IJK"), "IJK is neither RAS nor LPS"),
        (markups(coordinateUnits="furlong"), "positions in furlong"),
        (markups(controlPoints=[3]), "point 1 is not an object"),
        (markups(controlPoints=[{"label": "A", "position": [1, 2]}]), "has 2 coordinates"),
        (markups(controlPoints=[{"label": "A", "position": [1, 2, "x"]}]), "'x', which is not"),
        (markups(controlPoints=[{"label": "A", "position": [1, 2, True]}]), "'True', which is not"),
        (
            markups(
                controlPoints=[{"label": "A", "position": [1, 2, 3], "positionStatus": "undefined"}]
            ),
            "A, has no position",
        ),
    ],
)
def test_wrong_markups_are_refused(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(InputError, match=match):
        read(tmp_path, "p.mrk.json", text)


def test_columns_name_frames_and_units(tmp_path: Path) -> None:
    text = (
        "# measured on the bench\n"
        "name, tracker_x_m, tracker_y_m, tracker_z_m, LPS_x_mm, LPS_y_mm, LPS_z_mm, note\n"
        "A,0.001,0.002,0.003,4,5,6,\n"
        "B,0.1,0.2,0.3,7,8,9,worn\n"
    )
    first, second = read(tmp_path, "p.csv", text)
    assert first.frame == "tracker"
    assert first.positions_mm["A"] == pytest.approx((1.0, 2.0, 3.0))
    assert second == Points(LPS, {"A": (4.0, 5.0, 6.0), "B": (7.0, 8.0, 9.0)})


def test_points_without_names_are_numbered(tmp_path: Path) -> None:
    (points,) = read(tmp_path, "p.csv", "x_mm,y_mm,z_mm\n1,2,3\n4,5,6\n", "bench")
    assert points == Points("bench", {"1": (1.0, 2.0, 3.0), "2": (4.0, 5.0, 6.0)})


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("", "this file is empty"),
        ("name,x,y,z\nA,1,2,3\n", "the columns are name, x, y, z\nhint: name them x_mm"),
        ("name,x_mm,y_mm\nA,1,2\n", "the columns are"),
        ("A,1,2,3\n", "the columns have no names"),
        ("name,x_mm,y_mm,z_mm,x_mm\nA,1,2,3,4\n", "there is a column x_mm before"),
        ("name,x_mm,y_mm,z_mm\nA,1,2\n", "p.csv:2: there are 3 columns, but 4"),
        ("name,x_mm,y_mm,z_mm\nA,1,2,nan\n", "p.csv:2: z_mm is 'nan', which is not a number"),
        ("name,x_mm,y_mm,z_mm\nA,1,2,3\nA,4,5,6\n", "p.csv:3: there is a point A before"),
        ("name,x_mm,y_mm,z_mm\n,1,2,3\n", "p.csv:2: this point has no name"),
    ],
)
def test_wrong_tables_are_refused(tmp_path: Path, text: str, match: str) -> None:
    with pytest.raises(InputError, match=match):
        read(tmp_path, "p.csv", text, "bench")


WORDS = st.sampled_from(
    [
        *("name,x_mm,y_mm,z_mm\n", "A,1,2,3\n", '"', ",", "\n", "#", "CoordinateSystem = LPS"),
        *('{"markups": [{"coordinateSystem": "LPS", "controlPoints": [', "]}]}", "{", "}"),
        *("null", "[", "]", "1e999"),
    ]
)


@given(st.sampled_from(["p.fcsv", "p.mrk.json", "p.csv"]), st.lists(WORDS | st.text(max_size=9)))
def test_any_text_gives_points_or_a_message(
    tmp_path_factory: pytest.TempPathFactory, name: str, words: list[str]
) -> None:
    path = tmp_path_factory.getbasetemp() / name
    path.write_text("".join(words), errors="replace")
    try:
        found = read_points(path, iter(["bench"] * 9))
    except InputError:
        return
    assert found


def test_a_cell_that_is_too_long_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"p.csv:2: this is no CSV"):
        read(tmp_path, "p.csv", "name,x_mm,y_mm,z_mm\n" + "A" * 200_000, "bench")


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="this is no file of points"):
        read(tmp_path, "p.txt", "")
    with pytest.raises(InputError, match="cannot read"):
        read_points(tmp_path / "none.csv", iter(()))
    (tmp_path / "p.csv").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="not text in UTF-8"):
        read_points(tmp_path / "p.csv", iter(()))


# Pairs.


def test_points_are_paired_by_name() -> None:
    first = Points("a", {"P": (1.0, 0.0, 0.0), "Q": (2.0, 0.0, 0.0)})
    second = Points("b", {"Q": (4.0, 0.0, 0.0), "P": (3.0, 0.0, 0.0)})
    assert pair(first, second).target_mm == ((3.0, 0.0, 0.0), (4.0, 0.0, 0.0))
    assert pair(first, second, by_order=True).target_mm == ((4.0, 0.0, 0.0), (3.0, 0.0, 0.0))


def test_points_without_a_partner_are_named() -> None:
    first = Points("a", {"P": (1.0, 0.0, 0.0), "Q": (2.0, 0.0, 0.0)})
    with pytest.raises(InputError, match="in one of the sets only: Q, R"):
        pair(first, Points("b", {"P": (1.0, 0.0, 0.0), "R": (2.0, 0.0, 0.0)}))
    with pytest.raises(InputError, match="2 points in the frame a, but 1 in b"):
        pair(first, Points("b", {"P": (1.0, 0.0, 0.0)}), by_order=True)


def test_points_in_ras_become_points_in_lps() -> None:
    points = Points(RAS, {"P": (1.0, 2.0, 3.0)})
    assert points.within(LPS) == Points(LPS, {"P": (-1.0, -2.0, 3.0)})
    assert points.within(LPS).within(RAS) == points
    with pytest.raises(InputError, match="nothing says how tracker lies in it"):
        points.within("tracker")


# The file of a registration.


def some_document() -> dict[str, Any]:
    places = ((0.0, 0.0, 0.0), (50.0, 0.0, 0.0), (0.0, 50.0, 0.0), (0.0, 0.0, 50.0))
    moved = tuple((1.0 - y, 2.0 + x, 3.0 + z) for x, y, z in places)
    return to_json(register(Pairs(("A", "B", "C", "D"), "tracker", "LPS", places, moved)))


def test_a_registration_survives_its_file(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    path.write_text(json.dumps(some_document()))
    transform = read_transform(path)
    assert (transform.source, transform.target) == ("tracker", "LPS")
    assert transform.point((10.0, 20.0, 30.0)) == pytest.approx((-19.0, 12.0, 33.0))


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"format": "other"}, "another format or version"),
        ({"version": 2}, "another format or version"),
        ({"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "it scales, shears or mirrors"),
        ({"rotation": [[2, 0, 0], [0, 2, 0], [0, 0, 2]]}, "it scales, shears or mirrors"),
        ({"rotation": [[1, 0, 0], [0, 1, 0]]}, "not a registration"),
        ({"translation_mm": [0, 0, float("inf")]}, "not a registration"),
        ({"translation_mm": None}, "not a registration"),
    ],
)
def test_wrong_registrations_are_refused(
    tmp_path: Path, changes: dict[str, Any], match: str
) -> None:
    path = tmp_path / "r.json"
    path.write_text(json.dumps({**some_document(), **changes}))
    with pytest.raises(InputError, match=match):
        read_transform(path)


@pytest.mark.parametrize("text", ["", "[]", "{}", "3"])
def test_what_is_no_registration_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "r.json"
    path.write_text(text)
    with pytest.raises(InputError, match="not a registration"):
        read_transform(path)
    with pytest.raises(InputError, match="cannot read"):
        read_transform(tmp_path / "none.json")
