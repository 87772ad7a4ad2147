"""The command line of verifyta: ``[OPTION]... MODEL [QUERIES]``.

Options stand before, between or after the files. ``-t0``, ``-t 0``, ``--diagnostic 0`` and
``--diagnostic=0`` are the same; options of one letter without a value may be bundled (``-squ``); a
long name may be shortened as long as it is clear.

Each option of `OPTIONS` is honoured, has no effect because it cannot change a verdict, or is
refused. There is no fourth kind: an unknown option is an error.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Final, Literal

from ntagen.errors import InputError
from ntagen.values import dataclass

Effect = Literal["honoured", "idle", "refused"]


@dataclass(frozen=True, slots=True)
class Option:
    """An option of verifyta.

    Attributes:
        letter: Its short name, or empty.
        long: Its long name, or empty.
        value: What its value is called; empty if it has none.
        effect: Whether ntagen honours it.
        help: What it does; for an option that is refused, why.
        more: Values that it may have besides those in the name of the value.
    """

    letter: str
    long: str
    value: str
    effect: Effect
    help: str
    more: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Its long name, or else its short one."""
        return self.long or self.letter

    @property
    def choices(self) -> tuple[str, ...]:
        """The values that it may have; empty for any."""
        return (*(self.value.split("|") if "|" in self.value else ()), *self.more)


_IDLE_IN_LEARNING: Final = "Learning in ntagen has no such setting; it is mentioned in the output."


IDLE_IN_LEARNING: Final = (
    "total-runs",
    "runs-pr-state",
    "max-imitation",
    "filter",
    "random-search-limit",
    "deterministic-search-limit",
    "split-filter-rate",
    "split-filter-val",
    "split-ks",
    "split-lower-t",
    "split-upper-t",
    "indifference-smoothing",
    "indifference-scale",
)
"""The options of learning that are accepted and have no effect."""

OPTIONS: Final = (
    Option("-h", "--help", "", "honoured", "Show this help."),
    Option("-v", "--version", "", "honoured", "Show the version."),
    Option(
        "-t",
        "--diagnostic",
        "0|1|2",
        "honoured",
        "Make a trace: 0 some, 1 shortest, 2 fastest. Without -f and -X it is written to standard "
        "error; strategies of control queries are written to standard output.",
    ),
    Option("-f", "", "PREFIX", "honoured", "Write the trace of query n to PREFIX-n (.xtr)."),
    Option("-X", "", "PREFIX", "honoured", "Write the trace of query n to PREFIXn.xml."),
    Option("-y", "", "", "honoured", "Show symbolic traces."),
    Option("-Y", "", "", "honoured", "The same."),
    Option(
        "-o",
        "--search-order",
        "0|1|2",
        "honoured",
        "Search breadth first (0), depth first (1) or in random depth-first order (2). 3 and 4 are "
        "taken as 0.",
        ("3", "4"),
    ),
    Option("-r", "--seed", "N", "honoured", "The seed of the random order and of random runs."),
    Option("-s", "--silence-progress", "", "honoured", "Do not mark lines as progress."),
    Option("-q", "", "", "honoured", "Do not show the options."),
    Option("-u", "--summary", "", "honoured", "Show counts, time and memory of each query."),
    Option("", "--nosummary", "", "honoured", "Do not."),
    Option(
        "",
        "--print-strategies",
        "DIR",
        "honoured",
        "Write the strategy of each `strategy NAME = control: …` to DIR/NAME.",
    ),
    Option("", "--generate-strategy", "0|1|2", "idle", "Strategies are always made."),
    Option("-n", "--extrapolation", "0..4", "idle", "Answers are exact.", tuple("01234")),
    Option("-S", "", "0|1|2", "idle", "How many states are stored."),
    Option("-C", "", "", "idle", "Zones as matrices."),
    Option("-b", "", "", "idle", "The search is breadth first."),
    Option("-H", "--hashtable-size", "N", "idle", "The size of a table."),
    Option("-T", "", "", "idle", "Use states again for the next query."),
    Option("-O", "", "std", "idle", "The kind of output.", ("std",)),
    Option("", "--key", "KEY", "idle", "ntagen needs no licence."),
    Option("", "--lease", "HOURS", "idle", "The same."),
    Option("", "--lease-request", "", "idle", "The same."),
    Option("", "--lease-install", "", "idle", "The same."),
    Option(
        "",
        "--state-representation",
        "0|1",
        "idle",
        "Zones as matrices or by their fewest constraints.",
    ),
    Option(
        "-A",
        "",
        "",
        "refused",
        "ntagen does not over-approximate; without the option answers are exact",
    ),
    Option(
        "-Z",
        "",
        "",
        "refused",
        "ntagen does not under-approximate; without the option answers are exact",
    ),
    Option("-E", "--epsilon", "0..1", "honoured", "Half the width of intervals."),
    Option("-a", "--alpha", "0..1", "honoured", "The risk that an interval misses."),
    Option("-B", "--beta", "0..1", "honoured", "The risk that Pr >= p is accepted wrongly."),
    Option("", "--delta", "0..1", "honoured", "So near to p the test of Pr >= p says nothing."),
    Option("", "--u0", "0..1", "honoured", "Pr >= Pr: the least ratio of the odds that counts."),
    Option("", "--u1", ">1", "honoured", "The greatest one."),
    Option("-D", "--discretization", ">0", "honoured", "The step of equations of clocks."),
    Option("", "--runs", "N>0", "honoured", "How many random runs are made."),
    Option(
        "",
        "--allow-external",
        "PATHS",
        "honoured",
        "Let the model import these libraries, or those in these folders; several are separated as "
        "in the variable PATH. Only ntagen has this option: it loads no library without it.",
    ),
    Option(
        "",
        "--learning-method",
        "4|5",
        "honoured",
        "Q-learning (4) or M-learning (5). -1 and 3 are taken as 5.",
        ("-1", "3"),
    ),
    Option("", "--good-runs", "N>0", "honoured", "From how many runs an iteration learns."),
    Option("", "--eval-runs", "N>0", "honoured", "How many runs judge its strategy."),
    Option("", "--max-iterations", "N>0", "honoured", "The most iterations, in total."),
    Option(
        "",
        "--reset-no-better",
        "N>0",
        "honoured",
        "After so many iterations without a better strategy learning ends or begins anew.",
    ),
    Option("", "--max-reset-learning", "N>=0", "honoured", "How often it begins anew."),
    Option("", "--discount", "0<..1", "honoured", "What a cost counts a decision earlier."),
    Option(
        "", "--qlearning-alpha", ">=1", "honoured", "The n-th sample counts for 1/min(this, n+1)."
    ),
    Option(
        "",
        "--out-of-bounds",
        "0|1|2|3",
        "honoured",
        "Outside the grid of acontrol: an error (0), safe (1), unsafe (2), as samples say (3).",
    ),
    *(Option("", f"--{name}", "X", "idle", _IDLE_IN_LEARNING) for name in IDLE_IN_LEARNING),
)
"""The options that are known, in the order of the help."""

