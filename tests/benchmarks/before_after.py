"""How long the benchmark set takes with this engine and with another one, in turn.

    python tests/benchmarks/before_after.py OTHER/.venv/bin/python [--runs 5] [--member NAME]

The benchmark set is that of ``ablation.py``. Each answer has a process of its own; the processes of
the two engines take turns. Printed are the medians of the processor times of both, their ratio, and
whether both give the same verdict, value and numbers of states. Ends with 1 if a verdict or a value
differs, or if a median is more than ``--slower`` times as long (times below 20 ms do not count).
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
from dataclasses import astuple
from pathlib import Path

import ablation

ASK = """
import json, sys
sys.path.insert(0, sys.argv[1])
import ablation
from dataclasses import astuple
member = ablation.Member(**json.load(sys.stdin))
print(json.dumps(astuple(ablation.answered(member, "", 600))))
"""


def _measured(python: str, member: ablation.Member) -> ablation.Measured:
    """What a member takes with the engine of an interpreter."""
    fields = dict(zip(("name", "kind", "text", "query", "options"), astuple(member), strict=True))
    folder = str(Path(__file__).parent)
    # Python takes packages from the current folder first, which must not be a clone.
    done = subprocess.run(
        [python, "-c", ASK, folder],
        input=json.dumps(fields),
        capture_output=True,
        text=True,
        cwd=folder,
    )
    if done.returncode:
        raise SystemExit(f"{member.name} with {python} failed:\n{done.stderr}")
    return ablation.Measured(*json.loads(done.stdout))


def _median_s(answers: list[ablation.Measured]) -> float:
    return statistics.median(answer.seconds for answer in answers)


def main() -> None:
    """Prints a row for each member."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("other", help="the interpreter of the environment with the other engine")
    parser.add_argument("--runs", type=int, default=5, help="of each member with each engine")
    parser.add_argument("--member", action="append", help="members by a part of their names")
    parser.add_argument("--slower", type=float, default=1.05, help="the greatest ratio")
    arguments = parser.parse_args()
    members = [*ablation.searches(), *ablation.games_of_set(), *ablation.random_runs()]
    if arguments.member:
        members = [one for one in members if any(name in one.name for name in arguments.member)]
    print(f"{'':34} {'other':>9} {'this':>9} {'ratio':>6}")
    ratios, is_right = [], True
    for member in members:
        answers: dict[str, list[ablation.Measured]] = {arguments.other: [], sys.executable: []}
        for _ in range(arguments.runs):
            for python, found in answers.items():
                found.append(_measured(python, member))
        before, after = answers.values()
        same_answer = (before[0].verdict, before[0].value) == (after[0].verdict, after[0].value)
        same_states = (before[0].explored, before[0].stored) == (after[0].explored, after[0].stored)
        ratio = ablation.ratio(_median_s(after), _median_s(before))
        ratios.append(ratio)
        is_right = is_right and same_answer and ratio <= arguments.slower
        marks = [] if same_answer else ["THE ANSWER IS ANOTHER ONE"]
        marks += [] if same_states else ["other states"]
        marks += ["SLOWER"] if ratio > arguments.slower else []
        print(
            f"{member.name:34} {_median_s(before):8.3f}s {_median_s(after):8.3f}s {ratio:6.3f} "
            f"{', '.join(marks)}",
            flush=True,
        )
    print(f"median of the ratios {statistics.median(ratios):.3f}, greatest {max(ratios):.3f}")
    raise SystemExit(0 if is_right else 1)


if __name__ == "__main__":
    main()
