"""What the independent check of a strategy costs, against solving the game.

    python tests/benchmarks/verified.py [--seconds 5] [--gibibytes 3] [--only NAME]

Three sets of games: the families of ``games.py``, each in the largest size that is solved within
the seconds, strategy included; a lift, and a belt that goes by observations, both also with
constants of 2^20 and more; and all games of ``tests/corpus`` whose strategies can be checked. Each
answer has a process of its own.

Seconds are those of the processor.

Printed are the seconds to find who wins, to solve the game with its strategy, and to check that
(what ``--verify`` takes beyond it), and how many times as long as solving the check takes, without
the first 0.2 s; the greatest resident memory beyond that of the loaded model of a process that
solves, and of one that checks too, without the first 32 MiB. At the end stand the greatest ratios,
also against who wins alone: for that the solver explores only what the winner needs, and keeps
nothing. A check that does not end, or that says no, is an error and ends the program with 1.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import games

from ntagen import checker
from ntagen.errors import InputError, ModelError

ROOT = Path(__file__).resolve().parents[2]

FREE_S = 0.2
"""A check may take so long beside the multiple of solving."""

FREE_MIB = 32.0
"""A process may take so much beside the multiple of solving: the interpreter, tables, pages."""

LIFT = """
clock move, door, call, idle;
int[0, 1] at;
bool open, asked;
process Lift() {{
  state Stay, Go {{ move <= {go} }}, Open {{ door <= {shut} }};
  init Stay;
  trans Stay -> Go {{ guard !open && idle >= 17; assign move = 0; }},
        Go -u-> Stay {{ guard move >= {arrive}; assign at = 1 - at, idle = 0; }},
        Stay -> Open {{ assign door = 0, open = true; }},
        Open -u-> Stay {{ guard door >= 150; assign open = false, idle = 0; }};
}}
process User() {{
  state Rest, Wait, Bad;
  init Rest;
  trans Rest -u-> Wait {{ guard call >= 701; assign call = 0, asked = true; }},
        Wait -> Rest {{ guard open && at == 1; assign asked = false, call = 0; }},
        Wait -u-> Bad {{ guard call > {late}; }};
}}
L = Lift(); U = User();
system L, U;
"""

BELT = """
clock move, load, rest;
bool heavy;
chan stop, go;
process Belt() {{
  state Rest, Loads {{ load <= {loaded} }}, Runs {{ move <= {far} }}, Full, Jam;
  init Rest;
  trans Rest -u-> Loads {{ guard rest >= {pause}; assign load = 0; }},
        Loads -u-> Runs {{ guard load >= {slow}; assign move = 0; }},
        Loads -u-> Runs {{ guard load < {quick}; assign move = 0, heavy = true; }},
        Runs -> Full {{ guard move >= {near}; sync stop?; assign rest = 0; }},
        Runs -u-> Jam {{ guard move >= {jam}; }},
        Full -> Rest {{ guard rest >= {short}; sync go?; assign rest = 0, heavy = false; }},
        Full -u-> Jam {{ guard rest >= {long}; }};
}}
process Hand() {{
  state Ready;
  init Ready;
  trans Ready -> Ready {{ sync stop!; }}, Ready -> Ready {{ sync go!; }};
}}
system Belt, Hand;
"""

BELT_NUMBERS = {
    "loaded": 500,
    "far": 900,
    "pause": 300,
    "slow": 201,
    "quick": 197,
    "near": 400,
    "jam": 800,
    "short": 101,
    "long": 301,
}


@dataclass(frozen=True, slots=True)
class Case:
    """A game with its name."""

    name: str
    text: str
    query: str


@dataclass(frozen=True, slots=True)
class Cost:
    """What an answer took."""

    verdict: str
    seconds: float
    mib: float
    verified: bool | None
    said: str


def _resident_mib() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _cost(case: Case, gibibytes: float, seconds: float, wanted: str) -> Cost | None:
    """What an answer takes in a process of its own; nothing if the query is refused."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        said: dict[str, object] = {}
        try:
            model = checker.load(case.text)
            before = _resident_mib()
            start_s = time.process_time()
            answer = model.check(
                case.query,
                timeout_s=seconds,
                memory_bytes=int(gibibytes * 2**30),
                strategy=wanted != "verdict",
                verify=wanted == "check",
            )
            said = {
                "verdict": answer.stop or answer.verdict,
                "seconds": time.process_time() - start_s,
                "mib": _resident_mib() - before,
                "verified": answer.verified,
                "said": "; ".join(answer.verification or ())[:200],
            }
        except (InputError, ModelError):
            pass
        finally:
            os.write(writing, json.dumps(said).encode())
            os._exit(0)
    os.close(writing)
    with os.fdopen(reading) as pipe:
        text = pipe.read()
    os.waitpid(child, 0)
    return Cost(**json.loads(text)) if text not in ("", "{}") else None


