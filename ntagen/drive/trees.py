"""Files of strategies against a tissue: `ntagen check --plans` writes them, `ntagen drive` reads.

A file says for which task its strategy was made, by a digest of what the strategy depends on. What
it promises is not believed but computed anew: each branch is followed in exact kinematics.
"""

from __future__ import annotations

import hashlib
import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

from ntagen.drive.following import Course
from ntagen.drive.json_values import value_from_json
from ntagen.drive.scene_json import scene_to_json
from ntagen.errors import InputError
from ntagen.files import json_of, read_file
from ntagen.plan.against_tissue import Defence
from ntagen.plan.branches import certify_all
from ntagen.plan.closed_loop import Segment
from ntagen.scene import Scene

FORMAT: Final = "ntagen-closed-loop"
VERSION: Final = 2

COURSE: Final = "course"
"""The entry of a log that says how the run went in a tissue that answers."""

MAX_TREE_BYTES: Final = 64 * 2**20
"""The largest file; a strategy with three rolls takes less than one MiB."""

_COUNTS: Final = ("needle", "axis", "limits", "targets", "criticals", "detections", "unexplored")
_COUNTS_TOO: Final = ("tissue", "breath")
"""What a strategy depends on. The name, queries, resolution and safe regions do not matter."""

_HINT: Final = "hint: `ntagen check TASK --verify --plans FILE` writes one for a task"

_SMALL_MM: Final = 1e-6


def digest_of(scene: Scene) -> str:
    """A digest of all that a strategy for the scene depends on."""
    entries = json.loads(scene_to_json(scene))["scene"]
    counting = {name: entries.get(name) for name in (*_COUNTS, *_COUNTS_TOO)}
    return hashlib.sha256(json.dumps(counting, sort_keys=True).encode()).hexdigest()


def document_of(found: Defence) -> dict[str, Any]:
    """The file of a strategy that was found, as JSON; angles in rad, lengths in mm.

    Raises:
        ValueError: None was found.
    """
    if found.tree is None:
        raise ValueError("there is no strategy")
    return {
        "format": FORMAT,
        "version": VERSION,
        "task": found.scene.name,
        "scene_sha256": digest_of(found.scene),
        "tree": asdict(found.tree),
        "guarantee": found.guarantee(),
        "holds": found.holds,
    }


def load_tree(path: Path, scene: Scene) -> Segment:
    """The strategy in a file, if it is for the scene and holds there.

    Raises:
        InputError: The file cannot be read, or has no strategy for this scene.
    """
    try:
        text = read_file(path, MAX_TREE_BYTES)
    except OSError as error:
        raise InputError(f"cannot read {path}: {(error.strerror or str(error)).lower()}") from error
    try:
        document = json_of(text)
        if document["format"] != FORMAT:
            raise InputError(f"{path} has another format: {document['format']!r}\n{_HINT}")
        if document["version"] != VERSION:
            raise InputError(
                f"{path} has version {document['version']!r}, but this ntagen reads only version "
                f"{VERSION}\n{_HINT}"
            )
        digest, tree = document["scene_sha256"], tree_from_json(document["tree"])
    except (AttributeError, KeyError, TypeError, ValueError, RecursionError) as error:
        raise InputError(f"{path} is no strategy against a tissue: {error!r}\n{_HINT}") from error
    if digest != digest_of(scene):
        raise InputError(
            f"{path} is a strategy for another task ({document.get('task')}), or for this one "
            f"before it was changed\n"
            "hint: write it again with `ntagen check TASK --verify --plans FILE`; for a driver "
            "that does not know all regions (--known), leave out --strategy"
        )
    try:
        require_holding(tree, scene)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return tree


def tree_from_json(document: object) -> Segment:
    """The strategy of its JSON.

    Raises:
        ValueError: It is none.
    """
    tree = value_from_json(document, Segment)
    _require_lengths(tree)
    return tree


def course_to_log(course: Course) -> tuple[str, bytes | None]:
    """How a run goes, as a text for the log, and the file of the strategy that is followed."""
    text = json.dumps({"only_guaranteed": course.only_guaranteed, "lack": course.lack})
    tree = None if course.tree is None else json.dumps(asdict(course.tree)).encode()
    return text, tree


def course_from_log(text: str, tree: bytes | None) -> Course:
    """The course of what `course_to_log` wrote.

    Raises:
        KeyError, TypeError, ValueError: It is none.
    """
    said = json_of(text)
    only, lack = bool(said["only_guaranteed"]), str(said["lack"])
    return Course(None if tree is None else tree_from_json(json_of(tree)), only, lack)


def _require_lengths(segment: Segment) -> None:
    if not math.isfinite(segment.roll_rad):
        raise ValueError("rolls are finite")
    for branch in segment.branches:
        if not branch.length_mm > _SMALL_MM or not branch.factor > 0.0:
            raise ValueError("lengths and factors are greater than 0")
        if branch.then is not None:
            _require_lengths(branch.then)


def require_holding(tree: Segment, scene: Scene) -> None:
    """Refuses a strategy that does not answer all picks, or does not hold in exact kinematics.

    Raises:
        InputError: It does not.
    """
    _require_picks(tree, scene, is_first=True)
    if tree.longest_mm > scene.needle.length_mm + _SMALL_MM:
        raise InputError(f"the strategy is {tree.longest_mm:g} mm long: longer than the needle")
    tissue, reach = scene.tissue, certify_all(tree, scene)
    if reach.most_rolls > scene.limits.max_rolls:
        raise InputError(f"the strategy makes {reach.most_rolls} rolls, and the task allows less")
    if not reach.holds(tissue.tip_mm):
        raise InputError(
            f"the strategy does not hold in this task: {reach.clearance_mm:.2f} mm from regions, "
            f"and {reach.depth_mm:.2f} mm deep in the target; both must be {tissue.tip_mm:g} mm"
        )


def _require_picks(segment: Segment, scene: Scene, *, is_first: bool) -> None:
    """Each pick of the tissue has a branch in each segment."""
    tissue = scene.tissue
    # At the entry there is no roll, or one that is seen.
    is_exact = is_first and (segment.roll_rad == 0.0 or scene.limits.free_bevel)
    errors = (0.0,) if is_exact else tissue.roll_errors_rad
    needed = sorted((factor, error) for factor in tissue.factors for error in errors)
    if sorted((one.factor, one.roll_error_rad) for one in segment.branches) != needed:
        raise InputError("the strategy does not answer all that the tissue of the task may pick")
    for branch in segment.branches:
        if branch.then is not None:
            _require_picks(branch.then, scene, is_first=False)
