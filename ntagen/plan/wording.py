"""The words for plans, the same wherever they are printed: check, plot, drive and pictures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from ntagen.plan.certify import Certificate
from ntagen.plan.rank import CRITERIA, USEFUL_CLEARANCE_MM, USEFUL_RESERVE_MM
from ntagen.plan.synthesise import Margins

if TYPE_CHECKING:
    from ntagen.plan.anytime import Best
    from ntagen.scene import Scene

_CRITERIA: Final = {
    "clearance": f"clearance (up to {USEFUL_CLEARANCE_MM:g} mm counts)",
    "rolls": "rolls",
    "length": "length",
    "reserve": f"reserve (up to {USEFUL_RESERVE_MM:g} mm counts)",
    "target": "distance of the end to the target's centre",
}
"""The criteria of a ranking in words."""


def counted(found: int, hold: int, *, is_complete: bool = True) -> str:
    """How many plans were found, and how many of them hold in exact kinematics.

    If not all plans of the model were listed, the words say so: the number is not that of the
    model.
    """
    plans = "1 plan" if found == 1 else f"{found} plans"
    if found == 0:
        return "no plan found"
    what = "found" if is_complete else "looked at"
    return f"{plans} {what}, {hold} {'holds' if hold == 1 else 'hold'} in exact kinematics"


def ranked_by(ranking: Sequence[str]) -> str:
    """The order in which plans are listed, on one line."""
    return f"best first: by {', then '.join(_CRITERIA[name] for name in ranking)}"


def required(margins: Margins) -> str:
    """What a plan must do to hold, on one line."""
    return (
        f"a plan holds if its whole path stays more than {margins.clearance_mm:g} mm away from "
        "critical regions and out of detection and unexplored regions, and ends at least "
        f"{margins.depth_mm:g} mm deep in the target"
    )


def judged(certificate: Certificate, margins: Margins) -> str:
    """Whether a plan holds, with its distances: what a list of plans says of each."""
    verdict = "holds" if margins.allow(certificate) else "fails"
    distances = [clearance_of(certificate)]
    detection_mm = certificate.detection_clearance_mm
    if detection_mm <= margins.detection_mm:
        distances.append(f"{-detection_mm:.2f} mm inside of a detection region")
    if certificate.unexplored_clearance_mm <= 0.0:
        distances.append("enters an unexplored region")
    depth_mm = certificate.target_depth_mm
    if not math.isfinite(depth_mm):
        distances.append("misses a target")
    elif depth_mm < margins.depth_mm:
        distances.append(f"only {depth_mm:.2f} mm deep in the target")
    said = ", ".join(part for part in distances if part)
    return f"{verdict} ({said})" if said else verdict


def bounded(best: Best, ranking: Sequence[str], scene: Scene) -> list[str]:
    """How good the best plan is by each criterion, and how good any plan can be; a line each."""
    from ntagen.plan.anytime import goodness

    certificate = best.candidates[0].certificate
    lines = []
    among = "no plan"
    for name in ranking:
        value = goodness(name, CRITERIA[name](certificate))
        unit = "" if name == "rolls" else " mm"
        if best.is_settled(name, scene):
            said = f"{among} is better"
        elif name in best.limits:
            than = "more" if name in ("clearance", "reserve") else "less"
            limit = goodness(name, best.limits[name])
            said = f"{among} has {than} than {limit:.4g}{unit}; whether one has, is unknown"
        else:
            said = "whether there is a better one, is unknown"
        lines.append(f"{name}: {value:.4g}{unit}; {said}")
        among = "no plan that is as good so far"
    return lines


def clearance_of(certificate: Certificate) -> str:
    """The distance of a plan to critical regions, for the end of a line; empty without one."""
    clearance_mm = certificate.critical_clearance_mm
    return f"{clearance_mm:.2f} mm from critical regions" if math.isfinite(clearance_mm) else ""
