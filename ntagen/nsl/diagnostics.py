"""Diagnostics: what is wrong in an environment file, where, why, and what to do about it.

A diagnostic is a value. Nothing here stops at the first one: the phases hand theirs to a
`Reporter`, and when all have run, everything is shown at once, sorted by place (`SourceError`).

A diagnostic is known by its defect (``unknown-unit``) and by a code that never changes (``N023``);
`KINDS` is the table of all of them, with one explanation each, and ``pages/`` has an example of
each and how to mend it. Errors keep the scene from being made, warnings do not.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

from ntagen.errors import InputError
from ntagen.nsl.source import Span

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of defect: its code, its name, whether it is an error, and what it is about."""

    code: str
    name: str
    severity: Severity
    explanation: str


def _kinds(*rows: tuple[str, str, Severity, str]) -> dict[str, Kind]:
    """The table by name."""
    return {row[1]: Kind(*row) for row in rows}


KINDS: Final = _kinds(
    # Reading the file.
    ("N001", "file-missing", "error", "There is no such file."),
    ("N002", "file-unreadable", "error", "It is a folder, or reading it is not permitted."),
    ("N003", "file-not-text", "error", "The file holds bytes that no text has."),
    ("N004", "file-not-utf-8", "error", "The file is text, but not encoded in UTF-8."),
    ("N005", "file-empty", "error", "The file holds nothing, or comments only."),
    ("N006", "file-too-large", "error", "Files of more than 1 MiB are refused."),
    ("N007", "too-many-mistakes", "error", "After 1,000 mistakes no more are shown."),
    # Form.
    ("N010", "stray-character", "error", "No word of the language has this character."),
    ("N011", "unclosed-comment", "error", "A comment that begins with /* needs a */."),
    ("N012", "unclosed-string", "error", "A path in quotes must end on its line."),
    ("N013", "unclosed-brace", "error", "A { without its }."),
    ("N014", "unmatched-brace", "error", "A } without its {."),
    ("N015", "unexpected-word", "error", "Something else must stand at this place."),
    ("N016", "unknown-keyword", "error", "No statement begins with this word."),
    ("N017", "misplaced-statement", "error", "The statement does not belong in these braces."),
    ("N018", "missing-brace", "error", "The statement needs braces, or has some too many."),
    ("N019", "nesting-too-deep", "error", "Parentheses, loops or includes are nested too deep."),
    # Names.
    ("N020", "unknown-name", "error", "Nothing of this name is defined before this place."),
    ("N021", "duplicate-name", "error", "The name is taken already."),
    ("N022", "reserved-name", "error", "The word means something in the language itself."),
    ("N023", "unknown-unit", "error", "There is no such unit."),
    ("N024", "unknown-function", "error", "There is no such function."),
    ("N025", "unknown-choice", "error", "Only a few words may stand here."),
    ("N026", "name-without-index", "error", "A region in a loop needs an index: Ring[i]."),
    ("N027", "unknown-region", "error", "There is no region of this name to lie around."),
    ("N028", "region-not-critical", "error", "Only critical regions have detection around them."),
    ("N029", "around-misused", "error", "Only a detection region may be written with around."),
    # Values.
    ("N030", "wrong-dimension", "error", "The value is of another dimension than is needed."),
    ("N031", "missing-unit", "error", "A length, angle, time or speed is written with its unit."),
    ("N032", "dimensions-differ", "error", "Only values of one dimension are added or compared."),
    ("N033", "division-by-zero", "error", "The divisor is 0."),
    ("N034", "not-a-number", "error", "The result is no finite real number."),
    ("N035", "wrong-argument-count", "error", "The function takes another number of arguments."),
    (
        "N036",
        "vector-misused",
        "error",
        "A vector stands where a single value must, or vice versa.",
    ),
    ("N037", "vector-size", "error", "A vector has three components."),
    ("N038", "unit-repeated", "error", "The value has a unit already."),
    ("N039", "not-whole", "error", "A whole number must stand here."),
    # Loops, includes, queries.
    ("N040", "loop-too-long", "error", "All loops together make 10,000 rounds at most."),
    ("N041", "loop-empty", "warning", "The loop makes no round: it counts upwards only."),
    ("N042", "include-cycle", "error", "A file includes itself, perhaps by way of others."),
    ("N043", "query-malformed", "error", "A query has a name, an equals sign and a text."),
    ("N044", "include-outside", "error", "Files below the folder of the first may be included."),
    # What must be there, and how often.
    ("N050", "environment-missing", "error", "A file describes one environment."),
    ("N051", "environment-repeated", "error", "A file describes one environment."),
    ("N052", "needle-missing", "error", "An environment has a needle."),
    ("N053", "target-missing", "error", "An environment has at least one target."),
    ("N054", "setting-missing", "error", "The needle's radius and speed have no default."),
    ("N055", "statement-repeated", "error", "The statement may be written once."),
    ("N056", "too-many-regions", "error", "10,000 regions at most, 100 of them targets."),
    # Rules on the values.
    ("N060", "radius-not-positive", "error", "A radius is greater than 0."),
    ("N061", "speed-not-positive", "error", "The insertion speed is greater than 0."),
    ("N062", "step-not-positive", "error", "A model step takes some time."),
    ("N063", "margin-negative", "error", "A detection region holds its critical region."),
    ("N064", "margin-zero", "warning", "A margin of 0 leaves nothing to detect nearness in."),
    ("N065", "direction-zero", "error", "A direction has a length."),
    ("N066", "bevel-not-perpendicular", "error", "Heading and bevel are at right angles."),
    ("N067", "roll-not-whole-degrees", "error", "The model rolls by whole degrees."),
    ("N068", "roll-out-of-range", "error", "A roll is more than 0 and less than 360 degrees."),
    ("N069", "roll-repeated", "error", "Each roll is written once."),
    ("N070", "roll-count-out-of-range", "error", "A plan has from 0 to 100 rolls."),
    ("N071", "distance-negative", "error", "A distance is not negative."),
    (
        "N072",
        "resolution-not-whole",
        "error",
        "The model counts in whole parts of a mm, 1 or more.",
    ),
    (
        "N073",
        "value-out-of-range",
        "error",
        "The model computes with 32-bit integers, of which a scene may use 28.",
    ),
    ("N074", "step-too-short", "error", "At this resolution a step would not bend the needle."),
    ("N075", "step-too-long", "warning", "Regions are checked at the ends of steps only."),
    ("N076", "target-in-critical", "error", "No point of the target may be reached."),
    ("N077", "target-overlaps", "warning", "The middle of the target must not be reached."),
    ("N078", "target-behind-needle", "error", "The needle moves along its heading, never back."),
    ("N079", "tip-in-critical", "error", "The needle would start in a critical region."),
    ("N080", "tip-in-detection", "warning", "Detection counts as critical: there is no plan."),
    ("N081", "tip-in-target", "warning", "The target is reached before the first move."),
    ("N082", "length-not-positive", "error", "The needle's length is greater than 0."),
    ("N083", "value-too-small", "error", "At this resolution nothing would be left of the value."),
    ("N084", "step-around-circle", "error", "Swept, a step goes less than half round the circle."),
)
"""All kinds of defects by name, in the order of their codes."""


