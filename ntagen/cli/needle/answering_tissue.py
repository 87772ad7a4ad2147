"""How `ntagen drive` goes in a tissue that answers: by a strategy, or by plans."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.options import gathered, path_option
from ntagen.cli.terminal import say_idle
from ntagen.errors import InputError
from ntagen.units import deg_from_rad
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.drive.configure import Configuration
    from ntagen.drive.following import Course
    from ntagen.drive.outcome import Driven
    from ntagen.drive.simulate import Maker
    from ntagen.plan.closed_loop import Segment
    from ntagen.scene import Scene

NO_STRATEGY: Final = Path("none")
"""What stands for the file of a strategy if plans are followed."""

_OPTIONS: Final = {
    "tree_path": "--strategy",
    "only_guaranteed": "--only-guaranteed",
    "tissue": "--tissue",
}


@dataclass(frozen=True, slots=True)
class Wanted:
    """What the command line says.

    Attributes:
        tree_path: The file of the strategy, or `NO_STRATEGY`; None if it is to be found.
        only_guaranteed: Whether the run ends where nothing is guaranteed any more.
        tissue: What a simulated tissue does; None if nothing is said.
    """

    tree_path: Path | None = None
    only_guaranteed: bool = False
    tissue: str | None = None


course_options = gathered(
    "wanted",
    {
        "tree_path": path_option(
            "--strategy",
            "tree_path",
            metavar="FILE.json|none",
            help="In a tissue that answers (tissue adversarial), follow the strategy in this file, "
            "which ntagen check --plans wrote for this task; or none, but plans for the expected "
            "tissue, which are made anew when the needle leaves them.  [default: a strategy that "
            "wins whatever the tissue picks is found before the needle enters; plans if there is "
            "none]",
        ),
        "only_guaranteed": click.option(
            "--only-guaranteed",
            is_flag=True,
            help="End the run as soon as no branch of the strategy explains where the tip is. "
            "Otherwise the run goes on by plans.",
        ),
        "tissue": click.option(
            "--tissue",
            metavar="corners|between|worst|expected",
            type=click.Choice(["corners", "between", "worst", "expected"]),
            help="What a tissue that answers does to the virtual needle, in each segment by "
            "--seed: pick corners or the middle of its bounds, any value between, what is worst "
            "for the strategy, or what is expected.  [default: corners]",
        ),
    },
    Wanted,
)
"""Adds the options; the command gets their values as `wanted`."""


def say_idle_options(scene: Scene, configuration: Configuration) -> None:
    """Tells which of the options have no effect."""
    if not scene.tissue.is_adversarial:
        say_idle(_OPTIONS, f"in a tissue that is {scene.tissue.kind}")
    elif configuration.needle.name != "virtual":
        say_idle({"tissue": "--tissue"}, "on this needle, whose tissue does what it does")


def picks_at_random(wanted: Wanted, scene: Scene) -> bool:
    """Whether a simulated tissue picks by the seed."""
    is_chosen = scene.tissue.is_adversarial and wanted.tissue not in ("worst", "expected")
    return is_chosen or scene.tissue.is_stochastic


def course_of(
    wanted: Wanted, scene: Scene, configuration: Configuration, listen: Callable[[], None]
) -> Course | None:
    """How a run goes; a strategy is looked for if none is given.

    Args:
        wanted: What the command line says.
        scene: The scene that the driver knows.
        configuration: The limits of the engine.
        listen: Raises `KeyboardInterrupt` to end the search.

    Raises:
        InputError: The options contradict each other, or the file has no strategy for the scene.
    """
    if not scene.tissue.is_adversarial:
        return None
    from ntagen.drive.following import Course
    from ntagen.drive.trees import load_tree

    if wanted.tree_path == NO_STRATEGY:
        if wanted.only_guaranteed:
            raise InputError(
                "plans have no guarantee against the tissue\n"
                "hint: leave out --strategy none or --only-guaranteed"
            )
        return None
    if wanted.tree_path is not None:
        return Course(load_tree(wanted.tree_path, scene), wanted.only_guaranteed)
    tree, lack = _found(scene, configuration, listen)
    return Course(tree, wanted.only_guaranteed, lack)


def _found(
    scene: Scene, configuration: Configuration, listen: Callable[[], None]
) -> tuple[Segment | None, str]:
    """The strategy that the engine finds, or why there is none."""
    from ntagen.plan.against_tissue import defend

    if len(scene.targets) != 1:
        return None, "strategies against the tissue are for one target"
    if scene.breath is not None:
        return None, "strategies against the tissue are for regions that keep still"
    settings = configuration.settings
    found = defend(
        scene,
        timeout_s=settings.engine_time_s,
        memory_bytes=settings.engine_memory_bytes,
        listen=listen,
    )
    if found.holds:
        return found.tree, ""
    if found.verdict == "not satisfied":
        return None, "no strategy wins whatever the tissue picks"
    return None, f"no strategy against the tissue was found (limit: {found.stop})"


def maker(
    wanted: Wanted, scene: Scene, configuration: Configuration, course: Course | None
) -> Maker | None:
    """Makes the needle of a simulated run; a virtual one in a tissue that answers.

    Args:
        wanted: What the command line says.
        scene: The actual scene.
        configuration: The needle and its errors.
        course: How the run goes.
    """
    needle = configuration.needle
    if needle.name != "virtual" or not scene.tissue.is_adversarial:
        return needle.made_in(scene)
    from ntagen.drive.simulate import answering

    tree = None if course is None else course.tree
    return answering(configuration.errors, scene, wanted.tissue or "corners", tree)


def guarantee_of(result: Driven, scene: Scene, course: Course | None) -> dict[str, Any] | None:
    """What was guaranteed in a run, for --json; None if nothing ever was."""
    followed, promised = result.guaranteed, result.promised
    if promised is not None and followed is not None:
        return {
            "by": "estimate",
            "branches": promised.branches,
            "from_mm": promised.depth_mm,
            "curvature_ratio": promised.curvature_ratio,
            "roll_deg": deg_from_rad(promised.roll_rad),
            "tip_mm": promised.tip_mm,
            "confidence": promised.confidence,
            "held": not followed.reason,
            "until_mm": followed.until_mm,
            "most_off_mm": followed.most_off_mm,
            "reason": followed.reason,
        }
    if not scene.tissue.is_adversarial:
        return None
    tree = None if course is None else course.tree
    return {
        "by": "plans" if tree is None else "strategy",
        "branches": None if tree is None else tree.leaves,
        "tip_mm": scene.tissue.tip_mm,
        "held": followed is not None and not followed.reason,
        "until_mm": 0.0 if followed is None else followed.until_mm,
        "most_off_mm": None if followed is None else followed.most_off_mm,
        "reason": (course.lack if course is not None else "")
        if followed is None
        else followed.reason,
    }
