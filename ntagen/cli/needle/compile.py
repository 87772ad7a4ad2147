"""`ntagen compile`: turns an environment into a UPPAAL model and its queries."""

from __future__ import annotations

from pathlib import Path

import click

from ntagen.cli.loading import show_warnings
from ntagen.cli.options import include_option, output_option, path_argument
from ntagen.cli.terminal import echo
from ntagen.files import write_files


@click.command(
    "compile",
    epilog="Exit codes: 0 written, 2 the environment or the folder is wrong.",
)
@path_argument("environment", metavar="ENV.nsl")
@output_option(
    "DIR",
    "The folder to write to; it is made if it does not exist.  [default: the current folder]",
    "folder",
    default=".",
)
@include_option()
def command(environment: Path, folder: Path, include: tuple[Path, ...]) -> None:
    """Turn an environment into a UPPAAL model and its queries.

    Writes DIR/ENV.xml, which UPPAAL 4.1 and 5 open, and DIR/ENV.q with the same queries. If
    something is wrong, neither file is written.

    \b
    Example:
      ntagen compile examples/paper.nsl -o demo
    """  # noqa: D301  click wants the control character
    from ntagen.nsl import load_with_warnings
    from ntagen.render import render, render_queries

    scene, warnings = load_with_warnings(environment, include=include)
    show_warnings([warning.render() for warning in warnings])
    name = environment.stem or environment.name
    model = folder / f"{name}.xml"
    queries = folder / f"{name}.q"
    write_files({model: render(scene, source=environment.name), queries: render_queries(scene)})
    echo(f"wrote {model} and {queries}")
