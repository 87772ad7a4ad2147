"""Damaged anatomy, strategies, certificates, plans and experiments: read, or refused by name.

What is read of a damaged file is no one's business here: a changed number is another number. But
each ends in a diagnostic at its name, with exit code 2, and within limits of memory.
``NTAGEN_FILES=20000 NTAGEN_SEED=1`` makes a large run of each test, and ``NTAGEN_FOUND=FOLDER``
keeps the files that are wrong.
"""

from __future__ import annotations

import gzip
import itertools
import json
import os
import random
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ntagen import checker, nsl
from ntagen.cli import main
from ntagen.drive.trees import load_tree
from ntagen.errors import InputError
from ntagen.experiment.reading import read_experiment
from ntagen.experiment.results import read_table
from tests import anatomy
from tests.damage import MOST_BYTES, SEED, check_files, damaged, is_read, peak_bytes
from tests.random_anatomy import random_mesh, random_nifti, random_nrrd

ROOT = Path(__file__).parents[2]
FILES = int(os.environ.get("NTAGEN_FILES", "60"))
TEXT_OF_ITK = """#Insight Transform File V1.0
#Transform 0
Transform: AffineTransform_double_3_3
Parameters: 0 1 0 -1 0 0 0 0 1 10.5 -3 7
FixedParameters: 1 2 3
"""


@pytest.fixture(autouse=True)
def no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    """No field is kept, and surfaces have few points: what is far too large takes no minute."""
    monkeypatch.setattr("ntagen.imaging.store.cache_folder", lambda: None)
    monkeypatch.setattr("ntagen.imaging.surfaces._MOST_POINTS", 20_000)


def region_of(draw: random.Random) -> tuple[dict[str, bytes], str, str]:
    """The files of a random region, the one to damage, and the line of the description."""
    make = draw.choice((random_mesh, random_nifti, random_nrrd, random_nrrd))
    sample = make(draw)
    victim = draw.choice(list(sample.files))
    words = f" in {sample.words}" if sample.words else ""
    if sample.part is None:
        line = f'mesh "{sample.name}"{words} grid 20 mm'
    elif isinstance(sample.part, str):
        line = f'segmentation "{sample.name}"{words} segment "{sample.part}" grid 20 mm'
    else:
        line = f'segmentation "{sample.name}"{words} label {sample.part} grid 20 mm'
    return sample.files, victim, f"critical C1 {line}"


def marks_of(draw: random.Random) -> tuple[dict[str, bytes], str, str]:
    """A file of markups, and the line of the description."""
    places = [("A", (1.5, -20.0, 3.0)), ("B", (9.0, -30.0, -4.0))]
    kind = draw.choice(("Fiducial", "Line", "Curve", "ClosedCurve"))
    lists = [anatomy.points(*places, kind=kind, space=draw.choice(("LPS", "RAS")))]
    if draw.random() < 0.5:
        box = {
            "center": [1, -20, 3],
            "size": [4.5, 5, 6],
            "orientation": [0, 1, 0, -1, 0, 0, 0, 0, 1],
        }
        lists.append({"type": "ROI", "coordinateSystem": "LPS", **box})
    data = json.dumps({"markups": lists}, indent=draw.choice((1, None))).encode()
    return {"p.mrk.json": data}, "p.mrk.json", 'critical C1 markups "p.mrk.json" radius 2 mm'


def damaged_inside(data: bytes, draw: random.Random) -> bytes:
    """A damaged file; the content of one that is packed may be damaged in place of it."""
    if data[:2] == b"\x1f\x8b" and draw.random() < 0.7:
        return gzip.compress(damaged(gzip.decompress(data), draw), 1, mtime=0)
    return damaged(data, draw)


