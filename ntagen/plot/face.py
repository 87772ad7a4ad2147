"""`ntagen.view` and `ntagen.animate`: a task or a run in one call, for scripts and notebooks."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Final

from ntagen.drive.reading import read_log
from ntagen.drive.settings import engine_for
from ntagen.plan.synthesise import EngineSynthesiser
from ntagen.plot.animation import Animation, animation_of
from ntagen.plot.picture import Picture
from ntagen.plot.run import picture_of_plans, picture_of_run
from ntagen.plot.viewer import Page, page_of
from ntagen.scene import Scene

_BUDGET_S: Final = 3.0
"""The time to look for plans, if there are too many to list all."""


def view(source: str | Path, *, plans: int = 20) -> Page:
    """A task with its plans, or a run, as a page to turn and to step through.

    A notebook shows it; `Page.save` writes it as one HTML file, which needs no network.

    Args:
        source: The path of an environment (``.nsl``), or of the log of a run (``.mcap``). In a
            tissue that answers, plans for the expected tissue are drawn.
        plans: At most this many plans are shown. 0 shows the scene alone.

    Raises:
        InputError: The file is wrong.
        LimitError: The engine reached a limit.
    """
    return page_of(_picture(Path(source), plans))


def animate(source: str | Path, *, plans: int = 20) -> Animation:
    """A run over time, or one breath of a task whose regions move, as a GIF.

    A notebook shows it; `Animation.save` writes it.

    Args:
        source: As for `view`.
        plans: As for `view`.

    Raises:
        InputError: The file is wrong, or nothing moves.
        LimitError: The engine reached a limit.
    """
    return animation_of(_picture(Path(source), plans))


def _picture(path: Path, plans: int) -> Picture:
    if path.suffix == ".mcap":
        return picture_of_run(read_log(path), plans)
    from ntagen.drive.configure import configure
    from ntagen.nsl import load_task

    task = load_task(path)
    if plans == 0:
        return picture_of_plans(task.scene, None, 0)
    settings = configure(task.given, task.scene).settings
    return picture_with_plans(task.scene, engine_for(settings), plans)


def picture_with_plans(scene: Scene, engine: EngineSynthesiser, shown: int) -> Picture:
    """The picture of a scene with at most `shown` plans, which are looked for first.

    Raises:
        LimitError: The engine reached a limit.
    """
    from ntagen.plan.anytime import synthesis_within
    from ntagen.plan.best_plan import MOST_WHEN_NARROW, BestPlanSynthesiser, sequences

    if scene.breath is not None:
        # Waits make too many plans for a list. The best one is asked for, as in drives.
        return picture_of_plans(scene, BestPlanSynthesiser(engine)(scene), shown)
    if sequences(scene) <= MOST_WHEN_NARROW:
        # All plans are listed, since some are to be shown beside the best one.
        return picture_of_plans(scene, engine(scene), shown)
    synthesis = synthesis_within(
        scene, engine, clock=time.monotonic, count=shown, budget_s=_BUDGET_S
    )
    return picture_of_plans(scene, synthesis, shown)
