"""The pages of all diagnostics: those of models, from the engine, and those of environments."""

from __future__ import annotations

from dataclasses import dataclass

from ntagen import checker
from ntagen.nsl.diagnostics import KINDS, page_of


@dataclass(frozen=True, slots=True)
class Explanation:
    """The explanation of one kind of diagnostic.

    Attributes:
        code: ``E0201``.
        name: ``name-unknown``.
        severity: ``error`` or ``warning``.
        page: What it means, an example, how to fix it, and the fixed example, in Markdown. The word
            after the language of an example says what it is: ``wrong``, ``right``, or ``model`` for
            the model that the queries of the page are about.
    """

    code: str
    name: str
    severity: str
    page: str


def explanations() -> dict[str, Explanation]:
    """All diagnostics by their codes."""
    found = [Explanation(*entry) for entry in checker.diagnostic_pages()]
    found += [
        Explanation(kind.code, kind.name, kind.severity, page_of(kind)) for kind in KINDS.values()
    ]
    return {explanation.code: explanation for explanation in found}
