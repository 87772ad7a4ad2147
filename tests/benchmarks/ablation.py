"""What each heuristic of the engine gains: time and states with it switched off, and its lines.

    python tests/benchmarks/ablation.py [--part NAME] [--member NAME] [--models FOLDER] [--runs 3]

Every member of the benchmark set is asked with all heuristics, and then with each of them switched
off (``ntagen check --without NAME``). Printed is, for each heuristic, a line for each member: the
processor time and the explored states without it, as multiples of those with it. Below it stands
what it gains at most; ``KEEP`` if that is at least 15 % of the time or of the states of one member,
else ``GO``. A heuristic is asked about the members only that it can matter to: searches, games,
or all.

``--models`` adds ``E<> false`` for each model of a folder. ``--first`` ends with a heuristic at the
first member that shows that it is worth its lines. Seconds are user seconds of a process of its
own; where they decide, the median of the runs counts. A verdict that depends on a heuristic is an
error, and ends the program with 1.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import games
import models

from ntagen import checker
from ntagen.nsl import load
from ntagen.render import render

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ROOT / "checker/src"

WORTH = 1.15
"""A heuristic is worth its lines if some member takes so many times as much without it."""

SLOWER = 10
"""A member is given up without a heuristic when it takes so many times as long as with it."""

MOST_SECONDS = 10
"""Members that take longer with all heuristics are left out."""

LEAST_SECONDS = 0.05
"""Times below are not compared: they are mostly noise."""


@dataclass(frozen=True, slots=True)
class Part:
    """A heuristic: what it can matter to, and the files that are there for it alone."""

    kinds: str
    files: tuple[str, ...] = ()


PARTS = {
    "transition_cache": Part("both", ("network/discrete/transition_cache.rs",)),
    "select_cache": Part("both", ("network/discrete/select_cache.rs",)),
    "pairing": Part("both", ("network/discrete/pairing.rs",)),
    "listening": Part("both", ("network/discrete/listening.rs",)),
    "broadcast_filter": Part("both", ("network/discrete/broadcast_filter.rs",)),
    "broadcast_receivers": Part("both", ("network/discrete/broadcast_receivers.rs",)),
    "successor_cache": Part("search", ("network/symbolic/successor_cache.rs",)),
    "constant_effect": Part("search", ("network/symbolic/constant_effect.rs",)),
    "deadlock_witness": Part("search"),
    "location_splitting": Part("both", ("analysis/location_splitting.rs",)),
    "joint_resets": Part("both", ("analysis/joint_resets.rs",)),
    "simulation": Part("search", ("zones/simulation.rs",)),
    "coarser_first": Part("search"),
    "time_stoppers": Part("search", ("network/reduction/time_stoppers.rs",)),
    "zero_time_cycles": Part("search", ("analysis/zero_time_cycles.rs",)),
    "recent_states": Part("search", ("search/reachability/recent.rs",)),
    "signatures": Part("search", ("search/store/signature.rs",)),
    "split_lists": Part("search", ("search/store/zone_lists.rs",)),
    "narrow_zones": Part("search"),
    "kept_signatures": Part("search"),
    "chains": Part("game"),
    "chain_cache": Part("game", ("game/forward/chain_cache.rs", "game/forward/chain_following.rs")),
    "dead_ends": Part(
        "game",
        (
            "game/forward/dead_ends.rs",
            "game/forward/dead_end_node.rs",
            "game/exploration/dead_ends.rs",
            "analysis/may_hold.rs",
        ),
    ),
    "discrete_nodes": Part("game", ("engine/query/budgets.rs",)),
    "dives": Part("game", ("game/exploration/waiting.rs",)),
    "spoilers": Part("game"),
    "lazy_zero_time": Part("game", ("game/exploration/lazy_zero_time.rs", "game/exploration/reserve.rs")),
    "lazy_safety": Part("game", ("game/exploration/lazy_safety.rs", "game/exploration/held_moves.rs")),
    "losing_untimed": Part("game", ("game/backward/losing_untimed.rs",)),
    "losing_timed": Part("game", ("game/backward/losing_timed.rs", "game/exploration/schedule.rs")),
    "relevance": Part("game"),
    "delayed_zones": Part("game"),
    "result_cache": Part("game", ("game/backward/result_cache.rs", "game/backward/known_results.rs")),
    "full_backward": Part("game", ("game/backward/full_backward.rs",)),
    "exact_first": Part("game"),
    "inlining": Part("both", ("exec/optimise/inline.rs",)),
    "specialising": Part("both"),
    "unrolling": Part("both", ("exec/optimise/unroll.rs",)),
    "value_numbering": Part("both", ("exec/optimise/numbering",)),
    "dead_code": Part("both", ("exec/optimise/dead.rs",)),
    "interpret_first": Part("both", ("exec/jit/needs.rs",)),
}


@dataclass(frozen=True, slots=True)
class Member:
    """A question about a model."""

    name: str
    kind: str
    text: str
    query: str = "E<> false"
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Measured:
    """What an answer took; ``None`` as verdict if it was given up."""

    verdict: str | None
    value: str
    explored: int
    stored: int
    seconds: float


def _needle(rolls: int) -> str:
    scene = load(ROOT / "examples/paper.nsl")
    return render(replace(scene, limits=replace(scene.limits, max_rolls=rolls)))


def _game(family: str, query: str, size: int, variant: str = "uncontrollable") -> str:
    found = (
        one
        for one in games.GAMES
        if (one.family, one.variant) == (family, variant) and one.query == query
    )
    return next(found).at(size)


DEADLOCK = "A[] not deadlock"
DONE = "control: A<> forall (i : id_t) Plate(i).Done"
NOT_FALLEN = "control: A[] forall (i : id_t) not Plate(i).Fallen"
LEAST_TIME = "control_t*: A<> forall (i : id_t) Job(i).Done"
HOME = "control: A[] (true && A<> Guard.Home)"
PLANS = "control: A<> Checker.Final_TR_Reached"


def _searches() -> Iterator[Member]:
    def of(name: str, text: str, query: str = "E<> false", **options: object) -> Member:
        return Member(name, "search", text, query, options)

    yield of("fischer 8", models.fischer(8))
    yield of("csmacd 8", models.csmacd(8))
    yield of("train gate 5", models.train_gate(5))
    yield of("dining 6", models.dining_philosophers(6))
    yield of("fddi 10", models.fddi(10))
    yield of("corsso 3", models.corsso(3))
    yield of("peterson 4", models.peterson(4))
    yield of("alarms 6", models.alarms(6))
    yield of("roll call 14", models.roll_call(14))
    yield of("entangled 5", models.entangled(5))
    yield of("samplers 3", models.samplers(3))
    yield of("beacons 6", models.beacons(6))
    yield of("couriers 4", models.couriers(4))
    yield of("lamps 6", models.lamps(6))
    yield of("relays 5", models.relays(5))
    yield of("sorters 2", models.sorters(2))
    yield of("fischer 7, deadlock", models.fischer(7), DEADLOCK)
    yield of("csmacd 7, deadlock", models.csmacd(7), DEADLOCK)
    yield of("train gate 4, deadlock", models.train_gate(4), DEADLOCK)
    yield of("dining 5, deadlock", models.dining_philosophers(5), DEADLOCK)
    yield of("fischer 6, liveness", models.fischer(6), "P(1).request --> P(1).waiting")
    yield of("train gate 4, liveness", models.train_gate(4), "Train(1).approaching --> Gate.free")
    yield of("csmacd 7, sup", models.csmacd(7), "sup: Station(1).x, Bus.next", trace=False)
    yield of("fischer 7, shortest", models.fischer(7), "E<> P(7).critical && id == 1")
    yield of("needle, reachable", _needle(2), "E<> Checker.Final_TR_Reached && false")


def _games() -> Iterator[Member]:
    def of(name: str, text: str, query: str, **options: object) -> Member:
        return Member(name, "game", text, query, options)

    def family(name: str, query: str, size: int, variant: str = "uncontrollable") -> Member:
        text = _game(name, query, size, variant)
        short = query.removeprefix("control").removeprefix(": ")
        mark = {"controllable": "c", "uncontrollable": "u"}[variant]
        return of(f"{name} {size}{mark} {short[:24]}", text, query)

    bridge, fell, again = games.ONE_ON_THE_BRIDGE, games.NONE_FELL, games.FIRST_AGAIN_AND_AGAIN
    yield of("needle, all plans", _needle(2), PLANS, plans="all")
    yield of("needle, one plan", _needle(3), PLANS, plans="all", max_plans=1)
    yield of("needle, strategy", _needle(2), PLANS, strategy=True)
    yield family("cell", DONE, 8)
    yield family("cell", DONE, 8, "controllable")
    yield family("cell", NOT_FALLEN, 12)
    yield family("cell", NOT_FALLEN, 20, "controllable")
    yield family("trains", bridge, 5)
    yield family("trains", bridge, 20, "controllable")
    yield family("trains", "control: A<> Train(0).Bridge", 20)
    yield family("trains", "control: A<> Train(0).Bridge", 8, "controllable")
    yield family("jobs", LEAST_TIME, 5)
    yield family("jobs", LEAST_TIME, 5, "controllable")
    yield family("queue", bridge, 5)
    yield family("standoff", "control: A[] not friend_fell[0]", 2)
    yield family("standoff", fell, 2)
    yield family("circuit", again, 3)
    yield family("patrol", HOME, 60)
    text = _game("trains", bridge, 4)
    yield of("trains 4, strategy", text, bridge, strategy=True)
    # Two clocks are compared.
    clocks = text.replace("clock x;", "clock x, y;").replace("x = 0; }}", "x = 0; }}")
    apart = clocks.replace("guard x >= 10;", "guard x >= 10 && y - x >= 0;")
    yield of("trains 3, differences", apart.replace("N = 4", "N = 3"), bridge)


def _of_folder(folder: Path) -> Iterator[Member]:
    for path in sorted([*folder.rglob("*.xml"), *folder.rglob("*.xta")]):
        yield Member(path.stem, "search", path.read_text(encoding="utf-8"))


def _answer(path: Path, without: str) -> None:
    """Answers the question in a file in this process, and prints what it took."""
    asked = json.loads(path.read_text(encoding="utf-8"))
    name = "model.xml" if asked["text"].lstrip().startswith("<") else "model.xta"
    model = checker.load(asked["text"], name)
    names = [without] if without else []
    start = resource.getrusage(resource.RUSAGE_SELF).ru_utime
    most = SLOWER * asked["seconds"] if asked["seconds"] else MOST_SECONDS
    most = int(start + most) + 2
    resource.setrlimit(resource.RLIMIT_CPU, (most, most))
    answer = model.check(asked["query"], without=names, **asked["options"])
    seconds = resource.getrusage(resource.RUSAGE_SELF).ru_utime - start
    value = f"{answer.value} {answer.plan_count}"
    print(json.dumps([answer.verdict, value, answer.explored, answer.stored, seconds]))


class Bench:
    """Asks members in processes of their own."""

    def __init__(self, folder: Path) -> None:
        """Questions are written into the folder."""
        self.folder = folder
        self.default: dict[str, Measured] = {}

    def ask(self, member: Member, without: str = "", run: int = 0) -> Measured:
        """The answer to a member's question without a heuristic."""
        default = self.default.get(member.name)
        asked = {
            "text": member.text,
            "query": member.query,
            "options": member.options,
            "seconds": default.seconds if default else None,
        }
        path = self.folder / f"{abs(hash((member.name, without, run)))}.json"
        path.write_text(json.dumps(asked), encoding="utf-8")
        command = [sys.executable, __file__, "--answer", str(path), "--without", without]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        path.unlink()
        if done.returncode > 0:
            raise SystemExit(f"{member.name} without {without or 'nothing'}: {done.stderr}")
        if done.returncode < 0:
            return Measured(None, "", 0, 0, SLOWER * default.seconds if default else MOST_SECONDS)
        return Measured(*json.loads(done.stdout))

    def median(self, member: Member, without: str, runs: int) -> Measured:
        """The same, with the median of several times."""
        all_runs = [self.ask(member, without, run) for run in range(runs)]
        seconds = statistics.median(one.seconds for one in all_runs)
        return replace(all_runs[0], seconds=seconds)


