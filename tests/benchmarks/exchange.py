"""What converted models say in other tools: states, verdicts and probabilities side by side.

    python tests/benchmarks/exchange.py [--tck-reach PROGRAM] [--tchecker DIR] [--tarzan DIR]
        [--only PATTERN] [--storm PYTHON] [--uppaal DIR] [--timeout 20]

PROGRAM is TChecker's ``tck-reach``, if it is not on the PATH, and DIR of ``--tchecker`` its
sources, whose ``examples/*.sh`` print models; that of ``--tarzan`` is the sources of TARZAN, whose
benchmarks have each model as ``.xta`` and ``.tck``; PYTHON runs ``exchange_storm.py``, so its
environment has ``stormpy`` and ``momba``; that of ``--uppaal`` has models in XML and XTA, such as
those of DEIS-Tools. What is missing is said, and left out.

"states" counts combinations of locations and variables that are reached: what no abstraction of
clocks changes. It must be the same wherever it stands in a row. "zones" are symbolic states of
``tck-reach -a reach``, which merges none: those of the original and of what came back through
UPPAAL's language must be equal, unless synchronisations were written out: then guards stand on
edges of other processes, and bounds of clocks, by location, are others. The engine's own number is
another, for it leaves out what a state that it has contains. The program ends with 1 if anything
differs.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ntagen import checker
from ntagen.checker import form_of
from ntagen.convert import Source, convert, source_of, source_of_tck
from ntagen.convert.converting import first_difference
from ntagen.errors import NtagenError

HERE = Path(__file__).parent
SCRIPTS = {
    "corsso": "2 2 10 1 2",
    "critical-region": "2 10",
    "critical-region-async": "2 10",
    "csmacd": "4",
    "dining-philosophers": "3 10 3 1",
    "fddi": "3",
    "fire-alarm": "3",
    "fischer": "4 10",
    "fischer-async": "3 10",
    "fischer-async-concurrent": "3 10",
    "gps-mc": "2 2 5 20",
    "job-shop": "2 3 5 20 1",
    "leader-election": "3 10",
    "leader-election-async": "3 10",
    "parallel": "3",
    "parallel-b": "3",
    "parallel-c": "3",
    "train_gate": "3",
}
MOST_STATES = 100_000
wrong: list[str] = []


@dataclass(frozen=True, slots=True)
class Reached:
    """What a tool reaches: combinations of locations and variables, and zones."""

    states: int | None
    zones: int | None = None

    def __str__(self) -> str:
        return "-" if self.states is None else f"{self.states:,}"


class Tck:
    """The program ``tck-reach``."""

    def __init__(self, program: str, timeout_s: float) -> None:
        self._program = program
        self._timeout_s = timeout_s

    def _run(self, *arguments: str, text: str) -> str:
        with tempfile.NamedTemporaryFile("w", suffix=".tck") as file:
            file.write(text)
            file.flush()
            command = [self._program, *arguments, file.name]
            try:
                run = subprocess.run(
                    command, capture_output=True, text=True, timeout=self._timeout_s, check=False
                )
            except subprocess.TimeoutExpired:
                return ""
        return run.stdout

    def reached(self, text: str) -> Reached:
        """What is reached; nothing if it takes too long."""
        out = self._run("-a", "reach", "-C", "graph", text=text)
        zones = re.search(r"VISITED_STATES (\d+)", out)
        if zones is None:
            return Reached(None)
        states = set(re.findall(r'intval="([^"]*)".*vloc="([^"]*)"', out))
        return Reached(len(states), int(zones[1]))

    def is_reachable(self, text: str, labels: str) -> bool | None:
        """Whether a state with these labels is reached; ``None`` if it takes too long."""
        out = self._run("-a", "covreach", "-l", labels, text=text)
        found = re.search(r"REACHABLE (true|false)", out)
        return None if found is None else found[1] == "true"


def of_engine(model: checker.Model, timeout_s: float) -> Reached:
    """What the engine reaches; nothing if it takes too long."""
    try:
        states = list(model.states(MOST_STATES, timeout_s=timeout_s))
    except NtagenError:
        return Reached(None)
    if len(states) == MOST_STATES:
        return Reached(None)
    # Variables that only hold a location are the converter's.
    found = {
        (
            tuple(one.locations.values()),
            tuple(value for name, value in one.variables.items() if not name.endswith("_place")),
        )
        for one in states
    }
    return Reached(len(found), len(states))


def require_same(row: str, *found: object) -> str:
    """A word on whether all that is known is the same."""
    known = {one for one in found if one is not None}
    if len(known) > 1:
        wrong.append(f"{row}: {', '.join(str(one) for one in found)}")
        return "DIFFERENT"
    return "equal" if len([one for one in found if one is not None]) > 1 else "?"


def scripts(folder: Path) -> Iterator[tuple[str, str]]:
    """The examples of TChecker, by name."""
    for name, arguments in SCRIPTS.items():
        script = folder / "examples" / f"{name}.sh"
        if script.exists():
            command = ["bash", str(script), *arguments.split()]
            run = subprocess.run(command, capture_output=True, text=True, check=False)
            yield f"{name} {arguments}", run.stdout
    for path in sorted((folder / "examples").glob("ad94*.txt")):
        yield path.stem, path.read_text("utf-8")


def tchecker_table(folder: Path, tck: Tck, timeout_s: float) -> None:
    """TChecker's examples, and what comes back of them."""
    print("\nTChecker's examples: states | zones of tck-reach | labels")
    heading = f"{'model':34} {'tck-reach':>9} {'ntagen':>9} {'back':>9}"
    print(f"{heading} | {'zones':>8} {'back':>8} | verdicts")
    for name, text in scripts(folder):
        try:
            source = source_of_tck(text, f"{name}.tck")
            back = convert(source, "tck").text
        except NtagenError as error:
            print(f"{name:34} refused: {str(error).splitlines()[0]}")
            continue
        original, again = tck.reached(text), tck.reached(back)
        ours = of_engine(source.model, timeout_s)
        verdict = require_same(f"{name}, states", original.states, ours.states, again.states)
        zones = "not comparable"
        if "_place" not in back:
            zones = require_same(f"{name}, zones", original.zones, again.zones)
        labels, count = [], 0
        for number, query in enumerate(source.written.queries, 1):
            label = query.comment.removeprefix("label ")
            answers = (
                tck.is_reachable(text, label),
                source.model.check(query.formula, timeout_s=timeout_s).satisfied,
                tck.is_reachable(back, f"query{number}"),
            )
            labels.append(require_same(f"{name}, label {label}", *answers))
            count += 1
        print(
            f"{name:34} {original!s:>9} {ours!s:>9} {again!s:>9} | {original.zones or '-':>8} "
            f"{again.zones or '-':>8} | states {verdict}, zones {zones}, "
            f"{labels.count('equal')} of {count} verdicts equal"
        )


