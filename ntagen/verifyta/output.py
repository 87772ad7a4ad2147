"""The lines that verifyta prints, and that scripts search for.

The verdict stands on the line right after "Verifying formula", and nothing else says whether a
formula is satisfied: scripts rely on both.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from ntagen.errors import LimitError
from ntagen.verifyta.options import OPTIONS, CommandLine, Option

if TYPE_CHECKING:
    from ntagen.checker import Answer, Optimised, Trajectory

COMPATIBLE_VERSION: Final = "5.0.0"
"""The version of UPPAAL whose output this is; scripts choose names of files by it."""

ERASE_LINE: Final = "\x1b[2K"
"""Stands before a verdict if progress is shown."""

INTERRUPTED_RUNS: Final = " -- Interrupted: this is what the runs until now say."
"""Stands in place of the verdict if the user has ended random runs."""

_TRACES: Final = {"": "no", "0": "some", "1": "shortest", "2": "fastest"}
_ORDERS: Final = {"1": "depth first", "2": "random depth first"}
_SPACE: Final = {"0": "no", "2": "aggressive"}
_NAMES_WIDTH: Final = 34


def version_text(version: str) -> str:
    """What ``-v`` says: that this is ntagen, and for which version of UPPAAL it stands in."""
    return f"ntagen {version} in place of UPPAAL {COMPATIBLE_VERSION} (this is not UPPAAL)"


def help_text() -> str:
    """What ``-h`` says."""
    lines = [
        "Usage: verifyta [OPTION]... MODEL QUERY",
        "",
        "ntagen in place of UPPAAL's verifyta. MODEL is .xml, .xta or .ta; QUERY is a file of",
        "queries, without which those in MODEL are answered. UPPAAL_COMPILE_ONLY=1 in the",
        "environment prints the compiled form of MODEL (.if) instead. Exit codes: 0 whatever the",
        "verdicts are, 1 after an error, 130 if interrupted (random runs until then are shown).",
        "",
        "Examples:",
        "  ntagen verifyta model.xml",
        "  ntagen verifyta -t1 -f trace -s model.xml queries.q",
        "  UPPAAL_COMPILE_ONLY=1 ntagen verifyta model.xml > model.if",
        "",
        "Options:",
    ]
    lines += [_help_line(option) for option in OPTIONS if option.effect == "honoured"]
    lines += ["", "Without effect on the answers:"]
    lines += [_help_line(option) for option in OPTIONS if option.effect == "idle"]
    lines += ["", "Not supported (an error):"]
    lines += [_help_line(option) for option in OPTIONS if option.effect == "refused"]
    return "\n".join(lines)


def _help_line(option: Option) -> str:
    names = f"{option.letter} [ {option.long} ]" if option.letter else option.long
    names = names.removesuffix(" [  ]")
    shown = f"  {names} {option.value}".rstrip()
    return f"{shown:<{_NAMES_WIDTH}} {option.help}"


def header(line: CommandLine) -> str:
    """The options of a run."""
    trace = _TRACES[line.value("--diagnostic")]
    order = _ORDERS.get(line.value("--search-order"), "breadth first")
    space = _SPACE.get(line.value("-S"), "conservative")
    zones = "minimal constraint systems with future testing"
    zones = "difference bound matrices" if line.has("-C") else zones
    return "\n".join(
        [
            "Options for the verification:",
            f"  Generating {trace} trace",
            f"  Search order is {order}",
            f"  Using {space} space optimisation",
            f"  Seed is {line.value('--seed', '0')}",
            f"  State space representation uses {zones}",
            "  Using HashMap + Compress integers for discrete state storage",
        ]
    )


def verdict(answer: Answer) -> str:
    """The verdict of an answer that has one.

    Raises:
        LimitError: A limit came before an answer.
    """
    match answer.verdict:
        case "satisfied":
            return " -- Formula is satisfied."
        case "not satisfied":
            return " -- Formula is NOT satisfied."
        case "maybe":
            # The zones are too large where clocks stand: what they reach may be out of reach.
            is_universal = re.match(r"\s*A(\[\]|<>)|.*-->", answer.query, re.DOTALL)
            return f" -- Formula MAY {'NOT ' if is_universal else ''}be satisfied."
        case _:
            raise LimitError(f"stopped by the {answer.limit_text}")


def estimate(answer: Answer) -> list[str]:
    """What a statistical query found out, in the form of UPPAAL 5; empty for other queries.

    Of a query for the best strategy, UPPAAL says how it was learned, and not what it is worth.
    """
    if (optimised := answer.optimised) is not None:
        return _learned(optimised)
    shown = answer.trajectories
    if shown:
        return [
            line
            for text in shown[0].points
            for line in (f"{text}:", *(_trajectory(i, one, text) for i, one in enumerate(shown)))
        ]
    found = answer.estimate
    if found is None or found.lower is None or found.upper is None:
        return []
    share = f"{100 * found.confidence:g}% CI"
    if found.satisfied_runs is None:
        half = found.upper - found.value
        kind = "min" if re.match(r"[^(]*\(\s*min\b", answer.query) else "max"
        mean = f"≈ {found.value:g}" if half == 0 else f"{found.value:g} ± {half:g} ({share})"
        return [f"({found.runs} runs) E({kind}) = {mean}"]
    paths = [asked.strip() for asked in re.split(r"\bPr\b", answer.query)[1:]]
    estimates = [found, found.compared] if found.compared else [found]
    lines = []
    for path, one in zip(paths, estimates, strict=False):
        operator = re.match(r"(\[.*?\])?\s*\(\s*(<>|\[\])", path, re.DOTALL)
        asked = f"{operator[2]} …" if operator else "… U …"
        runs = f"({one.satisfied_runs}/{one.runs} runs)"
        lines.append(f"{runs} Pr({asked}) in [{one.lower:g},{one.upper:g}] ({share})")
    return lines


def _learned(found: Optimised) -> list[str]:
    return [
        f" -- Result: ({found.runs} runs)",
        "Learning statistics for best strategy: ",
        f"\tNumber of resets: {found.resets}",
        f"\tNumber of iterations in last reset: {found.iterations_in_last_reset}",
        f"\tNumber of iterations in total: {found.iterations}",
        "",
    ]


def without_effect(options: Sequence[str]) -> str:
    """The line about options of learning that are accepted and have no effect."""
    return f"Without effect on learning in ntagen: {', '.join(options)}"


def _trajectory(number: int, trajectory: Trajectory, text: str) -> str:
    points = " ".join(f"({time:g},{value:g})" for time, value in trajectory.points[text])
    return f"[{number}]: {points}"


def values(answer: Answer) -> list[str]:
    """The values of ``sup``, ``inf`` and ``bounds``, a line for each expression."""
    found = re.match(r"\s*(sup|inf|bounds)\b[^:]*?(?:\{.*\})?\s*:(.*)", answer.query, re.DOTALL)
    if found is None or answer.value is None:
        return []
    items = _items(found[2])
    values = answer.value if len(items) > 1 and isinstance(answer.value, list) else [answer.value]
    return [
        f" -- {found[1]}: {item} = {_value(value)}"
        for item, value in zip(items, values, strict=True)
    ]


def _value(value: object) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_value(one) for one in value)}]"
    return "none" if value is None else str(value)


def _items(text: str) -> list[str]:
    """The expressions of a list; commas within brackets do not separate them."""
    items, depth = [""], 0
    for sign in text:
        depth += (sign in "([{") - (sign in ")]}")
        if sign == "," and depth == 0:
            items.append("")
        else:
            items[-1] += sign
    return [" ".join(item.split()) for item in items]


def summary(answer: Answer, cpu_ms: int, memory_kib: tuple[int, int] | None) -> list[str]:
    """What ``-u`` shows: counts, the user time in ms, virtual and resident memory in KiB."""
    lines = [
        f" -- States stored : {answer.stored} states",
        f" -- States explored : {answer.explored} states",
        f" -- CPU user time used : {cpu_ms} ms",
    ]
    if memory_kib is not None:
        lines.append(f" -- Virtual memory used : {memory_kib[0]} KiB")
        lines.append(f" -- Resident memory used : {memory_kib[1]} KiB")
    return lines


def histogram(answer: Answer) -> list[str]:
    """The line with the histogram of a statistical query; none for other queries.

    Its number of buckets is the square root of the number of values, rounded up, as in a published
    log of UPPAAL 5; buckets for whole numbers are whole numbers wide.
    """
    found = answer.distribution
    if found is None or found.min is None or found.max is None or found.mean is None:
        return []
    known = found.to_json()["histogram"]
    counts = " ".join(str(count) for count in known["counts"])
    between = f"Values in [{found.min:g},{found.max:g}]"
    return [f"{between} mean={found.mean:g} steps={known['width']:g}: {counts}"]