_PAGES: Final = Path(__file__).parent / "pages"


def page_of(kind: Kind) -> str:
    r"""What is to be said of a kind of defect, in Markdown: meaning, example, how to mend it.

    Examples are fenced; the word behind the language says whether one is ``wrong`` or ``right``. In
    them ``\xE9`` stands for the byte of this number.
    """
    return f"{kind.explanation}\n\n{(_PAGES / f'{kind.code}.md').read_text('utf-8')}"


MAX_DIAGNOSTICS: Final = 1000
"""More are not collected: by then the file is no environment."""


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One defect at one place.

    Attributes:
        code: The code of its kind, ``N023``.
        severity: Whether it keeps the scene from being made.
        path: The file, as the user named it; for an included file as the include leads to it.
        line: The line, from 1; 0 if the defect is the file itself.
        column: The character in the line, from 1.
        length: How many characters are meant, at least 1, all of them on this line.
        message: What is wrong: one line, lower case, no full stop.
        source_line: The line of the file.
        notes: Facts that help to understand it.
        hint: What to do, if there is something to propose.
    """

    code: str
    severity: Severity
    path: str
    line: int
    column: int
    length: int
    message: str
    source_line: str
    notes: tuple[str, ...] = ()
    hint: str | None = None

    def render(self) -> str:
        """The diagnostic as lines for a terminal: message, source line, caret, notes and hint."""
        place = f"{self.path}:{self.line}:{self.column}" if self.line else self.path
        lines = [f"{place}: {self.severity}[{self.code}]: {self.message}"]
        gutter = " " * len(str(self.line))
        if self.line:
            # A tab becomes one space, so that the caret stands below the right character.
            text, column = _clip(self.source_line, self.column)
            text = "".join(c if c.isprintable() else " " for c in text)
            length = max(1, min(self.length, len(text) - column + 1))
            lines.append(f" {self.line} | {text}".rstrip())
            lines.append(f" {gutter} | {' ' * (column - 1)}{'^' * length}")
        lines += [f" {gutter} = note: {note}" for note in self.notes]
        if self.hint is not None:
            lines.append(f" {gutter} = hint: {self.hint}")
        return "\n".join(lines)


class SourceError(InputError):
    """An environment file with mistakes; `diagnostics` holds all of them, sorted by place."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        super().__init__("\n".join(diagnostic.render() for diagnostic in self.diagnostics))


