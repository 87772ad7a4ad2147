"""Diagnostics: what is wrong in an environment file, where, why, and how to fix it.

A diagnostic is a value. The first one does not stop the work: the phases give theirs to a
`Reporter`, and when all have run, all diagnostics are shown, sorted by place (`SourceError`).

A kind of diagnostic has a name (``unknown-unit``) and a code that never changes (``N023``). `KINDS`
is the table of all kinds, with one explanation each; ``pages/`` has an example of each and how to
fix it. After an error no scene is made; after a warning it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final, Literal

from ntagen.errors import InputError
from ntagen.nsl.source import Span
from ntagen.rules import Breach
from ntagen.values import dataclass

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of mistake: its code, its name, an explanation, and its severity."""

    code: str
    name: str
    explanation: str
    severity: Severity = "error"


def _kinds(*rows: tuple[str, str, str] | tuple[str, str, str, Severity]) -> dict[str, Kind]:
    """The table by name."""
    return {row[1]: Kind(*row) for row in rows}


KINDS: Final = _kinds(
    # Reading the file.
    ("N001", "file-missing", "There is no such file."),
    ("N002", "file-unreadable", "It is a folder, or reading it is not permitted."),
    ("N003", "file-not-text", "The file has bytes that do not occur in text."),
    ("N004", "file-not-utf-8", "The file is text, but not encoded in UTF-8."),
    ("N005", "file-empty", "The file is empty, or has only comments."),
    ("N006", "file-too-large", "Files of more than 1 MiB are refused."),
    ("N007", "too-many-mistakes", "After 1,000 mistakes no more are shown."),
    # Form.
    ("N010", "stray-character", "No word of the language has this character."),
    ("N011", "unclosed-comment", "A comment that begins with /* needs a */."),
    ("N012", "unclosed-string", "A path in quotes must end on its line."),
    ("N013", "unclosed-brace", "A { without its }."),
    ("N014", "unmatched-brace", "A } without its {."),
    ("N015", "unexpected-word", "Something else must stand at this place."),
    ("N016", "unknown-keyword", "No statement begins with this word."),
    ("N017", "misplaced-statement", "The statement does not belong in these braces."),
    ("N018", "missing-brace", "The statement needs braces, or must not have any."),
    ("N019", "nesting-too-deep", "Parentheses, loops or includes are nested too deep."),
    # Names.
    ("N020", "unknown-name", "This name is not defined before this place."),
    ("N021", "duplicate-name", "The name is already used."),
    ("N022", "reserved-name", "The word has a meaning in the language itself."),
    ("N023", "unknown-unit", "There is no such unit."),
    ("N024", "unknown-function", "There is no such function."),
    ("N025", "unknown-choice", "Only a few words can stand here."),
    ("N026", "name-without-index", "A region in a loop needs an index: Ring[i]."),
    ("N027", "unknown-region", "There is no critical region with this name."),
    ("N028", "region-not-critical", "A detection region lies around a critical region."),
    ("N029", "around-misused", "Only a detection region can be written with around."),
    # Values.
    ("N030", "wrong-dimension", "This place needs a value of another dimension."),
    ("N031", "missing-unit", "A length, angle, time or speed needs a unit."),
    ("N032", "dimensions-differ", "Only values of the same dimension can be added or compared."),
    ("N033", "division-by-zero", "The divisor is 0."),
    ("N034", "not-a-number", "The result is not a finite real number."),
    ("N035", "wrong-argument-count", "The function takes another number of arguments."),
    (
        "N036",
        "vector-misused",
        "There is a vector in the place of a single value, or the other way round.",
    ),
    ("N037", "vector-size", "A vector has three components."),
    ("N038", "unit-repeated", "The value already has a unit."),
    ("N039", "not-whole", "This must be a whole number."),
    # Loops, includes, queries.
    ("N040", "loop-too-long", "All loops together can make at most 10,000 rounds."),
    ("N041", "loop-empty", "The loop makes no rounds: it only counts upwards.", "warning"),
    ("N042", "include-cycle", "A file includes itself, perhaps through other files."),
    ("N043", "query-malformed", "A query has a name, an equals sign and a text."),
    ("N044", "include-outside", "Only files below the folder of the first file can be included."),
    # Required statements, and how often they may occur.
    ("N050", "environment-missing", "A file describes one environment."),
    ("N051", "environment-repeated", "A file describes one environment."),
    ("N052", "needle-missing", "An environment has a needle."),
    ("N053", "target-missing", "An environment has at least one target."),
    ("N054", "setting-missing", "The needle's radius and speed have no default."),
    ("N055", "statement-repeated", "The statement can be written only once."),
    ("N056", "too-many-regions", "There can be 10,000 regions, 100 of them targets."),
    # Rules on the values.
    ("N060", "radius-not-positive", "A radius, or another size, must be greater than 0."),
    ("N061", "speed-not-positive", "The insertion speed must be greater than 0."),
    ("N062", "step-not-positive", "A step of the model must take some time."),
    ("N063", "margin-negative", "A detection region must contain its critical region."),
    ("N064", "margin-zero", "With a margin of 0 there is no space to sense nearness.", "warning"),
    ("N065", "direction-zero", "A direction cannot be the zero vector."),
    ("N066", "bevel-not-perpendicular", "Heading and bevel must be at right angles."),
    ("N067", "roll-not-whole-degrees", "The model rolls by whole degrees."),
    ("N068", "roll-out-of-range", "A roll is more than 0 and less than 360 degrees."),
    ("N069", "roll-repeated", "Each roll is written once."),
    ("N070", "roll-count-out-of-range", "A plan has from 0 to 100 rolls."),
    ("N071", "distance-negative", "A distance cannot be negative."),
    ("N072", "resolution-not-whole", "The number of units per mm must be whole, 1 or more."),
    (
        "N073",
        "value-out-of-range",
        "The model computes with 32-bit integers; a scene can use 28 of these bits.",
    ),
    ("N074", "step-too-short", "At this resolution a step would not bend the needle."),
    ("N075", "step-too-long", "Regions are checked only at the ends of steps.", "warning"),
    ("N076", "target-in-critical", "The needle must not reach any point of the target."),
    ("N077", "target-overlaps", "The needle must not reach the centre of the target.", "warning"),
    ("N078", "target-behind-needle", "The needle moves along its heading, never back."),
    ("N079", "tip-in-critical", "The needle would start in a critical region."),
    (
        "N080",
        "tip-in-detection",
        "Plans avoid detection and unexplored regions: there is no plan that starts in one.",
        "warning",
    ),
    ("N081", "tip-in-target", "The target is reached before the first move.", "warning"),
    ("N082", "length-not-positive", "The needle's length must be greater than 0."),
    ("N083", "value-too-small", "At this resolution the value would be rounded to 0."),
    (
        "N084",
        "step-around-circle",
        "With `safety swept`, a step goes less than half round the circle.",
    ),
    ("N085", "uppaal-model", "The file is a UPPAAL model, and not an environment."),
    # Driver and devices.
    ("N086", "setting-out-of-range", "The driver cannot work with this value."),
    ("N087", "axis-malformed", "An axis has a letter of GRBL, and its steps."),
    ("N088", "axis-missing", "A device has an axis to insert and one to roll."),
    ("N089", "address-malformed", "An address is a host and a port."),
    ("N090", "safe-overlaps", "A safe region has nothing critical or unexplored in it.", "warning"),
    ("N091", "target-without-end", "A target must end somewhere: plans lead into it."),
    # Tissue.
    ("N092", "tissue-out-of-range", "The tissue cannot err by this much."),
    ("N093", "tissue-bound-misused", "An adversarial tissue has bounds, a static one none."),
    ("N094", "tip-error-too-large", "Targets are larger than the error of the tip."),
    # Files of another kind.
    ("N095", "json-file", "The file is JSON, and not an environment."),
    # Rounding.
    (
        "N096",
        "resolution-coarse",
        "The model rounds; its path may be farther from the exact one than the task allows.",
        "warning",
    ),
    # Regions from files.
    ("N100", "package-missing", "A package that reads such files is not installed."),
    ("N101", "image-malformed", "The file is not what its name says."),
    ("N102", "image-too-large", "The file, or a table of distances, is too large."),
    ("N103", "mesh-not-closed", "A mesh must have an inside and an outside."),
    ("N104", "mesh-inverted", "The triangles of a mesh must face outwards."),
    ("N105", "space-unknown", "Something must say whether a file is in LPS or in RAS."),
    ("N106", "unit-unknown", "Something must say in which unit of length a file is."),
    ("N107", "part-missing", "The file has no such part, or no part is named."),
    ("N108", "matrix-degenerate", "A matrix of a file may only turn and move."),
    ("N109", "transform-missing", "Imaging space needs a place in the needle's frame."),
    ("N110", "clause-misused", "A region from such a file has no such clause."),
    ("N111", "matrix-ambiguous", "Two matrices of a NIfTI file place it differently."),
    # Motions.
    ("N120", "period-wrong", "A motion repeats itself after some time."),
    ("N121", "periods-differ", "All regions move with one breath."),
    ("N122", "motion-table-wrong", "A table of a motion has times and displacements."),
    ("N123", "motion-times-wrong", "The times of a table increase within the period."),
    ("N124", "gate-never-open", "The gate must be open long enough for a push."),
    ("N125", "nothing-moves", "Waits and gates are about regions that move."),
    ("N126", "wait-wrong", "A wait takes some time, and waits can be counted."),
    # Spins.
    ("N130", "spin-out-of-range", "A needle spins in a part of the way, and not in all."),
    ("N131", "spin-repeated", "Each spun fraction is written once."),
    (
        "N132",
        "spin-misused",
        "Plans that spin the needle are made for static tissue in which nothing moves.",
    ),
)
"""All kinds of mistakes by name, in the order of their codes."""