def tarzan_table(folder: Path, tck: Tck, timeout_s: float, only: str) -> None:
    """TARZAN's models whose names match, each in both languages and each in both tools."""
    print("\nTARZAN's pairs: states of .tck and .xta in both tools | verdicts")
    print(f"{'model':24} {'tck':>9} {'tck, us':>9} {'xta':>9} {'xta, tck':>9} | verdict")
    for path in sorted(folder.glob("TARZAN/benchmarks/*/tck/*/*.tck")):
        folder_of_xta = path.parents[2] / "xta" / path.parent.name
        pair = next(iter(sorted(folder_of_xta.glob("*.xta"))), None)
        name = path.parent.name
        if not re.match(only, name):
            continue
        if pair is None or path.stat().st_size > 40_000:
            print(f"{name:24} left out: {'no .xta' if pair is None else 'large'}")
            continue
        text = path.read_text("utf-8")
        try:
            imported = source_of_tck(text, path.name)
            queries = next(iter(folder_of_xta.glob("*.q")), None)
            model = checker.load_file(pair)
            asked = model.read_queries(queries) if queries else ()
            exported = convert(source_of(model, pair.name, asked), "tck")
        except NtagenError as error:
            print(f"{name:24} refused: {str(error).splitlines()[0]}")
            continue
        found = [
            tck.reached(text),
            of_engine(imported.model, timeout_s),
            of_engine(model, timeout_s),
            tck.reached(exported.text),
        ]
        word = require_same(f"{name}, states", *(one.states for one in found))
        verdicts = []
        for number, query in enumerate(asked, 1):
            labels = re.findall(rf"tck-reach -l (query{number}(?:_1[^`]*)?)`", exported.text)
            if labels:
                reachable = tck.is_reachable(exported.text, labels[0])
                satisfied = model.check(query.text, timeout_s=timeout_s).satisfied
                if reachable is not None and query.text.strip().startswith("A"):
                    reachable = not reachable
                verdicts.append(require_same(f"{name}, {query.text}", reachable, satisfied))
        counts = " ".join(f"{one!s:>9}" for one in found)
        print(f"{name:24} {counts} | states {word}, verdicts {' '.join(verdicts) or '-'}")