@pytest.mark.parametrize("kind", ["region", "marks", "transform"])
def test_damaged_anatomy_is_read_or_refused(kind: str, tmp_path: Path) -> None:
    read_well, before = 0, peak_bytes()
    for number in range(SEED, SEED + FILES):
        draw = random.Random(f"{kind} {number}")
        files, victim, line = (marks_of if kind == "marks" else region_of)(draw)
        frame = anatomy.FRAME
        if kind == "transform":
            rows = " ".join(map(repr, np.eye(4).flat))
            text = draw.choice((TEXT_OF_ITK, rows, rows.replace(" ", ", ")))
            files, victim = {**marks_of(draw)[0], "t.tfm": text.encode()}, "t.tfm"
            line, frame = (
                'critical C1 markups "p.mrk.json" radius 2 mm',
                'transform from LPS "t.tfm"',
            )
        files = {**files, victim: damaged_inside(files[victim], draw)}
        for name, data in files.items():
            (tmp_path / name).write_bytes(data)
        (tmp_path / "e.nsl").write_text(anatomy.environment(line, frame=frame), "utf-8")
        read_well += is_read(tmp_path / "e.nsl", nsl.load, number)
    assert peak_bytes() - before < MOST_BYTES
    assert FILES < 60 or 0 < read_well < FILES


# ------------------------------------------------------------- what the engine and the driver write


