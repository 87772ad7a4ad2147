"""`ntagen serve`: models, environments and runs in the browser, on this computer only."""

from __future__ import annotations

import os
from pathlib import Path

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.options import path_argument
from ntagen.cli.quantities import duration, size
from ntagen.cli.terminal import echo
from ntagen.files import read_file


@click.command(
    "serve",
    cls=Renamed,
    former={"--open": "open the address that is printed"},
    epilog="Exit codes: 2 the port or a file is wrong, 130 ended by Ctrl-C.",
)
@path_argument("file", required=False)
@click.option(
    "--port",
    metavar="PORT",
    type=click.IntRange(0, 65535),
    default=0,
    help="The port to listen on.  [default: any that is free]",
)
@click.option(
    "--timeout",
    "timeout_s",
    metavar="TIME",
    type=duration,
    default="60s",
    show_default=True,
    help="Stop what is asked for after this time, with reading and drawing.",
)
@click.option(
    "--memory",
    "memory_bytes",
    metavar="SIZE",
    type=size,
    default="1GiB",
    show_default=True,
    help="Stop what takes this much memory.",
)
@click.option(
    "--upload",
    "upload_bytes",
    metavar="SIZE",
    type=size,
    default="32MiB",
    show_default=True,
    help="Refuse files that are larger.",
)
def command(
    file: Path | None,
    port: int,
    timeout_s: float,
    memory_bytes: int,
    upload_bytes: int,
) -> None:
    """Show models, environments and runs in the browser: verdicts, traces, pictures, simulations.

    It prints an address. Open it, and drop a model (.xml, .xta), an environment (.nsl) or the log
    of a run (.mcap) on the page. FILE is shown at once. Only this computer gets there, and only
    with the token in the address. Each check is a process of its own, which you can cancel.

    "Simulate" walks through a model step by step: symbolic or with exact times, along a trace, at
    random, or against the strategy of a game. "Edit" changes a model; only its "Save" writes FILE,
    and what was not changed stays byte for byte as it was.

    \b
    Examples:
      ntagen serve
      ntagen serve model.xml
      ntagen serve --port 8080 --timeout 10min --memory 4GiB
    """  # noqa: D301  click wants the control character
    from ntagen.serve.processes import Limits
    from ntagen.serve.server import Server

    limits = Limits(
        timeout_s=timeout_s,
        memory_bytes=memory_bytes,
        upload_bytes=upload_bytes,
        jobs=max(2, os.cpu_count() or 1),
    )
    data = None if file is None else read_file(file, limits.upload_bytes)
    server = Server(limits, port)
    try:
        if file is not None and data is not None:
            server.open(file.name, data, file.absolute())
        echo(f"open {server.address}")
        echo("Ctrl-C ends the server", err=True)
        server.serve()
    finally:
        for name in server.edits.unsaved():
            echo(f"the changes of {name} were not saved", err=True)
        server.end()
