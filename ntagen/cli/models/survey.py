"""`ntagen survey`: the worker behind the editor of `ntagen serve`, which starts it.

It is in no list of commands: people use the page or the language server.
"""

from __future__ import annotations

import json
import sys

import click

from ntagen.cli.terminal import echo


@click.command("survey", hidden=True)
@click.argument("name")
def command(name: str) -> None:
    """Look at the texts of a model called NAME: a line of JSON each, in and out."""
    from ntagen.checker.survey import Texts, survey_json

    for line in iter(sys.stdin.readline, ""):
        words = survey_json(Texts(name, json.loads(line)["text"]))
        echo(words)