@dataclass(frozen=True, slots=True)
class Row:
    """What a member takes without a heuristic, as multiples of what it takes with it."""

    member: Member
    seconds: float
    states: float
    is_same: bool

    @property
    def gain(self) -> float:
        """The greater of both."""
        return max(self.seconds, self.states)


def _row(bench: Bench, member: Member, part: str, runs: int) -> Row:
    """Compares a member with and without a heuristic, again where the time decides."""
    before = bench.default[member.name]
    after = bench.ask(member, part)
    if after.verdict is None:
        return Row(member, SLOWER, 1.0, True)
    states = max(after.explored / max(before.explored, 1), after.stored / max(before.stored, 1))
    is_same = (after.verdict, after.value) == (before.verdict, before.value)
    seconds = _ratio(after.seconds, before.seconds)
    if states < WORTH and seconds >= WORTH and runs > 1:
        after = bench.median(member, part, runs)
        before = bench.median(member, "", runs)
        seconds = _ratio(after.seconds, before.seconds)
    return Row(member, seconds, states, is_same)


def _ratio(after: float, before: float) -> float:
    return 1.0 if max(after, before) < LEAST_SECONDS else after / max(before, 0.01)


def _lines(part: Part) -> int:
    """Lines of the files of a heuristic, without their tests."""
    paths = (SOURCES / name for name in part.files)
    files = (sorted(path.rglob("*.rs")) if path.is_dir() else [path] for path in paths)
    texts = (path.read_text(encoding="utf-8") for group in files for path in group)
    return sum(text.split("#[cfg(test)]")[0].count("\n") for text in texts)


