"""`ntagen lsp`: the language server for environments, models and queries."""

from __future__ import annotations

import click

from ntagen.errors import InputError


@click.command("lsp")
@click.option(
    "--stdio",
    is_flag=True,
    expose_value=False,
    help="Talk over standard input and output. It is the only way; some editors write this option.",
)
def command() -> None:
    """Answer an editor over standard input and output.

    It knows environments (.nsl), models (.xta, .ta, and .xml of UPPAAL) and queries (.q, those of
    the model with the same name beside it). Editors start it; docs/editors.md says how to set up
    two of them. It speaks the language server protocol: mistakes while you type, what words mean,
    completion, declarations and uses of names, renaming, layout, and answers of queries.

    \b
    Example (an editor writes it):
      ntagen lsp --stdio
    """  # noqa: D301  click wants the control character
    try:
        from ntagen.editor.server import make_server
    except ModuleNotFoundError as error:
        raise InputError(
            f"the language server needs the package {error.name}, which is not installed\n"
            "hint: pip install 'ntagen[editor]'"
        ) from None
    make_server().start_io()
