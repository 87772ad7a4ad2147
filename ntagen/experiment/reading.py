"""Reads the file of an experiment and finds all mistakes in it before anything is driven.

A key of a row that has a list of values makes a row for each value; several such keys make a row
for each combination. The names of those rows end with the values that differ.
"""

from __future__ import annotations

import itertools
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from ntagen.drive.knowledge import told
from ntagen.drive.needles import LAB, NAMES
from ntagen.drive.settings import STEERING
from ntagen.errors import InputError
from ntagen.experiment.description import SPEED, Experiment, Row, digest_of
from ntagen.experiment.lab_rows import mistake_in_lab, mistake_in_speeds, speed_of
from ntagen.experiment.paper import PAPER
from ntagen.files import read_file
from ntagen.nsl import Task, load_task
from ntagen.nsl.diagnostics import suggest
from ntagen.parameters import BY_WORDS, NEEDLE, Parameter, Value

ERRORS: Final = {
    parameter.words.replace(" ", "_"): parameter
    for parameter in BY_WORDS.values()
    if parameter.field.startswith(f"{NEEDLE}.") and parameter.words != "seed"
}
"""The keys of a row for the errors of a simulated needle."""

DRIVE: Final = {parameter.words: parameter for parameter in STEERING}
"""The keys of the table ``drive`` of a row: the words of ``drive { … }``."""

_TOP: Final = ("name", "defaults", "row")
_NEEDLES: Final = (*NAMES, LAB)
_ROW: Final = ("id", "scenario", "known", "needle", SPEED, "seeds", "paper", "drive", *ERRORS)
_MAX_BYTES: Final = 2**20
_MAX_SEEDS: Final = 1_000_000
_MAX_ROWS: Final = 10_000
_MAX_SEED: Final = 2**53
_RANGE: Final = re.compile(r"\s*(\d{1,18})\s*\.\.\s*(\d{1,18})\s*")


def read_experiment(path: Path, runs: int | None = None) -> Experiment:
    """The experiment that a file describes.

    Args:
        path: The file, in TOML.
        runs: So many seeds for each row, in place of those of the file.

    Raises:
        InputError: The file or one of its scenes has mistakes; the message has all of them.
        OSError: The file cannot be read.
    """
    try:
        text = read_file(path, _MAX_BYTES).decode()
        document = tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: this is no text in UTF-8: {error}") from error
    except (ValueError, RecursionError) as error:
        # Numbers of thousands of digits, and tables in tables without an end, are such errors.
        raise InputError(f"{path}: {error}\nhint: the file is written in TOML") from error
    return _checked(_Reader(path, text, runs), document)


def experiment_of(document: Mapping[str, Any]) -> Experiment:
    """The experiment of a document that no file holds; paths are relative to this process.

    Raises:
        InputError: It or one of its scenes has mistakes; the message has all of them.
    """
    return _checked(_Reader(Path(), "", None), document)


def _checked(reader: _Reader, document: Mapping[str, Any]) -> Experiment:
    experiment = reader.experiment(document)
    if reader.mistakes:
        raise InputError("\n".join(dict.fromkeys(reader.mistakes)))
    return experiment