def _ablate(bench: Bench, name: str, members: list[Member], arguments: argparse.Namespace) -> bool:
    """Prints what members take without a heuristic; returns whether all verdicts are the same."""
    part = PARTS[name]
    wanted = [one for one in members if part.kinds in ("both", one.kind)]
    rows: list[Row] = []
    with ThreadPoolExecutor(arguments.jobs) as pool:
        for start in range(0, len(wanted), arguments.jobs):
            some = wanted[start : start + arguments.jobs]
            rows += pool.map(lambda one: _row(bench, one, name, arguments.runs), some)
            if arguments.first and any(row.gain >= WORTH for row in rows):
                break
    best = max(rows, key=lambda row: row.gain)
    is_worth = best.gain >= WORTH
    lines = _lines(part)
    print(
        f"{name:20} {lines:5} lines  {'KEEP' if is_worth else 'GO':4} "
        f"{best.member.name}: time {best.seconds:.2f}, states {best.states:.2f}",
        flush=True,
    )
    for row in rows:
        mark = "" if row.is_same else "  THE ANSWER IS ANOTHER ONE"
        if arguments.all or mark or row.gain >= WORTH or row.gain <= 1 / WORTH:
            member = f"{row.member.name:34}"
            print(
                f"    {member} time {row.seconds:6.2f}  states {row.states:8.2f}{mark}", flush=True
            )
    return all(row.is_same for row in rows)


