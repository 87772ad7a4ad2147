"""`ntagen simulate`: the worker behind the simulator of `ntagen serve`, which starts it.

It is in no list of commands: people use the page, and programs `ntagen.Model`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import click

from ntagen.cli.loading import load_model
from ntagen.cli.options import path_argument
from ntagen.cli.quantities import duration, size
from ntagen.cli.terminal import echo


@click.command("simulate", hidden=True)
@path_argument("model_path", metavar="MODEL")
@click.option("--timeout", "timeout_s", type=duration, help="For a synthesis or random runs.")
@click.option("--memory", "memory_bytes", type=size, help="For a synthesis.")
def command(model_path: Path, timeout_s: float | None, memory_bytes: int | None) -> None:
    """Answer requests about a simulation of MODEL: lines of JSON, in and out."""
    from ntagen.simulator.session import Session
    from ntagen.simulator.worker import work

    def begin() -> Session:
        model = load_model(model_path, ()).model
        return Session(model, timeout_s=timeout_s, memory_bytes=memory_bytes)

    work(begin, iter(sys.stdin.readline, ""), echo)
