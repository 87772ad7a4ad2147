"""The picture of a strategy against a tissue that answers: all its branches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ntagen.needle.path import sample_poses
from ntagen.plan.branches import Stretch, certify_all, expected_path, stretches
from ntagen.plan.closed_loop import Segment
from ntagen.plot.picture import Curve, Picture
from ntagen.scene import Scene

_SPACING_MM: Final = 1.0

OTHER_LABEL: Final = "path for another answer of the tissue"
EXPECTED_LABEL: Final = "path if the tissue does what is expected"
FOLLOWED_LABEL: Final = "branch that was followed"


def picture_of_strategy(scene: Scene, tree: Segment) -> Picture:
    """The picture of a scene with all branches of a strategy; the expected one is thick."""
    reach, tissue = certify_all(tree, scene), scene.tissue
    rolls = "1 roll" if reach.most_rolls == 1 else f"{reach.most_rolls} rolls"
    near = f"{reach.clearance_mm:.2f} mm from what must not be touched, " if scene.avoided else ""
    return Picture(
        scene=scene,
        best=curve_of(expected_path(tree, scene)),
        others=branches_of(tree, scene),
        best_label=EXPECTED_LABEL,
        other_label=OTHER_LABEL,
        title=f"{scene.name}: one strategy, whatever the tissue picks",
        caption=(
            f"{reach.leaves} branches, with at most {rolls} and {reach.longest_mm:g} mm; "
            f"each is at least {near}and {reach.depth_mm:.2f} mm deep in the target, "
            f"and {tissue.tip_mm:g} mm is needed"
        ),
    )


def branches_of(tree: Segment, scene: Scene) -> list[Curve]:
    """The curves of all branches; what several have in common is drawn once."""
    return [curve_of((one,)) for one in stretches(tree, scene)]


def curve_of(way: Sequence[Stretch]) -> Curve:
    """The points of a way through a strategy."""
    poses = sample_poses(tuple(one.arc for one in way), _SPACING_MM)
    return [pose.position_mm for pose in poses]