_RANGES: Final = {
    "0..1": (0.0, 1.0, "between 0 and 1"),
    ">0": (0.0, math.inf, "greater than 0"),
    ">1": (1.0, math.inf, "greater than 1"),
    "0<..1": (0.0, math.nextafter(1.0, 2.0), "greater than 0 and at most 1"),
    ">=1": (math.nextafter(1.0, 0.0), math.inf, "at least 1"),
}
"""For the values that are such numbers: between which they lie, and how to say it."""

_BY_LETTER: Final = {option.letter: option for option in OPTIONS if option.letter}
_BY_LONG: Final = {option.long: option for option in OPTIONS if option.long}


@dataclass(frozen=True, slots=True)
class CommandLine:
    """What a command line asks for.

    Attributes:
        given: By name of the option: its value, empty for one without a value.
        files: The other words.
    """

    given: dict[str, str]
    files: tuple[str, ...]

    def has(self, name: str) -> bool:
        """Whether an option is given, by its long name or, without one, its letter."""
        return name in self.given

    def value(self, name: str, default: str = "") -> str:
        """The value of an option."""
        return self.given.get(name, default)


def parse(words: Sequence[str]) -> CommandLine:
    """Reads a command line.

    Raises:
        InputError: An option is unknown or not supported, or its value is missing or wrong.
    """
    given: dict[str, str] = {}
    files: list[str] = []
    rest = list(words)
    while rest:
        word = rest.pop(0)
        if word == "--":
            files += rest
            break
        if word.startswith("--"):
            name, equals, value = word.partition("=")
            option = _long(name)
            if equals and not option.value:
                raise InputError(f"{option.name} has no value, but {value!r} is given")
            _take(option, value if equals else None, rest, given)
        elif word.startswith("-") and word != "-":
            _letters(word, rest, given)
        else:
            files.append(word)
    return CommandLine(given, tuple(files))


def _letters(word: str, rest: list[str], given: dict[str, str]) -> None:
    """Takes the options of a word such as ``-squ`` or ``-t0``."""
    for index in range(1, len(word)):
        option = _BY_LETTER.get(f"-{word[index]}")
        if option is None:
            where = f" in {word}" if len(word) > 2 else ""
            raise _unknown(f"-{word[index]}{where}")
        if option.value:
            _take(option, word[index + 1 :] or None, rest, given)
            return
        _take(option, None, rest, given)


