"""How fast the engine explores whole state spaces, against TChecker and against published figures.

    python tests/benchmarks/race.py [--tchecker tck-reach] [--models FOLDER] [--runs 3] [NAME]...
    python tests/benchmarks/race.py --threads 2 [--models FOLDER] [--runs 3] [NAME]...

With ``--tchecker`` the same automata, made by the example generators of TChecker's sources (found
beside the program, or by ``--examples``), are explored in the same run by ``tck-reach -a
covreach`` (``aLU-covreach`` where that is faster), in turn with the engine; without it the
figures of a run elsewhere stand in, in brackets. ``--models`` names a folder with the artefact of
"Dynamic Extrapolation in Extended Timed Automata" (ICFEM 2023): models and, as CSV, how many
states UPPAAL stores of each with the bounds L and U, computed beforehand and along the way; without
it they are left out. The counts belong to the files of the artefact: models published elsewhere
under the same names have other guards and invariants, and other counts.

Every exploration has a process of its own. Seconds are user CPU seconds, of the engine those of
the check alone, its code's compilation included; memory is the growth of the resident set from
the loaded model to its peak, of TChecker the whole. The median of the runs is printed.

``--threads`` compares the engine with itself instead: one thread and so many, in turn. The times
are of the clock on the wall, so the machine must have as many cores that nobody else uses:
``waited`` is the share of the time in which the first thread could have run and had no core.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import astuple, dataclass
from itertools import chain
from pathlib import Path

import models

from ntagen import checker

QUERY = "E<> false"


@dataclass(frozen=True, slots=True)
class Race:
    """A model that both tools explore; the figures of TChecker are those of a run elsewhere."""

    name: str
    model: Callable[[int], str]
    generator: str
    size: int
    tchecker_stored: int
    tchecker_seconds: float
    tchecker_mb: float
    algorithm: str = "covreach"
    """The search of TChecker that takes it the least time."""


RACES = (
    Race("fischer 9", models.fischer, "fischer", 9, 81_035, 10.8, 54),
    Race("fischer 10", models.fischer, "fischer", 10, 260_998, 50.4, 141),
    Race("csmacd 9", models.csmacd, "csmacd", 9, 55_554, 3.40, 42),
    Race("csmacd 10", models.csmacd, "csmacd", 10, 144_898, 12.1, 78),
    Race("csmacd 11", models.csmacd, "csmacd", 11, 369_666, 38.2, 163),
    Race("train gate 5", models.train_gate, "train_gate", 5, 215_375, 4.73, 70),
    Race("dining 7", models.dining_philosophers, "dining-philosophers", 7, 38_179, 11.0, 43),
    Race("fddi 10", models.fddi, "fddi", 10, 525, 2.13, 79),
    Race("corsso 4", models.corsso, "corsso", 4, 384_825, 98.5, 164, "aLU-covreach"),
)

PUBLISHED = {
    "models-dyn": "230424-with-type-ranges",
    "models-dyn-no-ranges": "230512-without-type-ranges",
}
"""By folder of models in the artefact: the folder of their counts in ``results``."""

MOST_STORED = 2_000_000
"""Models of which UPPAAL stores more states are left out unless they are asked for by name."""

UNTIMED_PROCESSES = 5
"""Processes of Peterson's algorithm; in every state each of them has exactly one transition."""


@dataclass(frozen=True, slots=True)
class Measured:
    """What one exploration took."""

    stored: int
    seconds: float
    mb: float
    accounted_mb: float = 0.0
    wall_seconds: float = 0.0
    waited_seconds: float = 0.0