def jani_table(python: str | None, timeout_s: float) -> None:
    """Our models in JANI: Storm's values, Momba's states, and what the engine says."""
    print("\nJANI: states in three tools, and values of properties")
    with tempfile.TemporaryDirectory() as folder:
        sources: dict[Path, Source] = {}
        for path in sorted((HERE / "exchange_models").glob("*.xta")):
            model = checker.load_file(path)
            source = source_of(model, path.name, model.read_queries(path.with_suffix(".q")))
            target = Path(folder) / f"{path.stem}.jani"
            target.write_text(convert(source, "jani").text, "utf-8")
            sources[target] = source
        found = {}
        if python is not None:
            command = [python, str(HERE / "exchange_storm.py"), *map(str, sources)]
            environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
            run = subprocess.run(command, stdout=subprocess.PIPE, env=environment, check=True)
            # Storm prints its own messages before.
            found = json.loads(run.stdout.splitlines()[-1])
        for target, source in sources.items():
            jani = json.loads(target.read_text("utf-8"))
            said = found.get(str(target), {})
            counts = [of_engine(source.model, timeout_s).states]
            counts += [said.get(tool, {}).get("states") for tool in ("storm", "momba")]
            word = require_same(f"{target.stem}, states", *counts)
            shown = ", ".join("-" if one is None else f"{one}" for one in counts)
            print(f"{target.stem} ({jani['type']}): states {shown}: {word}")
            values = said.get("storm", {}).get("values", {})
            for one in jani["properties"]:
                print(f"  {property_line(source, one, values.get(one['name']))}")


def property_line(source: Source, asked: dict[str, str], value: float | None) -> str:
    """What both say of a property."""
    number = int(re.findall(r"\d+", asked["name"])[0])
    query = source.written.queries[number - 1].formula
    answer = source.model.check(query, seed=1, epsilon=0.002, alpha=0.01)
    form = form_of(query)
    text = f"{query} {asked['name'].partition('_')[2]}".strip()
    storm = "-" if value is None else f"{value:.6g}"
    if form is not None and form.kind in ("E<>", "A[]"):
        is_satisfied = None if value is None else (value > 0) == (form.kind == "E<>")
        word = require_same(text, is_satisfied, answer.satisfied)
        return f"{text}: Storm {storm}, engine {answer.verdict}: {word}"
    estimate = answer.estimate
    if estimate is None:  # a best strategy
        return f"{text}: Storm {storm}, engine {answer.verdict}"
    low, high = estimate.lower or 0.0, 1.0 if estimate.upper is None else estimate.upper
    word = "?"
    if value is not None:
        # Where choices are open, chance makes them in a run: its value lies between the bounds.
        least = "least" in asked["name"] and value <= high
        greatest = "greatest" in asked["name"] and value >= low
        is_between = least or greatest or low - 0.003 <= value <= high + 0.003
        word = "agree" if is_between else "DIFFERENT"
        if not is_between:
            wrong.append(f"{text}: {value} and [{low}, {high}]")
    return f"{text}: Storm {storm}, engine [{low:.4f}, {high:.4f}]: {word}"


def uppaal_table(folder: Path) -> None:
    """Models of UPPAAL: XML and XTA both ways, the networks compared."""
    counts = {"equal": 0, "refused": 0, "not loaded": 0}
    for path in sorted(one for one in folder.rglob("*") if one.suffix in (".xml", ".xta", ".ta")):
        try:
            model = checker.load_file(path)
        except (NtagenError, OSError):
            counts["not loaded"] += 1
            continue
        try:
            source = source_of(model, str(path))
            xta = convert(source, "xta").text
            xml = convert(source_of(checker.load(xta, "back.xta"), "back.xta"), "xml").text
        except NtagenError as error:
            counts["refused"] += 1
            print(f"{path}: {str(error).splitlines()[0]}")
            continue
        if difference := first_difference(model, checker.load(xml, "back.xml")):
            wrong.append(f"{path}: {difference}")
        counts["equal"] += 1
    print(f"\nUPPAAL's models through XTA to XML: {counts}")


def main() -> int:
    """Prints the tables; returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--tchecker", type=Path)
    parser.add_argument("--tck-reach")
    parser.add_argument("--tarzan", type=Path)
    parser.add_argument("--only", default="", help="a pattern for the names of TARZAN's models")
    parser.add_argument("--storm", help="a Python with stormpy and momba")
    parser.add_argument("--uppaal", type=Path)
    parser.add_argument("--timeout", type=float, default=20.0)
    given = parser.parse_args()
    program = given.tck_reach or shutil.which("tck-reach")
    if program is None:
        print("missing: tck-reach (--tck-reach); no table of TChecker and TARZAN")
    else:
        tck = Tck(program, given.timeout)
        if given.tchecker:
            tchecker_table(given.tchecker, tck, given.timeout)
        else:
            print("missing: TChecker's sources (--tchecker)")
        if given.tarzan:
            tarzan_table(given.tarzan, tck, given.timeout, given.only)
        else:
            print("missing: TARZAN's sources (--tarzan)")
    if given.storm is None:
        print("missing: stormpy and momba (--storm PYTHON)")
    jani_table(given.storm, given.timeout)
    if given.uppaal:
        uppaal_table(given.uppaal)
    print(f"\n{len(wrong)} differences" + "".join(f"\n  {one}" for one in wrong))
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
