"""What `ntagen check` says about an environment whose tissue answers."""

from __future__ import annotations

import copy
import json
from pathlib import Path
from typing import TYPE_CHECKING

from ntagen.cli.terminal import echo
from ntagen.files import write_files

if TYPE_CHECKING:
    from ntagen.checker import Answer, Options
    from ntagen.nsl import Task
    from ntagen.plan.against_tissue import Defence


def is_adversarial(task: Task | None) -> bool:
    """Whether it is an environment with such a tissue."""
    return task is not None and task.scene.tissue.is_adversarial


def defended(task: Task, options: Options) -> Defence:
    """The answer to the question for a strategy against the environment's tissue.

    Args:
        task: The environment.
        options: The limits, and how the engine is to answer.
    """
    from ntagen.plan.against_tissue import defend

    return defend(
        task.scene,
        timeout_s=options.timeout_s,
        memory_bytes=options.memory_bytes,
        verify=options.verify,
        options=options,
    )


def answer_of(found: Defence) -> Answer:
    """The answer of the engine, with the verdict and the counts of all plays."""
    answer = copy.copy(found.answer)
    answer.verdict, answer.stop = found.verdict, found.stop
    answer.seconds, answer.explored, answer.stored = found.seconds, found.explored, found.stored
    return answer


def defence_notes(found: Defence, target: str | None) -> list[str]:
    """What holds for the strategy on all its branches; writes it as a tree if that is wanted.

    Args:
        found: The answer.
        target: The file for the tree, or ``-`` for standard output.
    """
    from ntagen.drive.trees import document_of

    notes = list(found.guarantee())
    if not found.holds or found.tree is None:
        return notes
    if target is not None:
        text = json.dumps(document_of(found))
        if target == "-":
            echo(text)
        else:
            write_files({Path(target): text + "\n"})
            notes.append(f"strategy with {found.tree.leaves} branches written to {target}")
    return notes
