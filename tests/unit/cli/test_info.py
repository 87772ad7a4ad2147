"""`ntagen info`: text, JSON, pictures, and what it says of bad input."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from ntagen.cli import main

PAPER = Path(__file__).resolve().parents[3] / "examples" / "paper.nsl"

MODEL = """
urgent broadcast chan go[3];
int32_t total;
process Worker(int[0,2] id) {
  clock x; state Idle { x <= 5 }, Busy; commit Busy; init Idle;
  trans Idle -> Busy { sync go[id]!; }, Busy -u-> Idle { };
}
system Worker;
query { E<> Worker(0).Busy }
"""


@pytest.fixture
def worker(tmp_path: Path) -> Path:
    path = tmp_path / "worker.xta"
    path.write_text(MODEL)
    return path


def info_run(
    capsys: pytest.CaptureFixture[str], code: int, *arguments: str | Path
) -> tuple[str, str]:
    """The command ends with the exit code; its two outputs."""
    assert main(["info", *(str(argument) for argument in arguments)]) == code
    captured = capsys.readouterr()
    assert "Traceback" not in captured.out + captured.err
    return captured.out, captured.err


def test_the_text_names_what_is_in_the_model(
    capsys: pytest.CaptureFixture[str], worker: Path
) -> None:
    out, _ = info_run(capsys, 0, worker)
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert lines[0].startswith(
        f"{worker}: 3 processes of 1 template, 1 variable, 3 clocks, 3 channels; loaded in "
    )
    assert "state: 4 words of 32 bits (3 for locations, 1 for variables), " in lines[1]
    assert "committed locations, uncontrollable edges" in lines[2]
    for row in (
        "Worker(int[0, 2] id) 2 2 1 committed, 1 uncontrollable edge",
        "Worker(0) … Worker(2) (3) Worker",
        "total int32_t 1",
        "Worker(0).x … Worker(2).x (3)",
        "go[0] … go[2] (3) urgent broadcast",
        "E<> Worker(0).Busy",
    ):
        assert row in lines


def test_json_is_one_object_and_nothing_else(
    capsys: pytest.CaptureFixture[str], worker: Path
) -> None:
    out, err = info_run(capsys, 0, worker, "--json")
    found = json.loads(out)
    assert err == ""
    assert (found["format"], found["version"]) == ("ntagen-model", 1)
    assert set(found) == {
        *("format", "version", "templates", "processes", "variables", "clocks", "channels"),
        *("features", "scalar_sets", "state", "queries", "warnings", "load_seconds"),
    }
    assert found["templates"][0]["edges"][0]["sync"] == "go[id]!"
    query = {"text": "E<> Worker(0).Busy", "comment": "", "expect": None, "options": {}}
    assert found["queries"] == [query | {"path": str(worker), "line": 9, "column": 9}]


def test_environments_are_models_too(capsys: pytest.CaptureFixture[str]) -> None:
    out, _ = info_run(capsys, 0, PAPER)
    assert "4 processes of 4 templates" in out


STORED = """
const int N = 4;
int[0,1] cells[N]; int[0,300] passed; int never; meta bool seen; int32_t wide;
process P(int[0,1] id) {
  state A, B; init A;
  trans A -> A { guard seen; },
        A -> B { assign passed = 7, cells[1] = 1, seen = true; },
        B -> A { guard passed + cells[1] + cells[0] + never < 9; };
}
process Q() { state A; init A; trans A -> A { guard wide < 9; assign wide = 3; }; }
system P, Q;
"""


def test_what_is_stored_of_a_state(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "stored.xta"
    path.write_text(STORED)
    out, _ = info_run(capsys, 0, path, "--state")
    lines = [" ".join(line.split()) for line in out.splitlines()]
    first = lines.index("stored type words bits remark")
    # By bits, and then by words.
    where = "(live in 2 of 5 locations)"
    assert lines[first + 2 : first + 11] == [
        "wide int32_t 1 32",
        "P(0) … P(1) (2) location 2 16",
        f"passed int[0,300] 1 16 reset where not read {where}",
        "cells int[0,1] array [4] 4 8 3 words not stored: nothing writes them; "
        f"1 word reset where not read {where}",
        "Q location 1 8",
        "seen meta bool 1 8 meta: not compared",
        "never int 1 0 not stored: nothing writes it",
        "",
        "a stored state takes at most 88 of 352 bits, and 16 of padding; nothing writes 4 of 11 "
        "words, which are not stored; 2 words are reset where not read, unless the query reads "
        "them",
    ]
    assert "stored" not in info_run(capsys, 0, path)[0].replace(str(path), "")


def test_json_says_on_request_what_is_stored(
    capsys: pytest.CaptureFixture[str], worker: Path
) -> None:
    plain = json.loads(info_run(capsys, 0, worker, "--json")[0])
    found = json.loads(info_run(capsys, 0, worker, "--json", "--state")[0])
    added = {"stored_bits", "padding_bits", "constant_words", "reset_words", "parts"}
    assert set(found["state"]) - set(plain["state"]) == added
    assert {key: found["state"][key] for key in plain["state"]} == plain["state"]
    assert set(found) == set(plain)
    assert sum(part["stored_bits"] for part in found["state"]["parts"]) == 24
    total = found["state"]["parts"][-1]
    assert (total["name"], total["words"], total["stored_bits"]) == ("total", 1, 0)
    assert (total["constant_words"], total["process"]) == (1, None)


def test_what_is_stored_of_an_environment_and_of_random_runs(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    out, _ = info_run(capsys, 0, PAPER, "--state")
    assert "a stored state takes at most " in out
    path = tmp_path / "runs.xta"
    path.write_text(
        "clock x; double d; process P() { state A; init A; trans A -> A { guard x > d; }; } "
        "system P;"
    )
    out, _ = info_run(capsys, 0, path, "--state")
    assert "stored state: none, because only random runs of this model have a meaning" in out
    path.write_text("process P() { state A; init B; } system P;")
    out, err = info_run(capsys, 2, path, "--state")
    assert out == ""
    assert "error[E0254]" in err


def test_pictures_are_written(
    capsys: pytest.CaptureFixture[str], worker: Path, tmp_path: Path
) -> None:
    picture = tmp_path / "Worker.svg"
    assert main(["plot", str(worker), "--as", "templates", "-o", str(picture)]) == 0
    assert ET.parse(picture).getroot().tag.endswith("svg")
    assert main(["info", str(worker), "--svg", str(tmp_path)]) == 2
    assert "`ntagen plot MODEL --as templates`" in capsys.readouterr().err


def test_long_tables_are_cut(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "many.xta"
    names = "".join(f"int v{i};" for i in range(60))
    path.write_text(f"{names} process P() {{ state A; init A; }} system P;")
    out, _ = info_run(capsys, 0, path)
    assert "… 20 more (all of them: --json)" in out


def test_many_warnings_are_counted(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "warned.xta"
    locations = ", ".join(f"L{i} {{ x < 3 }}" for i in range(15))
    path.write_text(f"clock x; process P() {{ state {locations}; init L0; }} system P;")
    _, err = info_run(capsys, 0, path)
    assert err.count("warning[W0202]") == 10
    assert "… and 5 more warnings" in err


def test_wrong_input_is_rejected_as_by_check(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "wrong.xta"
    path.write_text("process P() { state A; init A; trans A -> A { guard n > 0; }; } system P;")
    _, info = info_run(capsys, 2, path)
    assert f"{path}:1:53: error[E0201]: 'n' is not declared" in info
    assert info.count("ntagen explain E0201") == 1
    assert main(["check", str(path)]) == 2
    assert capsys.readouterr().err == info
    _, machine = info_run(capsys, 2, path, "--json")
    assert "ntagen explain" not in machine
    info_run(capsys, 2, tmp_path / "nothing.xml")


@pytest.mark.parametrize(
    ("function", "reduction"),
    [
        ("void act(id i) { last = i; }", "symmetry reduction exchanges its members"),
        (
            "void act(id i) { for (j : id) if (seen[j]) last = j; }",
            "no symmetry reduction: something tells its members apart, at ",
        ),
    ],
)
def test_scalar_sets_say_whether_they_are_reduced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], function: str, reduction: str
) -> None:
    path = tmp_path / "members.xta"
    path.write_text(
        f"typedef scalar[3] id; id last; bool seen[id]; {function}\n"
        "process P(const id me) { state A; init A; "
        "trans A -> A { assign act(me), seen[me] = true; }; }\nsystem P;\n"
    )
    out, _ = info_run(capsys, 0, path)
    assert f"scalar set of 3 members: {reduction}" in out


def test_regions_of_an_environment(capsys: pytest.CaptureFixture[str]) -> None:
    path = Path(__file__).parents[2] / "corpus" / "nsl" / "ok" / "shapes.nsl"
    out, _ = info_run(capsys, 0, path)
    lines = {line.split()[0]: " ".join(line.split()) for line in out.splitlines() if line.strip()}
    # The straight way is the line from (0, 0, 0) to (0, -50, 0).
    assert lines["K1"].startswith("K1 critical cylinder 565.5 mm^3 -3 to 3 -30 to -10 -12 to -6 ")
    assert lines["K1"].endswith(" 6.00 mm")
    half_space = "-infinity to infinity -infinity to -70 -infinity to infinity"
    assert lines["H"].startswith(f"H unexplored halfspace infinite {half_space}")
    assert lines["H"].endswith(" 20.00 mm")
    out, _ = info_run(capsys, 0, path, "--json")
    facts = {one["name"]: one for one in json.loads(out)["regions"]}
    assert facts["B1"]["volume_mm3"] == pytest.approx(240.0)
    assert facts["H"]["volume_mm3"] is None
    assert facts["H"]["high_mm"] == [None, -70.0, None]
    assert facts["T1"]["from_straight_way_mm"] == pytest.approx(-10.0)
    # The ellipsoid stands on the way; its middle is the deepest place.
    assert facts["E1"]["from_straight_way_mm"] == pytest.approx(-2.0, abs=2e-3)


def test_how_far_rounding_may_move_the_path(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    lines = [
        "environment e {",
        "  needle { radius 100 mm  speed 1 mm/s }",
        "  target T1 sphere (0, -50, 0) mm  radius 4 mm",
        "  critical C1 sphere (0, -25, 9) mm  radius 1.5 mm",
        "}",
    ]
    path = tmp_path / "e.nsl"
    path.write_text("\n".join(lines))
    out, err = info_run(capsys, 0, path)
    assert re.search(r"resolution: \d+ per mm, chosen: .* by at most 0\.0\d+ mm, down", out)
    assert err == ""
    facts = json.loads(info_run(capsys, 0, path, "--json")[0])
    assert facts["resolution_origin"] == "chosen"
    assert 0.0 < facts["path_error_mm"] <= 0.05
    assert (facts["least_margin_mm"], facts["depth_mm"]) == (1.5, pytest.approx(58.0, abs=2.0))
    path.write_text("\n".join([*lines[:-1], "  resolution 1000 per mm", "}"]))
    out, err = info_run(capsys, 0, path)
    assert "resolution: 1000 per mm, written in the file: " in out
    assert f"write `{facts['resolution_per_mm']} per mm`, or leave it out" in err
    facts = json.loads(info_run(capsys, 0, path, "--json")[0])
    assert (facts["resolution_per_mm"], facts["resolution_origin"]) == (1000, "file")
    assert facts["path_error_mm"] > facts["least_margin_mm"]
    path.write_text("\n".join([*lines[:-1], "  resolution 50 per mm", "}"]))
    assert json.loads(info_run(capsys, 0, path, "--json")[0])["path_error_mm"] is None
