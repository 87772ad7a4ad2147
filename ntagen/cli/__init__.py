"""The command line: one module a command, and the only place that prints or exits.

Commands on models are in ``models``, which knows no needle, those on tasks and needles in
``needle``; what both use, and the commands for both, are here. The module of a command has a click
command called ``command``. It is imported only when the command runs, so that ``ntagen --help``
does not wait for libraries. A command returns its exit code (nothing means 0). If it raises an
error, this module prints one message.

Exit codes: 0 done (`check`: every query satisfied), 1 a query is not satisfied (`verify`, `report`:
the evidence does not hold), 2 the input or the command line is wrong, 3 stopped by a limit, 4
run-time error in the model, 5 device fault, 70 internal error, 130 interrupted, 141 nobody reads
the output any more, 143 ended by SIGTERM.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import io
import os
import re
import signal
import sys
from collections.abc import Sequence
from typing import Final, NoReturn

import click

from ntagen.cli.signals import INTERRUPTED, TERMINATED, LimitReached, Terminated, ending
from ntagen.cli.terminal import echo, echo_message
from ntagen.errors import InputError, LimitError, NtagenError
from ntagen.version import VERSION

__all__ = ["main", "verifyta"]

COMMANDS: Final = {
    "compile": ("needle.compile", "Turn an environment into a UPPAAL model and its queries."),
    "check": ("check", "Answer the queries of a model or an environment."),
    "plan": ("needle.plan", "Find the best plans of a task within a budget of time."),
    "verify": ("models.verify", "Check a trace, certificate or strategy independently."),
    "play": ("models.play", "Play a timed game against a strategy."),
    "convert": ("models.convert", "Turn a model into the format of another tool."),
    "info": ("models.info", "Show what is in a model or an environment."),
    "test": ("models.test", "Make a test suite of a model: traces that cover it."),
    "mutate": ("models.mutate", "Make mutants of a model, and tell what kills them."),
    "explain": ("explain", "Explain a diagnostic: what it means and how to fix it."),
    "plot": ("plot", "Draw a scene, its plans, a run or a model."),
    "serve": ("serve", "Show models, tasks and runs on a page in the browser."),
    "drive": ("needle.drive", "Steer a needle to the target and log the run."),
    "ros": ("needle.ros", "Steer a needle as a node of ROS 2."),
    "experiment": ("needle.experiment", "Drive many simulated runs, and make a table of them."),
    "sweep": ("needle.sweep", "Show how much of an error a task stands."),
    "policies": ("needle.policies", "Show what policies gain over plans, task by task."),
    "calibrate": ("needle.calibrate", "Find where a scene lies for a tracker, by pairs of points."),
    "device": ("needle.device", "Try a device before it drives a needle."),
    "match": ("needle.match", "Find the actions that explain measured traces of the tip."),
    "replay": ("needle.replay", "Repeat the decisions of a logged run and compare them."),
    "report": ("needle.run_report", "Make a page of a logged run, for a lab notebook."),
    "verifyta": ("models.verifyta", "Stand in for UPPAAL's verifyta: its options, output, files."),
    "fmt": ("needle.fmt", "Format environments and textual models."),
    "lsp": ("needle.lsp", "Answer an editor about environments and models."),
}
"""The commands in the order of the help, each with its module below here and its line there."""

HIDDEN: Final = {"simulate": "models.simulate", "survey": "models.survey"}
"""The commands that only other parts of this program run, each with its module."""

INTERNAL_ERROR: Final = 70
PIPE_CLOSED: Final = 141
"""The code that a shell gives a program that SIGPIPE ends."""

_OBJECTS_BETWEEN_COLLECTIONS: Final = 50_000
"""Modules, models and plans are many objects, none of them garbage. At Python's usual number, 700,
looking for garbage takes a tenth of the time until the first plan."""

_BLAS_THREADS: Final = ("OPENBLAS_NUM_THREADS", "1")
"""NumPy's matrices are small here. A second thread for them is never faster; it waits busily, and
takes a processor from the engine and from other runs. Whoever sets the variable has the last word.
"""

DEBUG_VARIABLE: Final = "NTAGEN_DEBUG"
"""If it is set to anything but 0, an error also prints where in the program it came from."""


class _CommandTable(click.Group):
    """The commands of `COMMANDS`. Each is imported when it is used."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        module = COMMANDS[cmd_name][0] if cmd_name in COMMANDS else HIDDEN.get(cmd_name)
        if module is None:
            return None
        command: click.Command = importlib.import_module(f"{__name__}.{module}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, line) for name, (_, line) in COMMANDS.items()])


def _show_version(ctx: click.Context, _option: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing:
        echo(f"ntagen {VERSION}")
        ctx.exit()


@click.group(cls=_CommandTable, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_show_version,
    help="Show the version and exit.",
)
def _ntagen() -> None:
    """Turn a needle-steering task into a verified strategy, and steer the needle with it.

    The engine behind it also answers the queries of any UPPAAL model.

    \b
    Examples:
      ntagen compile examples/paper.nsl -o demo
      ntagen check examples/paper.nsl
      ntagen check model.xml --query "E<> Gate.Open" --trace -
      ntagen info model.xml
      ntagen drive examples/paper.nsl --log run.mcap

    `ntagen COMMAND --help` describes a command and its options.
    """  # noqa: D301  click wants the control character


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command line. Prints errors to standard error.

    Args:
        arguments: The words after the program's name; by default those of this process.

    Returns:
        The exit code.
    """
    gc.set_threshold(_OBJECTS_BETWEEN_COLLECTIONS)
    os.environ.setdefault(*_BLAS_THREADS)
    for stream in (sys.stdout, sys.stderr):
        # A pipe on Windows has few characters; the others are shown by their numbers.
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="backslashreplace")
    with ending(_leave) as ended:
        try:
            code = _run(list(sys.argv[1:] if arguments is None else arguments))
            sys.stdout.flush()
        except SystemExit:
            raise
        except BaseException as error:  # also KeyboardInterrupt and panics of the engine
            code = _report(error)
    if arguments is None and ended.came == signal.SIGINT:
        # Nothing is left to do but to end, which takes a moment.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    # What is interrupted, or ends with what it has until then, was ended by the signal.
    is_ended = code in (INTERRUPTED, LimitError.exit_code)
    return TERMINATED if ended.came == signal.SIGTERM and is_ended else code


def _leave(code: int) -> NoReturn:
    """Ends the program at once: the user has asked for its end a second time."""
    from ntagen.files import abandon

    abandon()
    # Whatever writes to standard error now is interrupted itself.
    with contextlib.suppress(OSError):
        os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, b"interrupted\n")
    os._exit(code)


def verifyta() -> int:
    """The program ``verifyta-ntagen``: ``ntagen verifyta`` by a name without a blank.

    Returns:
        The exit code.
    """
    return main(["verifyta", *sys.argv[1:]])


def _run(arguments: list[str]) -> int:
    """Runs a command line; returns its exit code. Errors are not caught."""
    completion = os.environ.get("_NTAGEN_COMPLETE")
    if completion:
        from click.shell_completion import shell_complete

        return shell_complete(_ntagen, {}, "ntagen", "_NTAGEN_COMPLETE", completion)
    try:
        with _ntagen.make_context("ntagen", arguments) as context:
            result = _ntagen.invoke(context)
    except click.exceptions.Exit as end:
        return end.exit_code
    return result if isinstance(result, int) else 0


def _report(error: BaseException) -> int:
    """Says what went wrong, in a message for the user; returns the exit code."""
    if os.environ.get(DEBUG_VARIABLE, "0") not in ("", "0"):
        import traceback

        _say("".join(traceback.format_exception(error)).rstrip())
    match error:
        case click.ClickException():
            with contextlib.suppress(OSError):
                error.show()
            return InputError.exit_code
        case NtagenError():
            _say(with_severity(str(error)))
            return error.exit_code
        case LimitReached():
            _say(f"error: {error}")
            return LimitError.exit_code
        case Terminated():
            _say("terminated")
            return INTERRUPTED
        case KeyboardInterrupt() | EOFError() | click.Abort():
            _say("interrupted")
            return INTERRUPTED
        case BrokenPipeError() if error.filename is None:
            # As in `ntagen … | head -1`: the reader has what it wants.
            _abandon_output()
            return PIPE_CLOSED
        case OSError():
            _abandon_output()
            _say(with_severity(_describe(error)))
            return InputError.exit_code
        case ImportError():
            _say(
                f"error: ntagen is not installed completely: {error}\n"
                "hint: install it again; in a copy of its sources, run `make setup`"
            )
            return INTERNAL_ERROR
        case _:
            _say(_internal(error))
            return INTERNAL_ERROR


def with_severity(message: str) -> str:
    """Puts "error: " before a message, unless its first line has the word already."""
    first_line = message.partition("\n")[0]
    return message if re.search(r"\berror\b", first_line) else f"error: {message}"


def _describe(error: OSError) -> str:
    """The message of the operating system, after the name of the file if there is one."""
    reason = (error.strerror or str(error) or type(error).__name__).lower()
    # For a file that is already open, the name is a number.
    named = isinstance(error.filename, str | bytes | os.PathLike) and error.filename
    return f"{os.fsdecode(named)}: {reason}" if named else reason


def _internal(error: BaseException) -> str:
    """The message about a bug of ntagen."""
    name = type(error).__name__
    said = " ".join(str(error).split())
    return (
        f"internal error: {name}: {said}\n"
        "This is a bug in ntagen, not a mistake in your input. Please report it together with the\n"
        f"command line, the input and what is printed when you set {DEBUG_VARIABLE}=1."
    )


def _say(message: str) -> None:
    """Prints to standard error, unless it is closed."""
    with contextlib.suppress(OSError):
        echo_message(message)


def _abandon_output() -> None:
    """Discards the rest of the standard output, so that Python exits without a message."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
