"""The table of an experiment: plain data, a dict a row, from the runs in any order.

What was measured in seconds of a computer stands in `TIMES`, and is all that two tables of the
same runs may differ in.
"""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from ntagen.cluster.identity import identity
from ntagen.experiment.description import Experiment, Row
from ntagen.experiment.paper import PAPER
from ntagen.experiment.record import Run
from ntagen.experiment.sweeps import sweeps_of

FORMAT_VERSION: Final = 1

CONFIDENCE: Final = 0.95
"""The probability with which the interval of a rate has the true rate in it, at least."""

TIMES: Final = ("synthesis_s", "loop_s", "overall_s", "run_s")
"""The entries of a row that are, or contain, seconds of a computer."""

RUN_TIMES: Final = ("seconds", "engine_s", "loop_s")
"""The entries of a run that are."""


def document_of(
    experiment: Experiment,
    runs: Mapping[tuple[str, int], Run],
    lost: Mapping[tuple[str, int], str] | None = None,
) -> dict[str, Any]:
    """The whole table, as it is written in ``table.json``.

    Args:
        experiment: The rows.
        runs: The finished runs, by row and seed.
        lost: The runs that could not be made, each with the reason.
    """
    lost = lost or {}
    return {
        "format": FORMAT_VERSION,
        "ntagen": identity(),
        "name": experiment.name,
        "confidence": CONFIDENCE,
        "rows": [
            row_of(row, [runs[row.id, s] for s in sorted(row.seeds) if (row.id, s) in runs])
            for row in experiment.rows
        ],
        "runs": [
            runs[row.id, seed].to_json()
            for row in experiment.rows
            for seed in sorted(row.seeds)
            if (row.id, seed) in runs
        ],
        "sweeps": [sweep.to_json() for sweep in sweeps_of(experiment.rows)],
        "lost": [
            {"row": row, "seed": seed, "reason": reason}
            for (row, seed), reason in sorted(lost.items())
        ],
    }


def row_of(row: Row, runs: Sequence[Run]) -> dict[str, Any]:
    """A row of the table.

    The hit rate is about the needle's true path, and so is "reached": the driver says so, and the
    true tip is in the target. Confidence and error of the tip are those of the driver, when it
    says that the tip is there. Overall times are those of the needle and of all syntheses of a run.
    """
    sound = [run for run in runs if run.target_mm is not None]
    syntheses = [one for run in sound for one in run.syntheses]
    reach = rate_of(sum(run.is_reached for run in runs), len(runs))
    hit = rate_of(sum(run.is_hit for run in sound), len(sound))
    clearances = [run.clearance_mm for run in sound if run.clearance_mm is not None]
    plans = [sum(one.found for one in run.syntheses) for run in sound]
    hold = [sum(one.hold for one in run.syntheses) for run in sound]
    return {
        "id": row.id,
        "scenario": row.scenario.stem,
        "known": row.known,
        "needle": row.needle,
        "speed": row.speed,
        "settings": row.shown_values(),
        "values": row.numbers(),
        "wanted": len(row.seeds),
        "runs": len(runs),
        "reached": reach.count,
        "reach_rate": reach.rate,
        "reach_low": reach.low,
        "reach_high": reach.high,
        "hits": hit.count,
        "hit_rate": hit.rate,
        "hit_low": hit.low,
        "hit_high": hit.high,
        "outcomes": dict(sorted(Counter(run.outcome for run in runs).items())),
        "adjustments": _spread(spread_of(run.adjustments for run in sound)),
        "cut_mm": _spread(spread_of(run.cut_mm for run in sound)),
        "confidence": _spread(spread_of(one.confidence for one in sound if one.confidence)),
        "error_mm": _spread(spread_of(one.error_mm for one in sound if one.error_mm)),
        "syntheses": _spread(spread_of(len(run.syntheses) for run in sound)),
        "plans": _spread(spread_of(plans)),
        "plans_total": sum(plans),
        "plans_hold_total": sum(hold),
        "clearance_mm": _spread(spread_of(clearances)),
        "needle_s": _spread(spread_of(run.needle_s for run in sound)),
        "synthesis_s": _spread(spread_of(one.engine_s for one in syntheses)),
        "loop_s": _spread(spread_of(one.loop_s for one in syntheses)),
        "overall_s": _spread(spread_of(run.overall_s for run in sound)),
        "run_s": _spread(spread_of(run.seconds for run in runs)),
        "paper": dataclasses.asdict(PAPER[row.paper]) | {"line": row.paper} if row.paper else None,
    }


def timeless(document: Mapping[str, Any]) -> dict[str, Any]:
    """The table without what was measured in seconds of a computer: the rest is reproducible."""
    rows = [{k: v for k, v in row.items() if k not in TIMES} for row in document["rows"]]
    return {**document, "rows": rows, "runs": [_timeless_run(run) for run in document["runs"]]}


def _timeless_run(run: Mapping[str, Any]) -> dict[str, Any]:
    kept = {key: value for key, value in run.items() if key not in RUN_TIMES}
    kept["syntheses"] = [
        {key: value for key, value in one.items() if key not in RUN_TIMES}
        for one in run["syntheses"]
    ]
    return kept


def _spread(spread: Spread | None) -> dict[str, float] | None:
    return None if spread is None else dataclasses.asdict(spread)


@dataclass(frozen=True, slots=True)
class Rate:
    """How often something happened.

    Attributes:
        count: How many times.
        of: In how many runs.
        low: The lower end of the interval of the true rate.
        high: Its upper end.
    """

    count: int
    of: int
    low: float
    high: float

    @property
    def rate(self) -> float | None:
        """The part of the runs; None without a run."""
        return self.count / self.of if self.of else None


@dataclass(frozen=True, slots=True)
class Spread:
    """Least, mean and greatest value."""

    min: float
    avg: float
    max: float


def rate_of(count: int, of: int) -> Rate:
    """A rate with its interval of Clopper and Pearson (1934), which is never too narrow.

    Args:
        count: How many times it happened.
        of: In how many runs; with none, the rate can be anything.

    Raises:
        ValueError: A number is negative, or the first is the greater one.
    """
    if not 0 <= count <= of:
        raise ValueError(f"{count} of {of} is no rate")
    # Importing the statistics of SciPy takes 0.5 s; these two functions are all of it.
    from scipy.special import betaincinv  # type: ignore[import-untyped]

    rest = 0.5 * (1.0 - CONFIDENCE)
    low = float(betaincinv(count, of - count + 1, rest)) if count else 0.0
    high = float(betaincinv(count + 1, of - count, 1.0 - rest)) if count < of else 1.0
    return Rate(count, of, low, high)


def spread_of(values: Iterable[float]) -> Spread | None:
    """The spread of values, in whatever order they come; None if there are none."""
    found = list(values)
    if not found:
        return None
    # An exact sum does not depend on the order of the runs.
    return Spread(min(found), math.fsum(found) / len(found), max(found))
