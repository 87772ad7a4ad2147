"""What `ntagen check` says about an environment whose tissue answers."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from ntagen.cli.terminal import echo
from ntagen.files import write_files

if TYPE_CHECKING:
    from ntagen.checker import Answer, Options
    from ntagen.nsl import Task


def is_adversarial(task: Task | None) -> bool:
    """Whether it is an environment with such a tissue."""
    return task is not None and task.scene.tissue.is_adversarial


def defence_notes(answer: Answer, task: Task, options: Options, target: str | None) -> list[str]:
    """What holds for the strategy on all its branches; writes it as a tree if that is wanted.

    Args:
        answer: The answer of the engine to the query for a strategy.
        task: The environment.
        options: The limits.
        target: The file for the tree, or ``-`` for standard output.
    """
    from ntagen.drive.trees import document_of
    from ntagen.plan.against_tissue import defend

    if answer.verdict != "satisfied":
        return []
    found = defend(
        task.scene,
        timeout_s=options.timeout_s,
        memory_bytes=options.memory_bytes,
        verify=options.verify,
    )
    notes = list(found.guarantee())
    if found.tree is None:
        why = f" ({found.stop})" if found.stop else ""
        notes.append(f"no strategy that holds in exact kinematics was found{why}")
    elif target is not None:
        text = json.dumps(document_of(found))
        if target == "-":
            echo(text)
        else:
            write_files({Path(target): text + "\n"})
            notes.append(f"strategy with {found.tree.leaves} branches written to {target}")
    return notes