@pytest.fixture(scope="module")
def evidence(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Files that `ntagen check` writes: a certificate, a trace, and a strategy with its model."""
    folder = tmp_path_factory.mktemp("evidence")
    game = "chan a; clock x; process P() { state A, B, C; init A; trans A -u-> B { guard x < 3; },"
    game += " A -> C { guard x > 1; assign x = 0; }, B -> C { }; } system P;"
    (folder / "game.xta").write_text(game)
    model = checker.load_file(folder / "game.xta")
    strategy = model.check("control: A<> P.C", strategy=True).strategy
    assert strategy is not None
    strategy.save(folder / "strategy.json")
    for query, option, name in (
        ("A[] not (P.C && x < 0)", "--certificate", "certificate.jsonl"),
        ("E<> P.C", "--trace", "trace.json"),
    ):
        args = ["check", str(folder / "game.xta"), "--query", query, option, str(folder / name)]
        assert main(args) in (0, 1)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("name", ["strategy.json", "certificate.jsonl", "trace.json"])
def test_damaged_evidence_is_read_or_refused(
    name: str, evidence: dict[str, bytes], tmp_path: Path
) -> None:
    (tmp_path / "game.xta").write_bytes(evidence["game.xta"])
    model = checker.load_file(tmp_path / "game.xta")

    def read(path: Path) -> None:
        data = path.read_bytes()
        if name == "strategy.json":
            model.load_strategy(path)
        try:
            text = data.decode()
        except UnicodeDecodeError:
            raise InputError(f"{path}: no text") from None
        model.verify(text, str(path))

    check_files(tmp_path, name, [evidence[name]], read, FILES)


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The plans that `ntagen check --plans` writes for a task with an adversarial tissue."""
    path = tmp_path_factory.mktemp("tree") / "plans.json"
    task = ROOT / "examples" / "answering" / "answering.nsl"
    assert main(["check", str(task), "--verify", "--plans", str(path)]) == 0
    return path.read_bytes()


@pytest.mark.slow
def test_damaged_plans_are_read_or_refused(tree: bytes, tmp_path: Path) -> None:
    scene = nsl.load(ROOT / "examples" / "answering" / "answering.nsl")
    check_files(tmp_path, "plans.json", [tree], lambda path: load_tree(path, scene), FILES)


@pytest.mark.parametrize("name", ["virtual.toml", "sensitivity.toml", "real.toml"])
def test_damaged_experiments_are_read_or_refused(name: str, tmp_path: Path) -> None:
    """The scenes lie elsewhere, so each name of one is a mistake as well."""
    seed = (ROOT / "examples" / "experiments" / name).read_bytes()
    check_files(tmp_path, name, [seed], read_experiment, max(1, FILES // 3))


def test_damaged_tables_are_read_or_refused(tmp_path: Path) -> None:
    seed = json.dumps({"format": 1, "name": "a", "rows": [{"id": "r", "runs": 3}], "runs": []})
    seeds = [seed.encode()]
    check_files(tmp_path, "table.json", seeds, lambda path: read_table(path.parent), FILES)


# ------------------------------------------------------------------------------------------- claims


def nrrd(sizes: str, data: bytes, encoding: str = "raw", type_: str = "uchar") -> bytes:
    """A NRRD file that claims some sizes."""
    head = f"NRRD0004\ntype: {type_}\nendian: little\ndimension: 3\nspace: LPS\nsizes: {sizes}\n"
    head += "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
    return (head + f"encoding: {encoding}\n\n").encode() + data


def packed_zeros(mebibytes: int) -> bytes:
    """A bomb: so many zeros, packed a thousandfold."""
    return b"".join(itertools.repeat(gzip.compress(bytes(2**20), 9, mtime=0), mebibytes))


def ply(points: int, faces: int, kind: str = "ascii") -> bytes:
    """A PLY file that claims some numbers of points and faces, and has none."""
    head = f"ply\nformat {kind} 1.0\nelement vertex {points}\nproperty double x\n"
    head += "property double y\nproperty double z\n"
    head += f"element face {faces}\nproperty list uchar int vertex_index\nend_header\n"
    return head.encode()


BOMBS: dict[str, tuple[str, Callable[[], bytes]]] = {
    "voxels": ("a.nrrd", lambda: nrrd("10000 10000 10000", b"1234")),
    "voxels along an axis": ("a.nrrd", lambda: nrrd("1000000000000 1 1", b"1234")),
    "as many as may be": ("a.nrrd", lambda: nrrd("512 512 1024", b"1234", type_="double")),
    "zeros behind few voxels": ("a.nrrd", lambda: nrrd("4 4 4", packed_zeros(4096), "gzip")),
    "zeros of NIfTI": ("a.nii.gz", lambda: packed_zeros(4096)),
    "one number in text": ("a.nrrd", lambda: nrrd("500 500 500", b"1" * 2**24, "text")),
    "points": ("a.ply", lambda: ply(10**12, 1)),
    "faces": ("a.ply", lambda: ply(8, 10**12, "binary_little_endian")),
    "faces that may be": ("a.ply", lambda: ply(8, 10**6, "binary_big_endian")),
    "triangles": ("a.stl", lambda: bytes(80) + b"\xff" * 4),
    "corners of a face": ("a.obj", lambda: b"v 0 0 0\nf" + b" 1 1 1" * 2**22),
    "lines": ("a.obj", lambda: b"\n" * 2**25),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
def test_a_claim_takes_no_memory(name: str, tmp_path: Path) -> None:
    """What a file claims, or is when it is unpacked, is not in memory: measured from outside."""
    file, make = BOMBS[name]
    data = make()
    (tmp_path / file).write_bytes(data)
    form = "segmentation" if file.startswith(("a.n",)) else "mesh"
    words = "label 1" if form == "segmentation" else "in LPS mm"
    text = anatomy.environment(f'critical C1 {form} "{file}" {words}')
    (tmp_path / "e.nsl").write_text(text, "utf-8")
    code = (
        "import sys, nibabel, scipy.spatial\n"
        "from tests.damage import peak_bytes\n"
        "from ntagen.cli import main\n"
        "before = peak_bytes()\n"
        "result = main(['info', sys.argv[1]])\n"
        "print(peak_bytes() - before)\n"
        "sys.exit(result)\n"
    )
    env = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)}
    args = [sys.executable, "-c", code, str(tmp_path / "e.nsl")]
    done = subprocess.run(args, env=env, capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 2, done.stderr
    assert f"`{tmp_path / file}`" in done.stderr
    assert int(done.stdout.split()[-1]) < len(data) + MOST_BYTES
