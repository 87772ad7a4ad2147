"""The option ``--policy``: agents of others as strategies that queries are asked under."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from ntagen.errors import InputError
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.checker import Model, QueryForm
    from ntagen.cli.options import Decorator

_FORM: Final = re.compile(r"([A-Za-z_]\w*)=([A-Za-z_]\w*):(.+)", re.ASCII)


@dataclass(frozen=True, slots=True)
class NamedAgent:
    """An agent in a file, and the name that queries call it by."""

    name: str
    algorithm: str
    path: Path


def _agents(_: click.Context, __: click.Parameter, values: Sequence[str]) -> tuple[NamedAgent, ...]:
    agents: dict[str, NamedAgent] = {}
    for value in values:
        parts = _FORM.fullmatch(value)
        if parts is None:
            raise click.BadParameter(
                f"{value!r} is no policy; write NAME=ALGORITHM:FILE, such as Agent=PPO:agent.zip"
            )
        name, algorithm, path = parts.groups()
        if name in agents:
            raise click.BadParameter(f"two policies have the name {name}")
        agents[name] = NamedAgent(name, algorithm, Path(path))
    return tuple(agents.values())


def policy_option() -> Decorator:
    """Adds ``--policy``; the command gets the agents as `policies`."""
    return click.option(
        "--policy",
        "policies",
        metavar="NAME=ALGORITHM:FILE.zip",
        multiple=True,
        callback=_agents,
        help="An agent of stable-baselines3 that was trained in ntagen.gymnasium.Environment of "
        "this model, such as Agent=PPO:agent.zip: Pr, E and simulate can be asked `under Agent`. "
        "Loading an agent runs code of its file, so name only files that you trust. You can give "
        "this option several times.",
    )


def follow_agents(
    model: Model, agents: Sequence[NamedAgent], queries: Sequence[QueryForm]
) -> list[str]:
    """Makes agents available to queries; returns a note for each that no query is asked under.

    Raises:
        InputError: An agent cannot be loaded, is for another model, or has the name of a strategy
            that a query defines.
        OSError: A file cannot be read.
    """
    if not agents:
        return []
    from ntagen.checker.agents import load_agent

    defined = {query.defines for query in queries}
    used = {query.uses for query in queries}
    notes = []
    for agent in agents:
        if agent.name in defined:
            raise InputError(
                f"a query defines the strategy {agent.name}, and so does --policy\n"
                "hint: give the policy another name"
            )
        if agent.name not in used:
            notes.append(f"--policy {agent.name} has no effect here: no query is under it")
        model.follow(agent.name, load_agent(agent.algorithm, agent.path))
    return notes