def _resident_mb(key: str) -> float:
    """A size of this process that Linux reports in kB, for example ``VmHWM``, the peak."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    line = next(line for line in lines if line.startswith(key + ":"))
    return int(line.split()[1]) / 1024


def _waited_seconds() -> float:
    """How long the first thread of this process was kept waiting for a core."""
    return int(Path("/proc/self/schedstat").read_text(encoding="ascii").split()[1]) / 1e9


def _explore(path: Path, threads: int) -> None:
    """Explores a model in this process and prints what it took as JSON."""
    model = checker.load_file(path)
    before = _resident_mb("VmRSS")
    start = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    wall, waited = time.perf_counter(), _waited_seconds()
    answer = model.check(QUERY, threads=threads)
    wall, waited = time.perf_counter() - wall, _waited_seconds() - waited
    seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - start
    if answer.verdict != "not satisfied":
        raise SystemExit(f"{path}: {answer.verdict}")
    mb = _resident_mb("VmHWM") - before
    print(json.dumps([answer.stored, seconds, mb, answer.peak_bytes / 2**20, wall, waited]))


def _run_engine(path: Path, threads: int = 1) -> Measured:
    command = [sys.executable, __file__, "--explore", str(path), "--threads", str(threads)]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return Measured(*json.loads(output))


def _run_tchecker(program: Path, algorithm: str, path: Path) -> Measured:
    command = [program, "-a", algorithm, path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        output = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    counts = dict(line.split(maxsplit=1) for line in output.splitlines() if " " in line)
    return Measured(int(counts["STORED_STATES"]), usage.ru_utime, usage.ru_maxrss / 1024)


def _median(runs: list[Measured]) -> Measured:
    rows = (astuple(run)[1:] for run in runs)
    columns = zip(*rows, strict=True)
    return Measured(runs[0].stored, *(statistics.median(column) for column in columns))


def _generators(program: Path) -> Path:
    """The folder with the example generators among the parents of the program."""
    for parent in program.resolve().parents:
        if (parent / "examples" / "fischer.sh").exists():
            return parent / "examples"
    raise SystemExit(f"no examples/fischer.sh above {program}: name their folder by --examples")


def _race(race: Race, arguments: argparse.Namespace, folder: Path) -> None:
    """Explores one model with both tools in turn and prints the ratios."""
    path = folder / f"{race.generator}-{race.size}.xta"
    path.write_text(race.model(race.size), encoding="utf-8")
    own: list[Measured] = []
    other: list[Measured] = []
    for _ in range(arguments.runs):
        own.append(_run_engine(path))
        if arguments.tchecker:
            examples = arguments.examples or _generators(arguments.tchecker)
            script = ["bash", examples / f"{race.generator}.sh", str(race.size)]
            text = subprocess.run(script, capture_output=True, check=True).stdout
            tck = path.with_suffix(".tck")
            tck.write_bytes(text)
            other.append(_run_tchecker(arguments.tchecker, race.algorithm, tck))
    mine = _median(own)
    if other:
        theirs, style = _median(other), "{}"
    else:
        published = (race.tchecker_stored, race.tchecker_seconds, race.tchecker_mb)
        theirs, style = Measured(*published), "[{}]"
    print(
        f"{race.name:<13} stored {mine.stored:>9} {style.format(theirs.stored):>9}"
        f"   user s {mine.seconds:7.2f} {style.format(round(theirs.seconds, 2)):>8}"
        f"   faster {style.format(round(theirs.seconds / mine.seconds, 1)):>7}"
        f"   MB {mine.mb:6.1f} {style.format(round(theirs.mb)):>6}"
        f"   accounted {mine.accounted_mb / mine.mb:5.2f}",
        flush=True,
    )


def _count(name: str, path: Path, runs: int, published: int | None) -> Measured:
    """Explores a model, perhaps with a published count of stored states, and prints how it went."""
    mine = _median([_run_engine(path) for _ in range(runs)])
    against = f"{published:>9}" if published is not None else " " * 9
    print(
        f"{name:<22} stored {mine.stored:>9} {against}   user s {mine.seconds:7.2f}"
        f"   stored/s {mine.stored / mine.seconds:9.0f}   MB {mine.mb:6.1f}"
        f"   bytes/stored {mine.mb * 2**20 / mine.stored:5.0f}"
        f"   accounted {mine.accounted_mb / mine.mb:5.2f}",
        flush=True,
    )
    return mine


def _untimed(folder: Path) -> Path:
    """The model without clocks, written into the folder."""
    path = folder / "peterson.xta"
    path.write_text(models.peterson(UNTIMED_PROCESSES), encoding="utf-8")
    return path


def _made(folder: Path) -> Iterator[tuple[str, Path]]:
    """All models that are made here, written into the folder, by their names."""
    for race in RACES:
        path = folder / f"{race.generator}-{race.size}.xta"
        path.write_text(race.model(race.size), encoding="utf-8")
        yield race.name, path
    yield "peterson", _untimed(folder)


def _published(folder: Path | None) -> Iterator[tuple[str, Path, int]]:
    """The models of the artefact with their names and the fewest states that UPPAAL stores."""
    if folder is None:
        return
    for models_folder, results in PUBLISHED.items():
        least: dict[str, int] = {}
        for abstraction in ("LU", "DynLU"):
            path = folder / "results" / results / f"{abstraction}.csv"
            with path.open(encoding="utf-8", newline="") as table:
                for row in csv.DictReader(table, delimiter=";"):
                    # A search that did not end counts nothing.
                    if row["formula"] == QUERY and (stored := int(row["stored"])):
                        least[row["model"]] = min(stored, least.get(row["model"], stored))
        for name, stored in sorted(least.items()):
            path = folder / models_folder / f"{name}.xml"
            if path.exists():
                # Without ranges all variables are plain `int`.
                yield name if models_folder == "models-dyn" else f"{name} int", path, stored


def _share(name: str, path: Path, arguments: argparse.Namespace) -> None:
    """Explores a model by one thread and by several in turn, and prints how much faster that is."""
    runs: dict[int, list[Measured]] = {1: [], arguments.threads: []}
    for _ in range(arguments.runs):
        for threads, measured in runs.items():
            measured.append(_run_engine(path, threads))
    one, several = (_median(measured) for measured in runs.values())
    print(
        f"{name:<22} stored {one.stored:>9} {several.stored:>9}"
        f"   wall s {one.wall_seconds:7.2f} {several.wall_seconds:7.2f}"
        f"   faster {one.wall_seconds / several.wall_seconds:5.2f}"
        f"   user s {one.seconds:7.2f} {several.seconds:7.2f}   MB {one.mb:6.1f} {several.mb:6.1f}"
        f"   waited {one.waited_seconds / one.wall_seconds:4.0%}"
        f" {several.waited_seconds / several.wall_seconds:4.0%}",
        flush=True,
    )


def main() -> None:
    """Runs all races that were asked for."""
    summary = (__doc__ or "").splitlines()[0]
    parser = argparse.ArgumentParser(description=summary)
    parser.add_argument("names", nargs="*", metavar="NAME", help="models to explore; default all")
    parser.add_argument("--tchecker", type=Path, help="the program tck-reach, a release build")
    parser.add_argument("--examples", type=Path, help="its folder of example generators")
    parser.add_argument("--models", type=Path, help="folder of the artefact with counts")
    parser.add_argument("--runs", type=int, default=3, help="the median is of so many runs")
    parser.add_argument("--folder", type=Path, default=Path("build/race"), help="for made models")
    parser.add_argument("--threads", type=int, default=1, help="compare one thread and so many")
    parser.add_argument("--explore", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.explore:
        _explore(arguments.explore, arguments.threads)
        return
    folder: Path = arguments.folder
    folder.mkdir(parents=True, exist_ok=True)

    def is_wanted(name: str) -> bool:
        return not arguments.names or name in arguments.names

    if arguments.threads > 1:
        print(f"One thread and {arguments.threads}:")
        public = (
            (name, path)
            for name, path, published in _published(arguments.models)
            if arguments.names or published <= MOST_STORED
        )
        for name, path in filter(lambda one: is_wanted(one[0]), chain(_made(folder), public)):
            _share(name, path, arguments)
        return
    print("Against TChecker (ours first; in brackets figures of a run elsewhere):")
    for race in RACES:
        if is_wanted(race.name):
            _race(race, arguments, folder)
    if is_wanted("peterson"):
        print("Without clocks:")
        mine = _count(f"peterson {UNTIMED_PROCESSES}", _untimed(folder), 1, None)
        print(f"{'':<22} transitions/s {UNTIMED_PROCESSES * mine.stored / mine.seconds:9.0f}")
    if arguments.models:
        print("Against published counts of UPPAAL (ours first):")
        for name, path, published in _published(arguments.models):
            if is_wanted(name) and (arguments.names or published <= MOST_STORED):
                _count(name, path, arguments.runs, published)


if __name__ == "__main__":
    main()
