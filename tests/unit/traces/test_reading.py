"""Traces from files: columns, units, missing positions, and mistakes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ntagen.errors import InputError
from ntagen.traces.reading import Columns, read_samples

AURORA = "time,Target x,Target y,Target z,AuroraTip x,AuroraTip y,AuroraTip z,AuroraTip qx\n"


NDI = "Tools,Port 1,Frame,Face,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error"
STRAY = "Markers,State,Tx,Ty,Tz,State,Tx,Ty,Tz"
NDI_TWO = f"{NDI},Port 2,Frame,Face,State,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,{STRAY}"


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
        "time_s;x_mm;y_mm;z_mm\n0,00;1,0;2,0;3,0\n0,50;4,0;5,0;6,0\n",
        "x;y;z\n1,000;2,000;3,000\n4,000;5,000;6,000\n",
        "1,0 2,0 3,0\n4,0 5,0 6,0\n",
        "x\ty\tz\n1,0\t2\t3\n4\t5\t6\n",
        '"time, s","x_mm","y_mm","z_mm"\n0.00,1,2,3\n0.50,4,5,6\n',
        'time,x,y,z\n"0,5","1,0","2,0","3,0"\n"1,5","4,00","5,00","6,00"\n',
        "sep=;\nx;y;z\n1;2;3\n4;5;6\n",
        "# sep=;\n\nsep=|\nx|y|z\n1|2|3\n4|5|6\n",
        "Time,X,Y,Z\ns,mm,mm,mm\n0.00,1,2,3\n0.50,4,5,6\n",
        "Time;X;Y;Z\n[ms];[cm];[cm];[cm]\n0;0,1;0,2;0,3\n500;0,4;0,5;0,6\n",
        "x (µm),y (µm),z (µm)\n1000,2000,3000\n4000,5000,6000\n",
        "x,y,z\n1,2,3\n,,\nnan,nan,NaN\nMISSING,MISSING,MISSING\n4,,6\n4,5,6\n,,,\n",
        "x,y,z\n-3.697314E+28,-3.697314E+28,-3.697314E+28\n1,2,3\n4,5,6\n",
        "time_s,x,y,z\n1,4,5,6\n0,1,2,3\n",
        "Frame,x,y,z\n8,1,2,3\n9,,,\n10,4,5,6\n",
        f"{NDI}\n1,A,7,0,OK,1,0,0,0,1,2,3,.1\n1,A,8,0,MISSING,,,,,,,,\n1,A,9,0,OK,1,0,0,0,4,5,6,0\n",
        f"{NDI}\n1,A,7,0,OK,1,0,0,0,1,2,3,.1\n1,A,8,0,OutOfVolume,1,0,0,0,9,9,9,0\n"
        "1,A,9,0,OK,1,0,0,0,4,5,6,0\n",
    ],
)
def test_columns_are_found(tmp_path: Path, text: str) -> None:
    check_read(tmp_path, text)


def test_columns_are_named_by_their_beginning(tmp_path: Path) -> None:
    check_read(tmp_path, f"{AURORA}0,9,9,9,1,2,3,0\n1,9,9,9,4,5,6,0\n", Columns("auroratip"))


def test_a_tool_of_several_is_chosen_by_its_port(tmp_path: Path) -> None:
    row = "2,A,{},0,OK,1,0,0,0,9,9,9,0,B,{},0,OK,1,0,0,0,{},0,2,OK,8,8,8,OK,7,7,7\n"
    text = f"{NDI_TWO}\n{row.format(1, 1, '1,2,3')}{row.format(2, 2, '4,5,6')}"
    check_read(tmp_path, text, Columns("Port 2"))


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


def test_samples_out_of_order_are_sorted_with_a_warning(tmp_path: Path) -> None:
    text = "time_s,x,y,z\n0,1,2,3\n2,7,8,9\n1,4,5,6\n3,9,9,9\n"
    found = read_samples(written(tmp_path, text))
    assert found.points_mm[:, 0].tolist() == [1.0, 4.0, 7.0, 9.0]
    assert found.lines == (2, 4, 3, 5)
    (warning,) = found.warnings
    assert "trace.txt:4: the time goes back here, the first of 1 times" in warning
    assert not read_samples(written(tmp_path, text.replace("1,4,5,6\n", ""))).warnings


@pytest.mark.parametrize(
    ("text", "missing", "lines"),
    [
        ("x,y,z\n1,2,3\n,,\n4,5,6\n", 1, (2, 4)),
        ("1;2;3\nnan;;\n0;0;0\n4;5;6\n", 2, (1, 4)),
    ],
)
def test_gaps_are_counted(tmp_path: Path, text: str, missing: int, lines: tuple[int, ...]) -> None:
    found = read_samples(written(tmp_path, text))
    assert (found.missing, found.lines) == (missing, lines)


def test_a_comma_that_can_be_read_in_two_ways_is_refused(tmp_path: Path) -> None:
    for text, words in (
        ('x,y,z\n"1,234",567,"1,000"\n', "it may stand after thousands"),
        ("x;y;z\n1,5;2.5;3,5\n", "'2.5' in line 2 has a decimal point"),
    ):
        with pytest.raises(InputError, match=words):
            read_samples(written(tmp_path, text))


def test_a_hint_never_deletes_all_lines(tmp_path: Path) -> None:
    text = "t,x,y,z\n" + "0,5,1,5,2,5,3,5\n" * 9
    with pytest.raises(InputError, match=r"9 of 9 lines(.|\n)*decimal commas need semicolons"):
        read_samples(written(tmp_path, text))
    with pytest.raises(InputError, match="delete lines that are not whole"):
        read_samples(written(tmp_path, "x,y,z\n" + "1,2,3\n" * 9 + "1,2"))


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
        ("x,y,z\n1,2,3\n4,5a,6\n", None, ("trace.txt:3", "`y` is '5a'", "leave the cell empty")),
        ("1,2,3\n4,inf,6\n", None, ("trace.txt:2", "column 2 is 'inf'")),
        ("x,y,z\n1,a,3\n4,b,6\n", None, ("trace.txt:2", "no numbers at all", "--columns")),
        ("x,y,z,x\n1,2,3,4\n", None, ("trace.txt:1", "two columns x, 1 and 4")),
        ("x,y,z\ninch,inch,inch\n1,2,3\n", None, ("trace.txt:2", "`x` is 'inch'")),
        ("x,y,z\ns,s,s\n1,2,3\n", None, ("trace.txt:1", "'s', which is no length")),
        ("x_mm,y,z\nm,m,m\n1,2,3\n", None, ("trace.txt:2", "the unit of `x_mm` is 'm' here")),
        (f"{NDI_TWO}\n", None, ("several positions: Port 1, Port 2", "--columns 'Port 1'")),
        ("t,x,y,z\n2,1,2,3\n1,4,5,6\n,7,8,9\n", None, ("trace.txt:3", "have no time")),
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
