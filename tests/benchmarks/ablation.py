"""What each heuristic of the engine gains: time and states with it switched off, and its lines.

    python tests/benchmarks/ablation.py [--part NAME] [--member NAME] [--models FOLDER] [--runs 3]

Every member of the benchmark set is asked with all heuristics and with each of them switched off
(``ntagen check --set 'without NAME'``). Printed is, for each heuristic, what it gains at most, with
``KEEP`` if that is at least 15 % of the time or of the states of one member, else ``GO``; below it
stand the members for which the time or the states differ. A heuristic is asked about the members
only that it can matter to: searches, games, or all.

``--models`` adds ``E<> false`` for each model of a folder, up to 40,000 states. ``--first`` ends
with a heuristic at the first member that shows that it is worth its lines. Each answer has a
process of its own. Times are processor times with and without the heuristic in turn; the least of
the runs counts. A verdict that depends on a heuristic is an error, and ends the program with 1.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import time
from collections import deque
from collections.abc import Iterator
from dataclasses import astuple, dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

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

MOST_STATES = 40_000
"""Of a model of a folder so many states are stored at most."""

MOST_SECONDS = 10
"""Members that take longer with all heuristics are left out."""

LEAST_SECONDS = 0.02
"""Times below are not compared: they are mostly noise."""

UNCERTAIN = 0.05
"""Times that differ by more than this part of them are measured again."""


@dataclass(frozen=True, slots=True)
class Part:
    """A heuristic: what it can matter to, and the files that are there for it alone."""

    kinds: str
    files: tuple[str, ...] = ()


PARTS = {
    "transition_cache": Part("both", ("network/discrete/transition_cache.rs",)),
    "select_cache": Part("both", ("network/discrete/select_cache.rs",)),
    "pairing": Part("both", ("network/discrete/pairing.rs",)),
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
    "lazy_zero_time": Part("game", ("game/exploration/lazy_zero_time.rs",)),
    "lazy_safety": Part(
        "game", ("game/exploration/lazy_safety.rs", "game/exploration/held_moves.rs")
    ),
    "losing_untimed": Part("game", ("game/backward/losing_untimed.rs",)),
    "losing_timed": Part("game", ("game/backward/losing_timed.rs",)),
    "relevance": Part("game"),
    "delayed_zones": Part("game"),
    "full_backward": Part("game", ("game/backward/full_backward.rs",)),
    "exact_first": Part("game"),
    "compiled_runs": Part("runs", ("stochastic/race_code",)),
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


def searches() -> Iterator[Member]:
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
    yield of("switchboard 18", models.switchboard(18, 6), states=40_000)
    yield of("rumours 5", models.rumours(5), states=20_000)
    yield of("beacons 20", models.beacons(20), states=6_000)
    yield of("lamps 5", models.lamps(5))
    yield of("relays 4", models.relays(4))
    yield of("sorters 2", models.sorters(2))
    yield of("resets 6", models.resets(6, 9))
    yield of("menu 20", models.menu(20), "E<> Cook1.done")
    yield of("fischer 7, deadlock", models.fischer(7), DEADLOCK)
    yield of("csmacd 7, deadlock", models.csmacd(7), DEADLOCK)
    yield of("train gate 4, deadlock", models.train_gate(4), DEADLOCK)
    yield of("peterson 4, deadlock", models.peterson(4), DEADLOCK)
    yield of("dining 5, deadlock", models.dining_philosophers(5), DEADLOCK)
    yield of("fischer 6, liveness", models.fischer(6), "P(1).request --> P(1).waiting")
    yield of("train gate 4, liveness", models.train_gate(4), "Train(1).approaching --> Gate.free")
    yield of("csmacd 7, sup", models.csmacd(7), "sup: Station(1).x, Bus.next", trace=False)
    yield of("fischer 7, shortest", models.fischer(7), "E<> P(7).critical && id == 1")
    yield of("needle, reachable", _needle(2), "E<> Checker.Final_TR_Reached && false")


def games_of_set() -> Iterator[Member]:
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
    yield family("queue", bridge, 4)
    yield family("standoff", "control: A[] not friend_fell[0]", 2)
    yield family("standoff", fell, 2)
    yield family("circuit", again, 3)
    yield family("patrol", HOME, 60)
    text = _game("trains", bridge, 4)
    yield of("trains 4, strategy", text, bridge, strategy=True)
    yield of("store, safety", models.store(), "control: A[] stock >= 0 && stock <= 40")
    yield of("duel", models.duel(), "control: A<> life[1] == 0")
    # Two clocks are compared.
    yield of("ring 4, differences", models.ring(4, 4), "control: A[] hits < 2")
    clocks = text.replace("clock x;", "clock x, y;").replace("x = 0; }}", "x = 0; }}")
    apart = clocks.replace("guard x >= 10;", "guard x >= 10 && y - x >= 0;")
    yield of("trains 3, differences", apart.replace("N = 4", "N = 3"), bridge)


def random_runs() -> Iterator[Member]:
    def of(name: str, text: str, query: str) -> Member:
        return Member(name, "runs", text, query, {"runs": 100_000})

    yield of("ferries 6", models.ferries(6), "Pr[<=200](<> waiting == 5)")
    yield of("till 20", models.till(20), "Pr[<=100](<> length == 20)")
    yield of("till 20, greatest", models.till(20), "E[<=100; 1](max: length)")


def _of_folder(folder: Path) -> Iterator[Member]:
    for path in sorted([*folder.rglob("*.xml"), *folder.rglob("*.xta")]):
        text = path.read_text(encoding="utf-8")
        yield Member(path.stem, "search", text, options={"states": MOST_STATES})


def answered(member: Member, without: str, most_seconds: float) -> Measured:
    """What the answer to a member's question takes in this process."""
    name = "model.xml" if member.text.lstrip().startswith("<") else "model.xta"
    model = checker.load(member.text, name)
    names = [without] if without else []
    start = time.process_time()
    most = int(start + most_seconds) + 2
    resource.setrlimit(resource.RLIMIT_CPU, (most, most))
    answer = model.check(member.query, without=names, **member.options)
    seconds = time.process_time() - start
    value = f"{answer.value} {answer.plan_count}"
    return Measured(answer.verdict, value, answer.explored, answer.stored, seconds)


