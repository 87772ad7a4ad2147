"""The facts of a run as one document for JSON; the page shows the same.

``format`` is ``ntagen-report``, ``version`` 1. Units come last in names: mm, s, N, deg, rad. What
is not known, infinite or not logged is null. Later programs may add entries; they rename none.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any, Final

from ntagen.drive.reading import RunLog
from ntagen.report.checking import Check
from ntagen.report.ending import (
    deviation_of,
    ending_of,
    errors_of,
    last_estimate_of,
    margins_of,
    series_of,
    true_clearance_mm,
)
from ntagen.report.task import measuring_of, needle_of, settings_of, task_of
from ntagen.report.told import events_of, syntheses_of
from ntagen.version import VERSION

FORMAT: Final = "ntagen-report"
FORMAT_VERSION: Final = 1


def facts_of(log: RunLog, checks: Sequence[Check] | None = None) -> dict[str, Any]:
    """The facts of a run.

    Args:
        log: The log.
        checks: What was checked again; None if nothing was.

    Raises:
        InputError: The log lacks its scene or settings, or has a part that cannot be read.
    """
    return {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "log": _file(log),
        "programs": {"log": log.metadata.get("program", ""), "report": f"ntagen {VERSION}"},
        "task": task_of(log),
        "needle": needle_of(log),
        "settings": settings_of(log),
        "measuring": measuring_of(log),
        "end": ending_of(log),
        "errors": errors_of(log),
        "deviation": deviation_of(log),
        "true_clearance_mm": true_clearance_mm(log),
        "margins": margins_of(log),
        "last_estimate": last_estimate_of(log),
        "syntheses": syntheses_of(log),
        "events": events_of(log),
        "series": series_of(log),
        "inputs": _inputs(log),
        "checks": None if checks is None else [asdict(check) for check in checks],
        "holds": None if checks is None else verdict_of(checks),
    }


def verdict_of(checks: Sequence[Check]) -> bool | None:
    """Whether all that was checked holds; None if a check did not cover what it looked at."""
    results = {check.result for check in checks}
    if "does not hold" in results:
        return False
    return None if "not covered" in results else True


def _file(log: RunLog) -> dict[str, Any]:
    return {
        "file": log.path.name,
        "bytes": log.file_bytes,
        "sha256": log.sha256,
        "format_version": log.metadata.get("format_version"),
        "started_at": log.metadata.get("started_at"),
        "is_whole": log.torn_at_byte is None,
        "torn_at_byte": log.torn_at_byte,
        "resumes": log.resumes,
        "records": len(log.records),
        "last_s": log.records[-1].time_s if log.records else None,
    }


def _inputs(log: RunLog) -> list[dict[str, Any]]:
    """The log and all files in it, with their lengths and digests."""
    own = {"name": log.path.name, "bytes": log.file_bytes, "sha256": log.sha256, "in_log": False}
    return [own] + [
        {
            "name": name,
            "bytes": len(data),
            "sha256": hashlib.sha256(data).hexdigest(),
            "in_log": True,
        }
        for name, data in log.attachments.items()
    ]
