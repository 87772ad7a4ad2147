"""Draws the sections of the report beside the runs.

A section takes as long to draw as a run or two to make, and depends on the runs of its row only.
So it is drawn in a thread as soon as they are complete, while the workers make those of other rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace

from ntagen.experiment.description import Experiment, Row
from ntagen.experiment.record import Run
from ntagen.experiment.report import section_of
from ntagen.experiment.table import document_of
from ntagen.scene import Scene


class Sections:
    """The sections of some rows; use it as a context manager.

    Args:
        experiment: The rows.
        scenes: The scene of each row, by the name of the row.
    """

    def __init__(self, experiment: Experiment, scenes: Mapping[str, Scene]) -> None:
        self._experiment = experiment
        self._scenes = scenes
        self._pool = ThreadPoolExecutor(1)
        self._drawn: dict[str, Future[str]] = {}

    def __enter__(self) -> Sections:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def draw(self, name: str, runs: Mapping[tuple[str, int], Run]) -> None:
        """Begins to draw the section of a row.

        Args:
            name: The row.
            runs: All its runs, and perhaps those of other rows.
        """
        row = next(row for row in self._experiment.rows if row.id == name)
        own = {(name, seed): runs[name, seed] for seed in row.seeds}
        self._drawn[name] = self._pool.submit(self._draw, row, own)

    def texts(self) -> dict[str, str]:
        """The sections, by the name of the row; waits until they are drawn."""
        return {name: future.result() for name, future in self._drawn.items()}

    def _draw(self, row: Row, runs: Mapping[tuple[str, int], Run]) -> str:
        document = document_of(replace(self._experiment, rows=(row,)), runs)
        return section_of(document, row.id, self._scenes[row.id])