_PAGES: Final = Path(__file__).parent / "pages"


CAPTIONS: Final = {"model": "The model:", "wrong": "Wrong:", "right": "Right:"}
"""What is written above an example, by the word after its language."""


def page_of(kind: Kind) -> str:
    r"""The page of a kind of mistake, in Markdown: meaning, example, how to fix it.

    Examples are fenced; the word after the language says whether one is ``wrong`` or ``right``. In
    an example ``\xE9`` stands for the byte with this number.
    """
    return f"{kind.explanation}\n\n{(_PAGES / f'{kind.code}.md').read_text('utf-8')}"


MAX_DIAGNOSTICS: Final = 1000
"""More are not collected: a file with so many mistakes is not an environment."""


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One mistake at one place.

    Attributes:
        code: The code of its kind, ``N023``.
        severity: ``error`` or ``warning``.
        path: The file, as the user named it; for an included file the path of the include.
        line: The line, from 1; 0 if the diagnostic is about the whole file.
        column: The character in the line, from 1.
        length: How many characters are marked, at least 1, all of them on this line.
        message: What is wrong: one line, lower case, no full stop.
        source_line: The line of the file.
        notes: Facts that help to understand the mistake.
        hint: How to fix it, if there is a proposal.
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
        """The lines for a terminal: message, source line, caret, notes and hint.

        The engine's diagnostics of models and queries look the same.
        """
        place = f"{self.path}:{self.line}:{self.column}" if self.line else self.path
        lines = [f"{place}: {self.severity}[{self.code}]: {self.message}"]
        if self.line:
            # A tab becomes one space, so that the caret stands below the right character.
            text, column = _clip(self.source_line, self.column)
            text = "".join(c if c.isprintable() else " " for c in text)
            length = max(1, min(self.length, len(text) - column + 1))
            lines.append(f"  | {text}".rstrip())
            lines.append(f"  | {' ' * (column - 1)}{'^' * length}")
        lines += [f"  note: {note}" for note in self.notes]
        if self.hint is not None:
            lines.append(f"  hint: {self.hint}")
        return "\n".join(lines)


