"""How fast the engine explores whole state spaces, against TChecker and against published figures.

    python tests/benchmarks/race.py [--tchecker tck-reach] [--models FOLDER] [--runs 3] [NAME]...

With ``--tchecker`` the same automata, made by the example generators of TChecker's sources (found
beside the program, or by ``--examples``), are explored in the same run by ``tck-reach -a
covreach``, in turn with the engine; without it the figures of a run elsewhere stand in, in
brackets. ``--models`` names a folder with the public models whose counts by UPPAAL are published
(DynamicExtrapolation benchmarks, without type ranges); without it they are left out.

Every exploration has a process of its own. Seconds are user CPU seconds, of the engine those of
the check alone, its code's compilation included; memory is the growth of the resident set from
the loaded model to its peak, of TChecker the whole. The median of the runs is printed.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
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


RACES = (
    Race("fischer 9", models.fischer, "fischer", 9, 81_035, 10.8, 54),
    Race("fischer 10", models.fischer, "fischer", 10, 260_998, 50.4, 141),
    Race("csmacd 9", models.csmacd, "csmacd", 9, 55_554, 3.40, 42),
    Race("csmacd 10", models.csmacd, "csmacd", 10, 144_898, 12.1, 78),
    Race("csmacd 11", models.csmacd, "csmacd", 11, 369_666, 38.2, 163),
    Race("train gate 5", models.train_gate, "train_gate", 5, 215_375, 4.73, 70),
    Race("dining 7", models.dining_philosophers, "dining-philosophers", 7, 38_179, 11.0, 43),
    Race("fddi 10", models.fddi, "fddi", 10, 525, 2.13, 79),
)

PUBLISHED = {
    "gossip-dyn-5": 1_657_823,
    "gossip-smart-dyn-5": 625_533,
    "leader-election-3N": 85_626,
    "printing-projects-2-8": 638_977,
    "tcp-aimd-3": 5_007_512,
    "firefly-sync-W2-H1-N4": 167_359,
}
"""What UPPAAL stores with LU extrapolation: artefact of "Dynamic Extrapolation", ICFEM 2023."""

UNTIMED_PROCESSES = 5
"""Processes of Peterson's algorithm; in every state each of them has exactly one transition."""


@dataclass(frozen=True, slots=True)
class Measured:
    """What one exploration took."""

    stored: int
    seconds: float
    mb: float
    accounted_mb: float = 0.0


def _resident_mb(key: str) -> float:
    """A size of this process that Linux reports in kB, for example ``VmHWM``, the peak."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    line = next(line for line in lines if line.startswith(key + ":"))
    return int(line.split()[1]) / 1024


def _explore(path: Path) -> None:
    """Explores a model in this process and prints what it took as JSON."""
    model = checker.load_file(path)
    before = _resident_mb("VmRSS")
    start = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    answer = model.check(QUERY)
    seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - start
    if answer.verdict != "not satisfied":
        raise SystemExit(f"{path}: {answer.verdict}")
    mb = _resident_mb("VmHWM") - before
    print(json.dumps([answer.stored, seconds, mb, answer.peak_bytes / 2**20]))


def _run_engine(path: Path) -> Measured:
    command = [sys.executable, __file__, "--explore", str(path)]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return Measured(*json.loads(output))


def _run_tchecker(program: Path, path: Path) -> Measured:
    with subprocess.Popen(
        [program, "-a", "covreach", path], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        output = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    counts = dict(line.split(maxsplit=1) for line in output.splitlines() if " " in line)
    return Measured(int(counts["STORED_STATES"]), usage.ru_utime, usage.ru_maxrss / 1024)


def _median(runs: list[Measured]) -> Measured:
    columns = zip(*((run.seconds, run.mb, run.accounted_mb) for run in runs), strict=True)
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
            path.with_suffix(".tck").write_bytes(text)
            other.append(_run_tchecker(arguments.tchecker, path.with_suffix(".tck")))
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
    """Explores a model whose counts are known and prints how it went."""
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


def main() -> None:
    """Runs all races that were asked for."""
    summary = (__doc__ or "").splitlines()[0]
    parser = argparse.ArgumentParser(description=summary)
    parser.add_argument("names", nargs="*", metavar="NAME", help="models to explore; default all")
    parser.add_argument("--tchecker", type=Path, help="the program tck-reach, a release build")
    parser.add_argument("--examples", type=Path, help="its folder of example generators")
    parser.add_argument("--models", type=Path, help="folder of the public models with counts")
    parser.add_argument("--runs", type=int, default=3, help="the median is of so many runs")
    parser.add_argument("--folder", type=Path, default=Path("build/race"), help="for made models")
    parser.add_argument("--explore", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.explore:
        _explore(arguments.explore)
        return
    folder: Path = arguments.folder
    folder.mkdir(parents=True, exist_ok=True)

    def is_wanted(name: str) -> bool:
        return not arguments.names or name in arguments.names

    print("Against TChecker (ours first; in brackets figures of a run elsewhere):")
    for race in RACES:
        if is_wanted(race.name):
            _race(race, arguments, folder)
    if is_wanted("peterson"):
        print("Without clocks:")
        path = folder / "peterson.xta"
        path.write_text(models.peterson(UNTIMED_PROCESSES), encoding="utf-8")
        mine = _count(f"peterson {UNTIMED_PROCESSES}", path, 1, None)
        print(f"{'':<22} transitions/s {UNTIMED_PROCESSES * mine.stored / mine.seconds:9.0f}")
    if arguments.models:
        print("Against published counts of UPPAAL (ours first):")
        for name, published in PUBLISHED.items():
            found = sorted(arguments.models.rglob(f"{name}.xml"))
            if is_wanted(name) and found:
                _count(name, found[0], arguments.runs, published)


if __name__ == "__main__":
    main()