class Reporter:
    """Collects diagnostics; says a thing about a place once, however often a loop comes by."""

    def __init__(self) -> None:
        self._found: dict[tuple[str, str, int, int], tuple[int, Diagnostic]] = {}
        self._file_order: dict[str, int] = {}

    def report(
        self,
        name: str,
        span: Span,
        message: str,
        *,
        hint: str | None = None,
        notes: tuple[str, ...] = (),
    ) -> None:
        """Adds a diagnostic of the kind `name` at a place."""
        kind, source = KINDS[name], span.source
        line, column = source.position(span.start)
        source_line = source.line(line)
        length = max(1, min(span.end - span.start, len(source_line) - column + 1))
        diagnostic = Diagnostic(
            kind.code,
            kind.severity,
            source.path,
            line,
            column,
            length,
            message,
            source_line,
            notes,
            hint,
        )
        self._add(diagnostic)

    def report_file(self, name: str, path: str, message: str, *, hint: str | None = None) -> None:
        """Adds a diagnostic about a file as a whole."""
        kind = KINDS[name]
        self._add(Diagnostic(kind.code, kind.severity, path, 0, 0, 1, message, "", (), hint))

    def enter(self, path: str) -> None:
        """Gives a file its place in the order in which files are reported."""
        self._file_order.setdefault(path, len(self._file_order))

    def _add(self, diagnostic: Diagnostic) -> None:
        """Adds a diagnostic, unless its kind was reported for the place already."""
        order = self._file_order.setdefault(diagnostic.path, len(self._file_order))
        if len(self._found) == MAX_DIAGNOSTICS:
            kind = KINDS["too-many-mistakes"]
            message = (
                f"there are more than {MAX_DIAGNOSTICS:,} mistakes, of which these are the first"
            )
            diagnostic = Diagnostic(kind.code, kind.severity, diagnostic.path, 0, 0, 1, message, "")
        elif len(self._found) > MAX_DIAGNOSTICS:
            return
        key = (diagnostic.code, diagnostic.path, diagnostic.line, diagnostic.column)
        self._found.setdefault(key, (order, diagnostic))

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """What was found: file by file in the order of entry, by place in each."""
        found = sorted(
            self._found.values(), key=lambda f: (f[0], f[1].line, f[1].column, f[1].code)
        )
        return tuple(diagnostic for _, diagnostic in found)

    @property
    def has_errors(self) -> bool:
        """Whether anything but warnings was found."""
        return any(d.severity == "error" for _, d in self._found.values())


def suggest(word: str, candidates: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The candidate that `word` most likely was meant to be, if one is near enough."""
    import difflib

    lowered = {candidate.lower(): candidate for candidate in candidates}
    near = difflib.get_close_matches(word.lower(), lowered, n=1, cutoff=cutoff)
    return lowered[near[0]] if near else None


def did_you_mean(word: str, candidates: Iterable[str], cutoff: float = 0.6) -> str | None:
    """A hint with the nearest candidate, if there is one."""
    near = suggest(word, candidates, cutoff)
    return None if near is None else f"did you mean `{near}`?"


_CLIP_COLUMNS = 140


def _clip(text: str, column: int) -> tuple[str, int]:
    """A stretch of a very long line around the column, and the column in it."""
    if len(text) <= _CLIP_COLUMNS:
        return text, column
    start = max(0, min(column - 1 - _CLIP_COLUMNS // 3, len(text) - _CLIP_COLUMNS))
    return text[start : start + _CLIP_COLUMNS], column - start
