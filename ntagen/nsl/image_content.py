"""Resolves regions from files, and where imaging space is: their words and values."""

from __future__ import annotations

from typing import Final

from ntagen.nsl import tree
from ntagen.nsl.diagnostics import Reporter, did_you_mean
from ntagen.nsl.draft import Draft, DraftImage, DraftTransform, Placed
from ntagen.nsl.evaluate import Evaluator, Scope
from ntagen.nsl.quantity import LENGTH, NUMBER, UNITS

_SPACES: Final = ("LPS", "RAS")
_MATRICES: Final = ("qform", "sform")
_CLAUSES: Final[dict[tree.ImageForm, frozenset[str]]] = {
    "mesh": frozenset({"in", "grid"}),
    "segmentation": frozenset({"in", "segment", "label", "grid"}),
    "markups": frozenset({"in", "point", "radius"}),
}
"""The clauses that each kind of file can have."""


class ImageResolver:
    """Resolves the values of shapes from files."""

    def __init__(self, reporter: Reporter, evaluator: Evaluator) -> None:
        self._reporter = reporter
        self._evaluator = evaluator

    def image(self, shape: tree.Image, name: str, scope: Scope) -> DraftImage | None:
        """The clauses of a shape from a file; None after a mistake."""
        clauses: dict[str, tree.Clause] = {}
        for clause in shape.clauses:
            if clause.keyword not in _CLAUSES[shape.form]:
                known = ", ".join(f"`{word}`" for word in sorted(_CLAUSES[shape.form]))
                self._reporter.report(
                    "clause-misused",
                    clause.span,
                    f"a {shape.form} has no `{clause.keyword}`",
                    hint=f"it can have {known}",
                )
                return None
            if clauses.setdefault(clause.keyword, clause) is not clause:
                self._repeated(clause)
                return None
        if "segment" in clauses and "label" in clauses:
            self._repeated(clauses["label"])
            return None
        space, unit_mm, matrix, is_right = self._space(shape.form, clauses.get("in"))
        part: Placed[str] | Placed[int] | None = None
        for keyword in ("segment", "point"):
            if keyword in clauses:
                word = clauses[keyword].words[0]
                part = Placed(word.text, word.span)
        if "label" in clauses and (value := clauses["label"].value) is not None:
            part = self._evaluator.whole(value, scope, f"the label of `{name}`")
            is_right = is_right and part.value is not None
        lengths: dict[str, Placed[float]] = {}
        for keyword, what in (("radius", "the radius"), ("grid", "the grid")):
            if keyword in clauses and (value := clauses[keyword].value) is not None:
                role = f"{what} of `{name}`"
                length = self._evaluator.number(value, scope, LENGTH, role)
                lengths[keyword] = length
                is_right = self._is_positive(length, role) and is_right
        path = Placed(shape.path.text, shape.path.span)
        radius_mm, grid_mm = lengths.get("radius"), lengths.get("grid")
        image = DraftImage(shape.form, path, space, unit_mm, part, matrix, radius_mm, grid_mm)
        return image if is_right else None

    def _is_positive(self, length: Placed[float], role: str) -> bool:
        """Whether a length has no mistake and is greater than 0; if it is not, reports it."""
        if length.value is not None and length.value <= 0.0:
            message = f"{role} must be greater than 0, but this is {length.value:g} mm"
            self._reporter.report("radius-not-positive", length.span, message)
        return length.value is not None and length.value > 0.0

    def _space(
        self, form: tree.ImageForm, clause: tree.Clause | None
    ) -> tuple[Placed[str] | None, Placed[float] | None, Placed[str] | None, bool]:
        """The space, the unit and the matrix after `in`, in any order, and if all is right."""
        space: Placed[str] | None = None
        unit: Placed[float] | None = None
        matrix: Placed[str] | None = None
        for word in () if clause is None else clause.words:
            known = UNITS.get(word.text)
            if word.text in _SPACES and space is None:
                space = Placed(word.text, word.span)
            elif known is not None and known[1] == LENGTH and unit is None:
                unit = Placed(known[0], word.span)
            elif word.text in _MATRICES and matrix is None and form == "segmentation":
                matrix = Placed(word.text, word.span)
            else:
                self._reporter.report(
                    "unknown-choice",
                    word.span,
                    f"`{word.text}` is not a space and a unit",
                    hint=did_you_mean(word.text, (*_SPACES, "mm", "cm", "m"))
                    or "write for example `in LPS mm`",
                )
                return None, None, None, False
        return space, unit, matrix, True

    def transform(self, statement: tree.Transform, scope: Scope, draft: Draft) -> None:
        """Where imaging space is."""
        draft.transform = self._transform(statement, scope)
        draft.has_gaps |= draft.transform is None

    def _transform(self, statement: tree.Transform, scope: Scope) -> DraftTransform | None:
        """Where imaging space is; None after a mistake."""
        direction, space = statement.direction, statement.space
        for word, known in ((direction, ("from", "to")), (space, _SPACES)):
            message = f"a transform is not written with `{word.text}` here"
            if not self._reporter.chooses(word.text, word.span, known, message):
                return None
        is_from = direction.text == "from"
        placed = Placed(space.text, space.span)
        if statement.file is not None:
            file = Placed(statement.file.text, statement.file.span)
            return DraftTransform(statement.span, is_from, placed, file)
        if len(statement.rows) not in (3, 4):
            self._reporter.report(
                "vector-size",
                statement.span,
                f"a transform has three or four rows, but this has {len(statement.rows)}",
                hint="write for example `(1, 0, 0, 5 mm), (0, 1, 0, 0 mm), (0, 0, 1, 0 mm)`",
            )
            return None
        rows = [self._row(row, scope, index == 3) for index, row in enumerate(statement.rows)]
        found = tuple(row for row in rows if row is not None)
        if len(found) < len(rows):
            return None
        return DraftTransform(statement.span, is_from, placed, None, found)

    def _row(self, row: tree.Expression, scope: Scope, is_last: bool) -> tuple[float, ...] | None:
        """A row of the matrix: three numbers, and a length; the fourth row is plain."""
        if not isinstance(row, tree.Vector) or len(row.components) != 4:
            self._reporter.report(
                "vector-size",
                row.span,
                "a row of a transform has four components",
                hint="write three numbers and a length, for example `(1, 0, 0, 5 mm)`",
            )
            return None
        numbers = []
        for index, component in enumerate(row.components):
            is_shift = index == 3 and not is_last
            what = "a shift" if is_shift else "an entry of the turn"
            dimension = LENGTH if is_shift else NUMBER
            numbers.append(self._evaluator.number(component, scope, dimension, what).value)
        found = tuple(number for number in numbers if number is not None)
        return found if len(found) == 4 else None

    def _repeated(self, clause: tree.Clause) -> None:
        message = f"`{clause.keyword}` says once more which part is meant"
        if clause.keyword not in ("segment", "label", "point"):
            self._reporter.repeated(clause.span, clause.keyword)
        else:
            hint = "remove one of the two"
            self._reporter.report("statement-repeated", clause.span, message, hint=hint)
