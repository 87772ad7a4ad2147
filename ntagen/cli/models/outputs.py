"""Where `ntagen check` writes the evidence for answers."""

from __future__ import annotations

from dataclasses import field
from pathlib import Path

from ntagen.cli.models.plan_lists import ListLimits
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Outputs:
    """Where evidence is written; ``None`` is nowhere."""

    trace: str | None
    certificate: Path | None
    strategy: str | None
    plans: str | None
    ranking: tuple[str, ...]
    limits: ListLimits = field(default_factory=ListLimits)
    written: set[str] = field(default_factory=set)
    """The options whose output has been written."""
    stops: dict[str, str] = field(default_factory=dict)
    """By query: ``time`` or ``memory`` if that limit ended a list of plans."""

    def missing(self) -> list[str]:
        """The options whose output was asked for and has not been written."""
        wanted = self.wanted().items()
        return [name for name, target in wanted if target and name not in self.written]

    def wanted(self) -> dict[str, str | Path | None]:
        """Where the output of each option is written."""
        return {
            "--trace": self.trace,
            "--certificate": self.certificate,
            "--strategy": self.strategy,
            "--plans": self.plans,
        }
