"""What `ntagen drive` prints: the run line by line, and how it ended."""

from __future__ import annotations

import contextlib
import dataclasses
import math
from typing import TYPE_CHECKING, Any

from ntagen.cli.terminal import echo

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from ntagen.drive.configure import Configuration
    from ntagen.drive.outcome import Driven
    from ntagen.drive.records import Journal, Record
    from ntagen.drive.simulate import Result
    from ntagen.plan.synthesise import Synthesis
    from ntagen.scene import Scene


class _Lines:
    """Prints the run line by line; on a terminal also what happens at the moment."""

    def __init__(
        self,
        ranking: Sequence[str],
        status: Any = None,  # noqa: ANN401  rich is imported late
    ) -> None:
        self._ranking = ranking
        self._status = status

    def record(self, record: Record) -> None:
        """Prints the line of a record, if it has one, and refreshes the status."""
        from ntagen.drive.records import Measured, Transition
        from ntagen.drive.story import tell

        line = tell(record)
        if line is not None:
            echo(line)
        if self._status is None:
            return
        if isinstance(record, Transition):
            self._status.update(record.following)
        elif isinstance(record, Measured):
            self._status.update(
                f"{record.time_s:7.2f} s  {record.depth_mm:6.2f} mm deep, "
                f"force {record.force_n:.2f} N"
            )

    def started(self, scene: Scene) -> None:
        """Prints what is steered, what the driver knows, and how it chooses."""
        from ntagen.plan.wording import ranked_by

        echo(
            f"{scene.name}: {len(scene.targets)} target(s), "
            f"{len(scene.criticals)} critical region(s) known; plans "
            f"{ranked_by(self._ranking)}"
        )

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        """Does nothing: the record of the synthesis has the line."""


@contextlib.contextmanager
def lines(ranking: Sequence[str], *, moves: bool) -> Iterator[Journal]:
    """The journal that prints; only a terminal gets a status line, if it may move."""
    import sys

    if not moves or not sys.stdout.isatty():
        yield _Lines(ranking)
        return
    from rich.console import Console

    with Console().status("arm") as status:
        yield _Lines(ranking, status)


def summary(
    result: Driven, configuration: Configuration, known: str, log_path: Path | None
) -> dict[str, Any]:
    """The end of a run for --json; what nobody knows of a real needle is null."""
    from ntagen.drive.simulate import Result
    from ntagen.units import deg_from_rad

    ended = result.ended
    errors = configuration.errors
    truth = result if isinstance(result, Result) else None
    is_clear = truth is None or not math.isfinite(truth.clearance_mm)
    return {
        "outcome": ended.outcome,
        "reason": ended.reason,
        "time_s": ended.time_s,
        "depth_mm": ended.depth_mm,
        "adjustments": ended.adjustments,
        "syntheses": ended.syntheses,
        "cut_mm": ended.cut_mm,
        "confidence": ended.confidence or None,
        "error_mm": ended.error_mm or None,
        "each_synthesis": [dataclasses.asdict(one) for one in result.syntheses],
        "true_clearance_mm": None if truth is None or is_clear else truth.clearance_mm,
        "true_target_distance_mm": None if truth is None else truth.target_distance_mm,
        "seed": None if truth is None else configuration.seed,
        "noise_mm": configuration.needle.error("noise_mm"),
        "roll_error_deg": deg_from_rad(errors.roll_rad),
        "known": known,
        "log": None if log_path is None else str(log_path),
    }


def report(result: Driven, scene: Scene, log_path: Path | None, *, short: bool) -> None:
    """Prints how a run ended."""
    from ntagen.drive.simulate import Result

    ended = result.ended
    if short:
        echo(f"{ended.outcome}: {ended.reason}")
        return
    if isinstance(result, Result):
        _tell_truth(result, scene.targets[-1].name)
    if ended.confidence:
        echo(
            f"by the last estimate, the tip is in {scene.targets[-1].name} with a confidence of "
            f"{ended.confidence:.3f}, and known to {ended.error_mm:.2f} mm"
        )
    count = f"{ended.syntheses} syntheses, {ended.adjustments} adjustments"
    echo(f"{count}, {ended.time_s:.1f} s, {ended.depth_mm:.1f} mm deep, {ended.cut_mm:.1f} mm cut")
    if log_path is not None:
        echo(f"wrote {log_path}")


def _tell_truth(result: Result, target: str) -> None:
    clearance_mm, target_mm = result.clearance_mm, result.target_distance_mm
    where = "inside" if target_mm <= 0.0 else "outside of"
    echo(f"in truth, the tip is {abs(target_mm):.2f} mm {where} {target}", nl=False)
    if math.isfinite(clearance_mm):
        echo(f", and the needle's path is {clearance_mm:.2f} mm or more from critical regions")
    else:
        echo("")