@dataclass(slots=True)
class _Reader:
    """Collects the mistakes of a file."""

    path: Path
    text: str
    runs: int | None
    mistakes: list[str] = field(default_factory=list)
    tasks: dict[Path, Task | None] = field(default_factory=dict)

    def experiment(self, document: Mapping[str, Any]) -> Experiment:
        """The experiment; what is wrong is left out and noted."""
        self._known_keys(document, _TOP, None)
        name = document.get("name", self.path.stem)
        if not isinstance(name, str):
            self._note(None, "name", f"{name!r} is no text", 'write for example name = "noise"')
            name = self.path.stem
        defaults = self._table(document.get("defaults", {}), "defaults")
        wanted = document.get("row", [])
        if not isinstance(wanted, list) or not wanted:
            self._note(None, "row", "there is no row", "begin each row of the table with [[row]]")
            return Experiment(name, ())
        rows: list[Row] = []
        if defaults is not None:
            defaults = self._known_keys(defaults, _ROW, "defaults")
            for number, table in enumerate(wanted):
                one = self._table(table, number)
                if one is not None:
                    one = self._known_keys(one, _ROW, number)
                    rows += self._rows(number, _with_defaults(defaults, one))
        self._distinct(rows)
        return Experiment(name, tuple(rows))

    def _rows(self, number: int, table: Mapping[str, Any]) -> Iterator[Row]:
        """The rows of a table of the file: one for each combination of values in lists."""
        seeds = self._seeds(number, table)
        axes = self._axes(number, table)
        if axes is None or seeds is None:
            return
        count = math.prod(map(len, axes.values()))
        if count > _MAX_ROWS:
            self._note(number, "row", f"its lists make {count:,} rows", "make them shorter")
            return
        paper = table.get("paper", "")
        if paper and (count > 1 or paper not in PAPER):
            cause = "it stands for several rows" if count > 1 else f"{paper!r} is no line of it"
            self._note(number, "paper", cause, f"write one of {', '.join(PAPER)}")
            return
        for combination in itertools.product(*axes.values()):
            chosen = dict(zip(axes, combination, strict=True))
            name = self._name(number, table, chosen, axes)
            row = self._row(number, name, chosen, seeds, paper)
            if row is not None:
                yield row

    def _row(
        self, number: int, name: str, chosen: dict[str, Any], seeds: tuple[int, ...], paper: str
    ) -> Row | None:
        """A row, if its scene can be driven so."""
        scenario = Path(self.path.parent, chosen.pop("scenario")).absolute()
        task = self._task(number, scenario)
        if task is None:
            return None
        known, needle = str(chosen.pop("known")), str(chosen.pop("needle"))
        speed = speed_of(needle, chosen.pop(SPEED, None))
        values = {_field_of(key): value for key, value in chosen.items()}
        row = Row(name, scenario, known, needle, values, seeds, paper, speed=speed)
        try:
            told(task.scene, known)
        except InputError as error:
            self._note(number, "known", *_split(str(error).replace(" in --known", "")))
            return None
        try:
            configuration = row.configuration(task, seeds[0])
        except InputError as error:
            self._note(number, "drive", *_split(str(error)))
            return None
        wrong = mistake_in_lab(row, task, configuration)
        if wrong is not None:
            self._note(number, *wrong)
            return None
        for key in (key for key in chosen if configuration.needle.ignores(_field_of(key))):
            cause = f"it means nothing to {configuration.needle.kind}"
            self._note(number, key, cause, "leave it out, or choose another needle")
            return None
        return replace(row, digest=digest_of(row, task))

    def _axes(self, number: int, table: Mapping[str, Any]) -> dict[str, list[Any]] | None:
        """The values of each key, in lists; None if one is wrong."""
        before = len(self.mistakes)
        if not table.get("scenario"):
            self._note(number, "scenario", "it is missing", 'write scenario = "FILE.nsl"')
        axes = {
            "scenario": self._texts(number, "scenario", table.get("scenario", "-")),
            "known": self._texts(number, "known", table.get("known", "all")),
            "needle": self._texts(number, "needle", table.get("needle", "virtual")),
        }
        for needle in axes["needle"]:
            if needle not in _NEEDLES:
                near = suggest(needle, _NEEDLES)
                hint = f"did you mean '{near}'?" if near else f"choose from {', '.join(_NEEDLES)}"
                self._note(number, "needle", f"there is no simulated needle '{needle}'", hint)
        if SPEED in table:
            speeds = table[SPEED]
            axes[SPEED] = speeds if isinstance(speeds, list) else [speeds]
            wrong = mistake_in_speeds(axes[SPEED])
            if wrong is not None:
                self._note(number, SPEED, *wrong)
        for key, parameter in ERRORS.items():
            if key in table:
                axes[key] = self._values(number, key, parameter, table[key])
        drive = table.get("drive", {})
        words = {_words(key): value for key, value in drive.items()}
        for key, value in self._known_keys(words, DRIVE, number, "drive.").items():
            axes[key] = self._values(number, key, DRIVE[key], value)
        return axes if len(self.mistakes) == before else None

    def _texts(self, number: int, key: str, value: object) -> list[Any]:
        texts = value if isinstance(value, list) else [value]
        if not texts or not all(isinstance(one, str) and one for one in texts):
            self._note(number, key, f"{value!r} is no text, and no list of texts", "")
            return []
        return texts

    def _values(self, number: int, key: str, parameter: Parameter, value: object) -> list[Any]:
        values = value if isinstance(value, list) else [value]
        if not values:
            self._note(number, key, "the list has no value", "")
        found: list[Value] = []
        for one in values:
            try:
                found.append(parameter.parse(_text_of(one)))
            except ValueError as error:
                cause, _, hint = str(error).partition("; ")
                self._note(number, key, cause, hint)
        for one in (one for place, one in enumerate(found) if one in found[:place]):
            cause = f"{parameter.shown(one)} stands there twice"
            self._note(number, key, cause, "leave one of them out")
        return found

    def _seeds(self, number: int, table: Mapping[str, Any]) -> tuple[int, ...] | None:
        """The seeds of a row; None if they are wrong."""
        value = table.get("seeds")
        hint = 'write seeds = 50 for 1 to 50, "101..150", or a list'
        if value is None and self.runs is not None:
            return tuple(range(1, self.runs + 1))
        if value is None or value == []:
            self._note(number, "seeds", "there are no seeds", hint)
            return None
        found = _listed(value)
        if found is None:
            self._note(number, "seeds", f"{value!r} is no number of runs, and no list", hint)
            return None
        # The least of a range of 10^12 numbers is its first; nobody looks at all of them.
        ends = [found[0], found[-1]] if found and isinstance(found, range) else found
        if not ends or min(ends) < 0 or max(ends) > _MAX_SEED or len(found) > _MAX_SEEDS:
            cause = f"{value!r} is not 1 to {_MAX_SEEDS:,} seeds, each 0 or more"
            self._note(number, "seeds", cause, hint)
            return None
        if len(set(found)) < len(found):
            self._note(number, "seeds", "a seed stands there twice", "leave one of them out")
            return None
        if self.runs is None:
            return tuple(found)
        if isinstance(value, list) and self.runs > len(found):
            cause = f"the list has {len(found)} seeds, and {self.runs} are wanted"
            self._note(number, "seeds", cause, "make --runs smaller, or the list longer")
            return None
        if isinstance(value, list):
            return tuple(found[: self.runs])
        return tuple(range(found[0], found[0] + self.runs))

    def _task(self, number: int, path: Path) -> Task | None:
        """The task of a scene; each file is read once."""
        if path not in self.tasks:
            self.tasks[path] = None
            if not path.is_file():
                near = suggest(path.name, [one.name for one in path.parent.glob("*.nsl")])
                hint = f"did you mean '{near}'?" if near else "files are relative to this file"
                self._note(number, "scenario", f"there is no file {path}", hint)
                return None
            try:
                task = load_task(path)
            except InputError as error:
                self._note(number, "scenario", f"the scene has mistakes\n{error}", "")
                return None
            if task.scene.tissue.is_adversarial:
                cause = f"the tissue of {path.name} answers, which experiments do not play yet"
                self._note(number, "scenario", cause, "write `tissue static` in a copy of it")
                return None
            self.tasks[path] = task
        return self.tasks[path]

    def _name(
        self,
        number: int,
        table: Mapping[str, Any],
        chosen: Mapping[str, Any],
        axes: Mapping[str, Sequence[Any]],
    ) -> str:
        """The name of a row: its own, and the values that differ from those of its sisters."""
        given = table.get("id")
        parts = [given if isinstance(given, str) and given else Path(chosen["scenario"]).stem]
        if given is not None and (not isinstance(given, str) or parts[0] != _slug(parts[0])):
            hint = "use letters, digits and . _ + -"
            self._note(number, "id", f"{given!r} cannot be a part of a file's name", hint)
        for key, values in axes.items():
            if len(values) > 1 and not (key == "scenario" and given is None):
                value = chosen[key]
                parameter = ERRORS.get(key) or DRIVE.get(key)
                shown = Path(value).stem if key == "scenario" else str(value)
                shown = f"{key} {value}" if key == SPEED else shown
                parts.append(f"{key} {parameter.shown(value)}" if parameter else shown)
        return "-".join(_slug(part) for part in parts)

    def _distinct(self, rows: Sequence[Row]) -> None:
        """Notes names that two rows have."""
        seen: set[str] = set()
        for row in rows:
            if row.id.lower() in seen:
                hint = "give each row an id of its own"
                self._note(None, "id", f"two rows have the name {row.id}", hint)
            seen.add(row.id.lower())

    def _table(self, value: object, where: int | str) -> Mapping[str, Any] | None:
        """A table whose part `drive` is a table, too; None if it is none."""
        if not isinstance(value, dict):
            self._note(where, "", f"{value!r} is no table", "begin it with [defaults] or [[row]]")
            return None
        if not isinstance(value.get("drive", {}), dict):
            hint = 'write for example drive = { deviation = "1 mm" }'
            self._note(where, "drive", f"{value['drive']!r} is no table", hint)
            return None
        return value

    def _known_keys(
        self,
        table: Mapping[str, Any],
        keys: Sequence[str] | Mapping[str, Any],
        where: int | str | None,
        prefix: str = "",
    ) -> dict[str, Any]:
        """Notes the keys that nobody knows; returns the others."""
        for key in (key for key in table if key not in keys):
            near = suggest(key, keys)
            hint = f"did you mean `{near}`?" if near else f"the keys are {', '.join(keys)}"
            self._note(where, key, f"unknown key `{prefix}{key}`", hint)
        return {key: value for key, value in table.items() if key in keys}

    def _note(self, where: int | str | None, key: str, cause: str, hint: str) -> None:
        """Notes a mistake with its place."""
        line = _line_of(self.text, where, key)
        place = f"{self.path}:{line}" if line else str(self.path)
        row = f"row {where + 1}: " if isinstance(where, int) else ""
        label = f"`{key}`: " if key and "unknown key" not in cause and key != "row" else ""
        # What no file holds has no place.
        where_it_is = f"{place}: {row}" if self.path.name else ""
        self.mistakes.append(where_it_is + label + cause + (f"\nhint: {hint}" if hint else ""))