def _long(name: str) -> Option:
    """The option with this name, or the only one that begins with it."""
    if name in _BY_LONG:
        return _BY_LONG[name]
    found = [option for long, option in _BY_LONG.items() if long.startswith(name)]
    if len(found) > 1:
        names = ", ".join(option.long for option in found)
        raise InputError(f"the option {name} is ambiguous: {names}")
    if not found:
        raise _unknown(name)
    return found[0]


def _unknown(name: str) -> InputError:
    return InputError(f"unknown option {name}; -h lists the options")


def _take(option: Option, value: str | None, rest: list[str], given: dict[str, str]) -> None:
    """Notes an option and its value, which may be the next word."""
    if option.effect == "refused":
        names = "/".join(name for name in (option.letter, option.long) if name)
        raise InputError(f"{names} is not supported: {option.help}")
    if option.value and value is None:
        if not rest:
            raise InputError(f"{option.name} needs a value: {option.name} {option.value}")
        value = rest.pop(0)
    value = value or ""
    _require(option, value)
    given[option.name] = value


def _require(option: Option, value: str) -> None:
    """Refuses a value that an option cannot have.

    Raises:
        InputError: It is one.
    """
    wanted = ""
    if option.choices and value not in option.choices:
        wanted = f"{', '.join(option.choices[:-1])} or {option.choices[-1]}".removeprefix(" or ")
    elif option.value == "N" and not value.lstrip("-").isdigit():
        wanted = "an integer"
    elif option.value == "N>0" and not (value.isdecimal() and int(value) > 0):
        wanted = "a positive integer"
    elif option.value == "N>=0" and not value.isdecimal():
        wanted = "an integer that is at least 0"
    elif option.value in _RANGES:
        low, high, words = _RANGES[option.value]
        wanted = "" if low < _number(value) < high else f"a number {words}"
    if wanted:
        raise InputError(f"{option.name} is {value!r}, but must be {wanted}")
    if option.value and not value:
        raise InputError(f"{option.name} needs a value: {option.name} {option.value}")


def _number(value: str) -> float:
    try:
        return float(value)
    except ValueError:
        return math.nan


def _method(number: str) -> str:
    return "q" if number == "4" else "m"


def _out_of_bounds(number: str) -> str:
    return ("error", "safe", "unsafe", "sample")[int(number)]


_FIELDS: Final[dict[str, tuple[str, Callable[[str], Any]]]] = {
    "--seed": ("seed", int),
    "--runs": ("runs", int),
    "--alpha": ("alpha", float),
    "--beta": ("beta", float),
    "--epsilon": ("epsilon", float),
    "--delta": ("delta", float),
    "--discretization": ("discretisation", float),
    "--learning-method": ("learning_method", _method),
    "--good-runs": ("good_runs", int),
    "--eval-runs": ("eval_runs", int),
    "--max-iterations": ("max_iterations", int),
    "--reset-no-better": ("reset_no_better", int),
    "--max-reset-learning": ("max_reset_learning", int),
    "--discount": ("discount", float),
    "--qlearning-alpha": ("qlearning_alpha", float),
    "--out-of-bounds": ("out_of_bounds", _out_of_bounds),
}
"""For each option of random runs, of learning and of shields, the field of
`ntagen.checker.Options`, and its type."""


def of_model(options: Mapping[str, str], given: Collection[str] = ()) -> dict[str, Any]:
    """The fields of `ntagen.checker.Options` that a model file says for a query.

    Args:
        options: The options of the file; what is not for random runs, or has a value without
            meaning, is left out.
        given: The fields that the command line says itself.
    """
    usable = {}
    for name in options.keys() & _FIELDS.keys():
        field, read = _FIELDS[name]
        with contextlib.suppress(InputError):
            _require(_BY_LONG[name], options[name].strip())
            value = read(options[name].strip())
            if field not in given and (isinstance(value, str) or value >= 0):
                usable[field] = value
    return usable


def idle_in_learning(given: Collection[str]) -> list[str]:
    """Those of these options, by their long names, that learning does not have."""
    return [f"--{name}" for name in IDLE_IN_LEARNING if f"--{name}" in given]


def statistical(given: Mapping[str, str]) -> dict[str, Any]:
    """The fields of `ntagen.checker.Options` that these options say.

    Args:
        given: The values of options by their long names; others than those for random runs count
            for nothing.
    """
    fields = {field: read(given[name]) for name, (field, read) in _FIELDS.items() if name in given}
    if "--u0" in given or "--u1" in given:
        fields["odds_ratios"] = float(given.get("--u0", "0.9")), float(given.get("--u1", "1.1"))
    return fields
