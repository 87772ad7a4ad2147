"""What the driver relies on, so that no critical region is touched, and the margin that follows.

A plan avoids the critical regions that are known. The tip follows the plan only as well as the
driver can tell: it notices a deviation late, and by a noisy measurement. With force sensing, the
surroundings of a region are felt before the region is touched. Without it, only the distance to the
region is left: a plan must keep one that covers what the driver notices too late.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from ntagen.drive.force import stop_force_n
from ntagen.drive.settings import Settings
from ntagen.scene import Scene

if TYPE_CHECKING:
    from ntagen.drive.following import Course

_SIGMAS: Final = 3.0
"""A measured coordinate is within this many standard deviations in 99.7 % of cases."""


def clearance_without_force_mm(settings: Settings) -> float:
    """The distance that a plan keeps from critical regions if the force is not watched, in mm.

    The rule, ours: the sum of the deviation that is allowed, of the way that the needle is pushed
    before so many measurements in a row have shown it, and of three standard deviations of the
    noise.
    """
    late_mm = settings.deviation_count * settings.spacing_mm
    return settings.deviation_mm + late_mm + _SIGMAS * settings.priors.noise_mm


def with_default_margins(settings: Settings, given: Collection[str] = ()) -> Settings:
    """The settings with the margins that they need.

    Without force sensing the clearance is `clearance_without_force_mm`, unless somebody gave it.

    Args:
        settings: The settings.
        given: The fields that somebody gave.
    """
    if settings.force_sensing or "margins.clearance_mm" in given:
        return settings
    clearance_mm = max(settings.margins.clearance_mm, clearance_without_force_mm(settings))
    return replace(settings, margins=replace(settings.margins, clearance_mm=clearance_mm))


def relies_on(settings: Settings, scene: Scene, course: Course | None = None) -> str:
    """What the driver relies on, as a sentence; it stands in the log and at the start of a run.

    Args:
        settings: The settings.
        scene: The a-priori scene.
        course: In a tissue that answers, the strategy that is followed.
    """
    known = len(scene.criticals)
    regions = "1 known critical region" if known == 1 else f"{known} known critical regions"
    position = (
        f"relies on the position: stops at {settings.deviation_mm:g} mm of deviation in the mean "
        f"of {settings.deviation_count} or more readings"
    )
    if settings.force_sensing:
        felt_n = max(settings.force_n, stop_force_n(settings))
        force = f"on the force: stops when it rises by {felt_n:g} N"
    else:
        force = "not on the force: unknown regions are not felt"
    margin_mm = settings.margins.clearance_mm
    kept = f"plans stay more than {margin_mm:g} mm away" if margin_mm else "plans do not touch it"
    map_text = f"on {regions}: {kept if known == 1 else kept.replace('touch it', 'touch them')}"
    relied = [position, force, map_text if known else "on no known critical region"]
    if scene.tissue.is_adversarial:
        relied.append(_relies_on_course(scene, course))
    return "; ".join(relied)


def _relies_on_course(scene: Scene, course: Course | None) -> str:
    """What the driver relies on in a tissue that answers."""
    if course is None or course.tree is None:
        why = f"{course.lack}: " if course is not None and course.lack else ""
        return (
            f"{why}plans are for the expected tissue, with the tip error as margin, and made anew "
            "when the needle leaves them: nothing is guaranteed against the tissue"
        )
    then = "the run ends" if course.only_guaranteed else "plans follow, without this guarantee"
    return (
        f"on a strategy with {course.tree.leaves} branches, one for each answer of the tissue: "
        f"nothing is touched and the target is reached while the tip is within "
        f"{scene.tissue.tip_mm:g} mm of one of them, and it is if the tissue picks corners or the "
        f"middle of its bounds; else {then}"
    )