def main() -> None:
    """Prints a table for each heuristic."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--part", action="append", choices=sorted(PARTS), help="default all")
    parser.add_argument("--member", action="append", help="members by a part of their names")
    parser.add_argument("--models", type=Path, help="a folder with further models")
    parser.add_argument("--runs", type=int, default=3, help="the median is of so many runs")
    parser.add_argument("--jobs", type=int, default=1, help="processes side by side")
    parser.add_argument("--first", action="store_true", help="end at the first gain")
    parser.add_argument("--all", action="store_true", help="print members without a gain too")
    parser.add_argument("--answer", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--without", default="", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.answer:
        _answer(arguments.answer, arguments.without)
        return
    if unknown := set(PARTS) ^ set(checker.HEURISTICS):
        raise SystemExit(f"not in both tables: {', '.join(sorted(unknown))}")
    members = [*_searches(), *_games()]
    if arguments.models:
        members += _of_folder(arguments.models)
    if arguments.member:
        members = [one for one in members if any(name in one.name for name in arguments.member)]
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder))
        print("With all heuristics:")
        with ThreadPoolExecutor(arguments.jobs) as pool:
            for member, measured in zip(members, pool.map(bench.ask, members), strict=True):
                if measured.verdict is not None:
                    bench.default[member.name] = measured
                print(
                    f"    {member.name:34} {measured.verdict!s:14} explored {measured.explored:8} "
                    f"stored {measured.stored:8} s {measured.seconds:6.2f}",
                    flush=True,
                )
        members = [one for one in members if one.name in bench.default]
        names = arguments.part or list(PARTS)
        same = [_ablate(bench, name, members, arguments) for name in names]
    if not all(same):
        raise SystemExit("Answers depend on heuristics.")


if __name__ == "__main__":
    main()