Question: TypeAlias = tuple[Member, str]
"""A member, and the heuristic that is switched off."""


class Bench:
    """Asks members, each in a process of its own."""

    def __init__(self, jobs: int) -> None:
        """So many processes run side by side."""
        self.jobs = jobs
        self.default: dict[str, Measured] = {}

    def _most_seconds(self, member: Member) -> float:
        default = self.default.get(member.name)
        return SLOWER * default.seconds if default else MOST_SECONDS

    def _begin(self, question: Question) -> tuple[int, int]:
        """Starts a process that answers: its number, and the end of a pipe from it."""
        own, other = os.pipe()
        child = os.fork()
        if child:
            os.close(other)
            return child, own
        try:
            measured = answered(*question, self._most_seconds(question[0]))
            os.write(other, json.dumps(astuple(measured)).encode())
            os._exit(0)
        except BaseException as error:
            os.write(2, f"{error}\n".encode())
            os._exit(1)

    def _end(self, question: Question, child: int, pipe: int) -> Measured:
        with os.fdopen(pipe, "rb") as stream:
            text = stream.read()
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        if status > 0:
            raise SystemExit(f"{question[0].name} without {question[1] or 'nothing'} failed")
        if status < 0:
            return Measured(None, "", 0, 0, self._most_seconds(question[0]))
        return Measured(*json.loads(text))

    def ask(self, questions: list[Question]) -> list[Measured]:
        """The answers to questions, in their order."""
        running: deque[tuple[Question, int, int]] = deque()
        answers: list[Measured] = []
        for question in questions:
            if len(running) == self.jobs:
                answers.append(self._end(*running.popleft()))
            running.append((question, *self._begin(question)))
        return answers + [self._end(*one) for one in running]


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
    """Compares a member with and without a heuristic, in turn; again if the times may differ."""
    before, after = bench.ask([(member, ""), (member, part)])
    if after.verdict is None:
        return Row(member, SLOWER, 1.0, True)
    states = max(after.explored / max(before.explored, 1), after.stored / max(before.stored, 1))
    is_known = "unknown" not in (before.verdict, after.verdict)
    is_same = not is_known or (after.verdict, after.value) == (before.verdict, before.value)
    times = [(before.seconds, after.seconds)]
    if abs(ratio(after.seconds, before.seconds) - 1.0) > UNCERTAIN:
        answers = bench.ask([(member, ""), (member, part)] * (runs - 1))
        times += [
            (one.seconds, other.seconds)
            for one, other in zip(answers[::2], answers[1::2], strict=True)
        ]
    # What else the machine does can only add to a time.
    least_before, least_after = (min(column) for column in zip(*times, strict=True))
    return Row(member, ratio(least_after, least_before), states, is_same)


def ratio(after: float, before: float) -> float:
    return 1.0 if max(after, before) < LEAST_SECONDS else after / max(before, 0.001)


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
    for member in wanted:
        rows.append(_row(bench, member, name, arguments.runs))
        if arguments.first and rows[-1].gain >= WORTH:
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
    parser.add_argument("--runs", type=int, default=3, help="at most so many of each")
    parser.add_argument("--jobs", type=int, default=1, help="processes side by side")
    parser.add_argument("--first", action="store_true", help="end at the first gain")
    parser.add_argument("--all", action="store_true", help="print members without a gain too")
    arguments = parser.parse_args()
    if unknown := set(PARTS) ^ set(checker.HEURISTICS):
        raise SystemExit(f"not in both tables: {', '.join(sorted(unknown))}")
    members = [*searches(), *games_of_set(), *random_runs()]
    if arguments.models:
        members += _of_folder(arguments.models)
    if arguments.member:
        members = [one for one in members if any(name in one.name for name in arguments.member)]
    bench = Bench(arguments.jobs)
    print("With all heuristics:")
    answers = bench.ask([(member, "") for member in members])
    for member, measured in zip(members, answers, strict=True):
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
