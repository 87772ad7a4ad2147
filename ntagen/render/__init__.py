"""Writes the UPPAAL model of a scene, and its queries.

`render` writes the whole XML document, `render_queries` the same queries as a ``.q`` file. Both
depend on the scene alone: the same scene gives the same text, byte for byte.

The templates in ``templates/`` have the automata and the arithmetic in UPPAAL's language, and
`ntagen.render.values` computes every number. templates/README.md lists where the model differs from
the paper.
"""

from __future__ import annotations

from collections.abc import Sequence

from ntagen.errors import InputError
from ntagen.render.chance import Around, Seen
from ntagen.render.queries import model_queries, plan_queries, render_queries
from ntagen.render.values import model_values
from ntagen.scene import Scene

__all__ = ["Around", "Seen", "render", "render_plan", "render_policy", "render_queries"]


def render(scene: Scene, source: str | None = None, *, only_plans: bool = False) -> str:
    """The timed-game model of a scene as UPPAAL's XML.

    Args:
        scene: The scene.
        source: The file of the scene, for the comment at the top of the declaration.
        only_plans: Whether the model gives up paths on a circle that passes by the target with no
            roll left. Whether there is a strategy, and all plans, are the same, and are found in
            half the time; what else may be asked about the model is not.

    Returns:
        The XML document; its queries are those of `render_queries`.

    Raises:
        InputError: A value of the scene does not fit the model's numbers.
    """
    # Jinja takes a third of the time in which a command starts, and few need it.
    from ntagen.render.documents import model_document

    values = model_values(scene, only_plans=only_plans)
    name = None if source is None else " ".join(source.split())
    return model_document(values, name, model_queries(scene))


def render_plan(scene: Scene, plan: Sequence[int], runs: int) -> str:
    """The model of one plan in a tissue with chance, as UPPAAL's XML.

    What is planned is done, whatever comes: nothing is decided, so only statistical queries make
    sense.

    Args:
        scene: The scene, with a stochastic tissue.
        plan: What is done one after the other: 0 is a push, else a roll by that number of degrees.
        runs: The number of runs that give the expected clearance.

    Returns:
        The XML document; its queries are `ntagen.render.queries.questions`.

    Raises:
        InputError: The tissue is another one, or a value does not fit the model's numbers.
    """
    if not scene.tissue.is_stochastic:
        raise InputError("the tissue has no chance\nhint: write `tissue stochastic`")
    from ntagen.render.documents import plan_document

    values = model_values(scene, plan=plan)
    return plan_document(values, plan_queries(scene, plan.count(0), runs))


def render_policy(scene: Scene, around: Around) -> str:
    """The model in which a policy is learned: the tip is seen, and what is done depends on it.

    Args:
        scene: The scene, with a stochastic tissue and one target.
        around: A plan, and how far the policy may deviate from it.

    Returns:
        The XML document, without queries.

    Raises:
        InputError: The tissue is another one, there are several targets, the plan has no roll, or
            a value does not fit the model's numbers.
    """
    if not scene.tissue.is_stochastic:
        raise InputError("the tissue has no chance\nhint: write `tissue stochastic`")
    if len(scene.targets) != 1:
        raise InputError(
            f"a policy is for one target, and the task has {len(scene.targets)}\n"
            "hint: leave out the others"
        )
    if not around.rolls:
        raise InputError(
            "the plan has no roll, so there is nothing that a policy could decide\n"
            "hint: drive without a policy"
        )
    from ntagen.render.documents import policy_document

    return policy_document(model_values(scene, plan=around.actions, around=around))