def _families(seconds: float, gibibytes: float, only: str) -> Iterator[Case]:
    """The families, each in the largest size that is solved within the seconds."""
    for game in games.GAMES:
        name = f"{game.family} {game.variant}"
        if only not in name:
            continue
        size, last = 0, None
        while size < games.MOST_CLOCKS:
            size = max(size + 1, size * 5 // 4)
            case = Case(f"{name} {size}", game.at(size), game.query)
            cost = _cost(case, gibibytes, seconds, "strategy")
            if cost is None or cost.verdict not in ("satisfied", "not satisfied"):
                break
            last = case
        if last is not None:
            yield last


def _constants() -> Iterator[Case]:
    query = "control: A[] not U.Bad"
    small = {"go": 430, "shut": 310, "arrive": 290, "late": 2003}
    yield Case("lift", LIFT.format(**small), query)
    great = {name: (value << 20) // 430 for name, value in small.items()}
    yield Case("lift, constants of 2^20", LIFT.format(**great), query)
    for name, factor in (("belt", 1), ("belt, constants of 2^20", (1 << 20) // 400)):
        numbers = {name: value * factor for name, value in BELT_NUMBERS.items()}
        seen = f"Belt.Runs, Belt.Full, move >= {500 * factor}, rest >= {200 * factor}"
        yield Case(name, BELT.format(**numbers), f"{{{seen}}} control: A[] not Belt.Jam")


def _corpus() -> Iterator[Case]:
    for path in sorted((ROOT / "tests/corpus/games").glob("*.xta")):
        text = path.read_text()
        queries = re.findall(r"^// query: (.*control.*)$", text, re.MULTILINE)
        for index, query in enumerate(queries):
            yield Case(f"{path.stem} {index}", text, query.strip())


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--gibibytes", type=float, default=3.0)
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    most: dict[str, float] = {}
    is_wrong = False
    print(f"{'game':<44}{'wins s':>9}{'solve s':>9}{'check s':>9}{'times':>7}", end="")
    print(f"{'MiB':>8}{'with':>8}{'times':>7}")
    cases = [*_families(arguments.seconds, arguments.gibibytes, arguments.only)]
    cases += [case for case in (*_constants(), *_corpus()) if arguments.only in case.name]
    for case in cases:
        longest = 20 * arguments.seconds
        wins = _cost(case, arguments.gibibytes, longest, "verdict")
        solved = _cost(case, arguments.gibibytes, longest, "strategy")
        checked = _cost(case, arguments.gibibytes, longest, "check")
        if wins is None or solved is None or checked is None or not checked.said:
            continue
        check_s = max(0.0, checked.seconds - solved.seconds)
        charged_s, charged_mib = max(0.0, check_s - FREE_S), max(0.0, checked.mib - FREE_MIB)
        times, memory = charged_s / max(solved.seconds, 1e-6), charged_mib / max(solved.mib, 1.0)
        print(
            f"{case.name:<44}{wins.seconds:9.3f}{solved.seconds:9.3f}{check_s:9.3f}{times:7.2f}"
            f"{solved.mib:8.1f}{checked.mib:8.1f}{memory:7.2f}",
            flush=True,
        )
        if checked.verified is not True:
            print(f"    {checked.said}")
            is_wrong = True
        ratios = {
            "the time of solving": times,
            "the memory of solving": memory,
            "the time of who wins alone": charged_s / max(wins.seconds, 1e-6),
            "the memory of who wins alone": charged_mib / max(wins.mib, 1.0),
        }
        most = {name: max(most.get(name, 0.0), ratio) for name, ratio in ratios.items()}
    told = (f"{ratio:.2f} times {name}" for name, ratio in most.items())
    print("greatest:", ", ".join(told))
    sys.exit(int(is_wrong))


if __name__ == "__main__":
    main()