class SourceError(InputError):
    """An environment file has mistakes; `diagnostics` has all of them, sorted by place."""

    def __init__(self, diagnostics: Iterable[Diagnostic]) -> None:
        self.diagnostics = tuple(diagnostics)
        super().__init__("\n".join(diagnostic.render() for diagnostic in self.diagnostics))


def _of_file(
    name: str, path: str, message: str, hint: str | None = None, notes: tuple[str, ...] = ()
) -> Diagnostic:
    """A diagnostic of the kind `name` about a file as a whole."""
    kind = KINDS[name]
    return Diagnostic(kind.code, kind.severity, path, 0, 0, 1, message, "", notes, hint)


class Reporter:
    """Collects diagnostics; reports a mistake at a place once, even if a loop repeats it."""

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
        source = span.source
        line, column = source.position(span.start)
        source_line = source.line(line)
        length = max(1, min(span.end - span.start, len(source_line) - column + 1))
        whole = _of_file(name, source.path, message, hint, notes)
        self._add(replace(whole, line=line, column=column, length=length, source_line=source_line))

    def obeys(self, breach: Breach | None, span: Span) -> bool:
        """Whether a value at a place obeys a rule; if not, reports it."""
        if breach is not None:
            self.report(breach.rule, span, breach.message, hint=breach.hint)
        return breach is None

    def repeated(self, span: Span, what: str, *notes: str) -> None:
        """Reports what is written a second time, with notes about the first."""
        message = f"`{what}` is written a second time"
        self.report("statement-repeated", span, message, hint="remove one of the two", notes=notes)

    def taken(self, span: Span, what: str, first: Span, other: str = "another name") -> None:
        """Reports a name that is that of something before it; `other` is what to choose."""
        note = f"the first is at {first.place}"
        message = f"there is {what} already"
        self.report("duplicate-name", span, message, hint=f"choose {other}", notes=(note,))

    def chooses(self, text: str, span: Span, known: Sequence[str], message: str) -> bool:
        """Whether a word is one of the known ones; if not, reports that with a message."""
        if text not in known:
            near = did_you_mean(text, known) or f"write {' or '.join(f'`{w}`' for w in known)}"
            self.report("unknown-choice", span, message, hint=near)
        return text in known

    def report_file(self, name: str, path: str, message: str, *, hint: str | None = None) -> None:
        """Adds a diagnostic about a file as a whole."""
        self._add(_of_file(name, path, message, hint))

    def enter(self, path: str) -> None:
        """Adds a file to the order in which files are reported."""
        self._file_order.setdefault(path, len(self._file_order))

    def _add(self, diagnostic: Diagnostic) -> None:
        """Adds a diagnostic, unless the same kind has been reported at the same place."""
        order = self._file_order.setdefault(diagnostic.path, len(self._file_order))
        if len(self._found) == MAX_DIAGNOSTICS:
            message = f"there are more than {MAX_DIAGNOSTICS:,} mistakes; these are the first ones"
            diagnostic = _of_file("too-many-mistakes", diagnostic.path, message)
        elif len(self._found) > MAX_DIAGNOSTICS:
            return
        key = (diagnostic.code, diagnostic.path, diagnostic.line, diagnostic.column)
        self._found.setdefault(key, (order, diagnostic))

    @property
    def diagnostics(self) -> tuple[Diagnostic, ...]:
        """All diagnostics: by file in the order of `enter`, then by place."""
        found = sorted(
            self._found.values(), key=lambda f: (f[0], f[1].line, f[1].column, f[1].code)
        )
        return tuple(diagnostic for _, diagnostic in found)

    @property
    def has_errors(self) -> bool:
        """Whether there is an error, and not only warnings."""
        return any(d.severity == "error" for _, d in self._found.values())


def suggest(word: str, candidates: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The candidate most similar to `word`, if one is similar enough."""
    import difflib

    lowered = {candidate.lower(): candidate for candidate in candidates}
    near = difflib.get_close_matches(word.lower(), lowered, n=1, cutoff=cutoff)
    return lowered[near[0]] if near else None


def did_you_mean(word: str, candidates: Iterable[str], cutoff: float = 0.6) -> str | None:
    """A hint with the most similar candidate, if there is one."""
    near = suggest(word, candidates, cutoff)
    return None if near is None else f"did you mean `{near}`?"


_CLIP_COLUMNS = 140


def _clip(text: str, column: int) -> tuple[str, int]:
    """A part of a very long line around the column, and the column in that part."""
    if len(text) <= _CLIP_COLUMNS:
        return text, column
    start = max(0, min(column - 1 - _CLIP_COLUMNS // 3, len(text) - _CLIP_COLUMNS))
    return text[start : start + _CLIP_COLUMNS], column - start
