"""The queries of a model: the two of the paper, then those of the scene."""

from __future__ import annotations

from typing import Final

from ntagen import rules
from ntagen.errors import InputError
from ntagen.render.chance import has_unsafe
from ntagen.scene import Scene, require
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Query:
    """A query as it is written to the files.

    Attributes:
        name: Its name for `ntagen check --query`.
        formula: Its text in UPPAAL's language.
        comment: The name in the first line, then an explanation, if there is one.
    """

    name: str
    formula: str
    comment: str


PAPER_QUERIES: Final = (
    Query(
        "PathExists",
        rules.PAPER_QUERIES["PathExists"],
        "PathExists\nIs there any path to the final target?",
    ),
    Query(
        "ReachFinalTR",
        f"strategy ReachFinalTR = {rules.PAPER_QUERIES['ReachFinalTR']}",
        "ReachFinalTR\nIs there a strategy that reaches it, whatever the tissue does?",
    ),
)
"""The queries of section 2 of the paper."""


def model_queries(scene: Scene) -> tuple[Query, ...]:
    """The queries of a scene's model, in order.

    A game query (``control: …``) of the scene defines a strategy with the name of the query. A
    query of the scene that repeats one of the paper's is left out.

    Raises:
        InputError: Two queries have the same name.
    """
    # Where the tissue answers, that it might help is no question. Where regions move, the second
    # query asks the same. A search through all that may happen then takes minutes.
    is_long = scene.tissue.is_adversarial or scene.breath is not None
    papers = PAPER_QUERIES[1:] if is_long else PAPER_QUERIES
    queries = {query.name: query for query in (*papers, *_chance_queries(scene))}
    for named in scene.queries:
        require(rules.query(named.name, named.text))
        text = " ".join(named.text.split())
        formula = f"strategy {named.name} = {text}" if text.startswith("control") else text
        query = queries.setdefault(named.name, Query(named.name, formula, named.name))
        if query.formula != formula:
            raise InputError(
                f"there are two queries with the name {named.name}\nhint: rename the query `{text}`"
            )
    return tuple(queries.values())


MOST_RUNS: Final = 2000
"""How many runs give the expected clearance under a strategy."""


def _chance_queries(scene: Scene) -> tuple[Query, ...]:
    """What is asked about the strategy in a tissue with chance."""
    if not scene.tissue.is_stochastic:
        return ()
    push_mm = scene.needle.speed_mm_per_s * scene.limits.step_s
    dt, _, _ = rules.time_units(scene.limits.step_s, scene.needle.speed_mm_per_s)
    # The push that inserts too much is made; the check after it ends the path.
    most_time = dt * (int(scene.needle.length_mm / push_mm) + 2)
    return tuple(
        Query(one.name, f"{one.formula} under ReachFinalTR", one.comment)
        for one in questions(scene, most_time, "Checker.Final_TR_Reached", MOST_RUNS)
    )


def plan_queries(scene: Scene, push_count: int, runs: int) -> tuple[Query, ...]:
    """The questions about a plan with this number of pushes."""
    dt, _, _ = rules.time_units(scene.limits.step_s, scene.needle.speed_mm_per_s)
    return questions(scene, dt * (push_count + 1), "Insertion.Done", runs)


def questions(scene: Scene, most_time: int, end: str, runs: int) -> tuple[Query, ...]:
    """The questions about what is done in a tissue with chance.

    Without critical and unexplored regions, nothing can be touched: then there is only the first.

    Args:
        scene: The scene.
        most_time: It ends before this time.
        end: The location in which it ends.
        runs: The number of runs that give a mean.
    """
    reach = f"Pr[<={most_time}](<> {end} && tip_miss <= 0"
    if not has_unsafe(scene):
        return (
            Query(
                "ReachProbability",
                f"{reach})",
                "ReachProbability\nHow likely does the true tip reach the target?",
            ),
        )
    return (
        Query(
            "ReachProbability",
            f"{reach} && tip_clearance > 0)",
            "ReachProbability\nHow likely does the true tip reach the target, and touch nothing?",
        ),
        Query(
            "TouchProbability",
            f"Pr[<={most_time}](<> tip_clearance <= 0)",
            "TouchProbability\nHow likely does it touch a critical region?",
        ),
        Query(
            "ExpectedClearance",
            f"E[<={most_time}; {runs}](min: tip_clearance)",
            "ExpectedClearance\nHow near does it come to one in the mean, in mm?",
        ),
    )


def render_queries(scene: Scene) -> str:
    """The queries of a scene's model as a ``.q`` file: a comment and one line each."""
    blocks = []
    for query in model_queries(scene):
        comment = "\n".join(f"// {line}" for line in query.comment.splitlines())
        blocks.append(f"{comment}\n{query.formula}\n")
    return "\n".join(blocks)