def _with_defaults(defaults: Mapping[str, Any], table: Mapping[str, Any]) -> dict[str, Any]:
    """A row with what it does not say itself."""
    drive = [
        {_words(key): value for key, value in one.get("drive", {}).items()}
        for one in (defaults, table)
    ]
    return {**defaults, **table, "drive": {**drive[0], **drive[1]}}


def _words(key: str) -> str:
    return re.sub(r"[_-]", " ", key)


def _field_of(key: str) -> str:
    return (ERRORS.get(key) or DRIVE[key]).field


def _text_of(value: object) -> str:
    """A value of TOML as it is written on the command line."""
    if isinstance(value, bool):
        return "on" if value else "off"
    return value if isinstance(value, str) else str(value)


def _listed(value: object) -> list[int] | range | None:
    """The seeds that a value stands for; None if it stands for none."""
    if isinstance(value, list):
        whole = all(isinstance(one, int) and not isinstance(one, bool) for one in value)
        return value if whole else None
    if isinstance(value, str):
        match = _RANGE.fullmatch(value)
        return range(int(match[1]), int(match[2]) + 1) if match else None
    if isinstance(value, int) and not isinstance(value, bool):
        return range(1, value + 1)
    return None


def _slug(text: str) -> str:
    """The text as a part of a file's name."""
    joined = re.sub(r" (mm|deg|s)$", r"\1", text.replace(" %", "pct"))
    return re.sub(r"[^A-Za-z0-9._+-]+", "_", joined)


def _split(message: str) -> tuple[str, str]:
    """Cause and hint of a message."""
    cause, _, hint = message.partition("\nhint: ")
    return cause, hint


def _line_of(text: str, where: int | str | None, key: str) -> int | None:
    """The line of a key, as far as it can be told without a parser; for messages only."""
    lines = text.splitlines()
    start, end = 0, len(lines)
    heads = [number for number, line in enumerate(lines) if re.match(r"\s*\[", line)]
    if where is not None:
        head = r"\s*\[\[\s*row\s*\]\]" if isinstance(where, int) else rf"\s*\[\s*{where}\s*\]"
        own = [number for number in heads if re.match(head, lines[number])]
        place = where if isinstance(where, int) else 0
        if place >= len(own):
            return None
        start = own[place]
        end = min([n for n in heads if n > start and "." not in lines[n]], default=len(lines))
    elif key not in _TOP:
        end = min(heads, default=len(lines))
    pattern = re.compile(rf"(^|[\s{{,.])[\"']?{re.escape(key)}[\"']?\s*(=|\]|\.)")
    for number in range(start, end):
        if key and pattern.search(lines[number].partition("#")[0]):
            return number + 1
    return start + 1 if where is not None else None
