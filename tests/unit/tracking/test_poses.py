"""Tables of poses: what is read, how poses are paired, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ntagen.errors import InputError
from ntagen.tracking.poses import Poses, listed, pair_poses, read_poses

HEAD = "time_s,x_mm,y_mm,z_mm,qx,qy,qz,qw"
GOOD = "0.5,1,2,3,0,0,0.6,0.8"


def read(tmp_path: Path, *lines: str, most: int = 10) -> Poses:
    path = tmp_path / "poses.csv"
    path.write_text("\n".join(lines) + "\n")
    return read_poses(path, most)


def test_a_pose_is_that_of_scipy(tmp_path: Path) -> None:
    quaternion = np.array([0.1, -0.5, 0.7, 0.3])
    quaternion /= np.linalg.norm(quaternion)
    cells = ",".join(map(str, quaternion))
    found = read(tmp_path, HEAD, GOOD, f"1,4,5,6,{cells}")
    assert np.allclose(found.rotations[1], Rotation.from_quat(quaternion).as_matrix(), atol=1e-12)
    assert found.positions_mm.tolist() == [[1, 2, 3], [4, 5, 6]]
    assert found.names == ("line 2", "line 3")
    assert found.frame == ""


def test_few_digits_frames_units_and_names_are_read(tmp_path: Path) -> None:
    head = "name,bench_x_cm,bench_y_cm,bench_z_cm,bench_qx,bench_qy,bench_qz,bench_qw"
    found = read(tmp_path, head, "A,1,2,3,0.708,0,0,0.708")
    assert (found.frame, found.names, found.is_named) == ("bench", ("A",), True)
    assert found.positions_mm.tolist() == [[10, 20, 30]]
    assert np.allclose(found.rotations[0] @ found.rotations[0].T, np.eye(3), atol=1e-12)


@pytest.mark.parametrize(
    ("lines", "match"),
    [
        (["x_mm,y_mm,z_mm,qx,qy,qz", "1,2,3,0,0,0"], r":1: there is no column qw; the columns are"),
        (["x,y,z,qx,qy,qz,qw", "1,2,3,0,0,0,1"], r":1: the columns are x, y"),
        (["1,2,3,0,0,0,1"], r":1: the columns have no names"),
        ([HEAD + ",QX", GOOD + ",0"], r":1: there is more than one column qx"),
        (
            [HEAD + ",a_x_mm,a_y_mm,a_z_mm", GOOD + ",1,2,3"],
            r":1: there are positions in 2 frames",
        ),
        ([HEAD, GOOD, "1,1,2,3,0,0,0,0"], r":3: the quaternion has the length 0"),
        ([HEAD, GOOD, "1,1,2,3,0,0,0,2"], r":3: the quaternion has the length 2, not 1"),
        ([HEAD, GOOD, "1,1,nan,3,0,0,0,1"], r":3: y_mm is missing"),
        ([HEAD, GOOD, "1,1,2,3,0,,0,1"], r":3: qy is missing"),
        ([HEAD, GOOD, "1,1,2,3,0,0,left,1"], r":3: qz is 'left', which is not a number"),
        ([HEAD, GOOD, "1,1,2,3e9,0,0,0,1"], r":3: the position is 3e\+09 mm away"),
        ([HEAD, GOOD, "1,1,2,3,0,0,0"], r":3: there are 7 columns, but 8"),
        (["name," + HEAD, "A," + GOOD, "A," + GOOD], r":3: the pose A is in line 2, too"),
        (["name," + HEAD, "A," + GOOD, "," + GOOD], r":3: this pose has no name"),
        ([HEAD, *[GOOD] * 11], r"there are 11 poses, and 10 are allowed"),
    ],
)
def test_what_is_wrong_has_a_place_a_cause_and_a_way_out(
    tmp_path: Path, lines: list[str], match: str
) -> None:
    with pytest.raises(InputError, match=match) as caught:
        read(tmp_path, *lines)
    assert "poses.csv" in str(caught.value)
    assert str(caught.value).count("\nhint: ") == 1


def test_a_file_that_is_missing_or_empty_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"cannot read .*none\.csv: no such file"):
        read_poses(tmp_path / "none.csv", 10)
    with pytest.raises(InputError, match=r"poses\.csv: this file is empty"):
        read(tmp_path, "")


# Pairs.


def poses(path: str, names: str, *, is_named: bool = True) -> Poses:
    count = len(names)
    places = np.array([[ord(name), 0, 0] for name in names], dtype=float)
    return Poses(Path(path), "", tuple(names), is_named, np.array([np.eye(3)] * count), places)


def test_poses_are_paired_by_name_and_else_by_order() -> None:
    first, second = pair_poses(poses("s", "ABC"), poses("t", "CAB"))
    assert first.names == second.names == ("A", "B", "C")
    assert np.allclose(first.positions_mm, second.positions_mm)
    first, second = pair_poses(*(poses("s", one, is_named=False) for one in ("ABC", "CAB")))
    assert second.names == ("C", "A", "B")


@pytest.mark.parametrize(
    ("first", "second", "match"),
    [
        (
            poses("s", "ABC"),
            poses("t", "ABDE"),
            "no partner: C in s only; D, E in t only",
        ),
        (
            poses("s", "AB", is_named=False),
            poses("t", "ABC", is_named=False),
            "s has 2 poses, and t has 3",
        ),
        (poses("s", "AB"), poses("t", "AB", is_named=False), "s names its poses, and t does not"),
        (poses("s", "AB", is_named=False), poses("t", "AB"), "t names its poses, and s does not"),
    ],
)
def test_poses_without_a_partner_are_refused(first: Poses, second: Poses, match: str) -> None:
    with pytest.raises(InputError, match=match) as caught:
        pair_poses(first, second)
    assert "\nhint: " in str(caught.value)


def test_a_long_list_is_cut_off() -> None:
    assert listed("ab") == "a, b"
    assert listed("abcdefghijkl") == "a, b, c, d, e, f, g, h, i, j and 2 more"
