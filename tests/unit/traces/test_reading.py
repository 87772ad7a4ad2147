"""Traces from files: columns, units, missing positions, and mistakes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ntagen.errors import InputError
from ntagen.traces.reading import Columns, read_samples

AURORA = "time,Target x,Target y,Target z,AuroraTip x,AuroraTip y,AuroraTip z,AuroraTip qx\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "trace.txt"
    path.write_text(text)
    return path


def check_read(folder: Path, text: str, columns: Columns | None = None) -> None:
    """Each text has the positions (1, 2, 3) and (4, 5, 6)."""
    found = read_samples(written(folder, text), columns)
    assert np.allclose(found.points_mm, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


@pytest.mark.parametrize(
    "text",
    [
        "  1.0e+000  2.0e+000 3.0e+000\n  4.0e+000  5.0e+000 6.0e+000\n",
        "1,2,3\n4,5,6\n",
        "1;2;3\n\n4;5;6\n",
        "1\t2\t3\r\n4\t5\t6\r\n",
        "# a comment\n% another\nx,y,z\n1,2,3\n4,5,6\n",
        "time_s,x_mm,y_mm,z_mm,heading_x,heading_y,heading_z\n0,1,2,3,1,0,0\n1,4,5,6,1,0,0\n",
        "tracker_x_cm,tracker_y_cm,tracker_z_cm\n.1,.2,.3\n.4,.5,.6\n",
        "x [m], y [m], z [m]\n.001,.002,.003\n.004,.005,.006\n",
        "z y x\n3 2 1\n6 5 4\n",
    ],
)
def test_columns_are_found(tmp_path: Path, text: str) -> None:
    check_read(tmp_path, text)


def test_columns_are_named_by_their_beginning(tmp_path: Path) -> None:
    check_read(tmp_path, f"{AURORA}0,9,9,9,1,2,3,0\n1,9,9,9,4,5,6,0\n", Columns("auroratip"))


def test_three_columns_are_named(tmp_path: Path) -> None:
    check_read(tmp_path, "a,b,c,d\n3,0,2,1\n6,0,5,4\n", Columns("d,c,a"))


def test_three_columns_are_numbered(tmp_path: Path) -> None:
    check_read(tmp_path, "0 1 2 3\n1 4 5 6\n", Columns("2,3,4"))


def test_the_unit_of_columns_without_one_is_told(tmp_path: Path) -> None:
    check_read(tmp_path, ".001 .002 .003\n.004 .005 .006\n", Columns(unit="m"))


def test_zeros_are_missing_positions(tmp_path: Path) -> None:
    found = read_samples(written(tmp_path, "1,2,3\n0,0,0\n4,5,6\n"))
    assert found.missing == 1
    assert found.lines == (1, 3)


@pytest.mark.parametrize(
    ("text", "columns", "words"),
    [
        ("", None, ("is empty",)),
        ("1 2 3 4\n", None, ("4 columns without names", "--columns 2,3,4")),
        ("1 2 3 4\n", "2,3,5", ("no columns 2,3,5", "4 columns")),
        ("time,u,v,w\n0,1,2,3\n", None, ("trace.txt:1", "time, u, v, w", "--columns")),
        (AURORA, None, ("Target, AuroraTip", "--columns 'AuroraTip'")),
        (AURORA, "Tip", ("no columns Tip", "AuroraTip x")),
        (AURORA, "a,b,c", ("no columns a,b,c", "AuroraTip x")),
        ("1,2,3\n4,5\n", None, ("trace.txt:2", "2 columns, but 3")),
        ("x,y,z\n1,2,3\n4,nan,6\n", None, ("trace.txt:3", "`y` is 'nan'")),
        ("1,2,3\n4,inf,6\n", None, ("trace.txt:2", "column 2 is 'inf'")),
        ("1,2,3\n4,,6\n", None, ("trace.txt:2", "column 2 is ''")),
    ],
)
def test_a_mistake_is_told_with_its_place(
    tmp_path: Path, text: str, columns: str | None, words: tuple[str, ...]
) -> None:
    with pytest.raises(InputError) as refusal:
        read_samples(written(tmp_path, text), Columns(columns))
    assert all(word in str(refusal.value) for word in words), str(refusal.value)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot read"):
        read_samples(tmp_path / "none.csv")
