"""`ntagen test`: makes a test suite of a model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.guard import doing
from ntagen.cli.loading import load_model, pointing_to_explanations
from ntagen.cli.models.suite_files import code_files, template_files
from ntagen.cli.options import (
    LIMITS,
    Decorator,
    constant_option,
    gathered,
    include_option,
    output_option,
    overflow_rule,
    path_argument,
    path_option,
)
from ntagen.cli.quantities import duration
from ntagen.cli.terminal import echo, print_table, say, say_idle
from ntagen.errors import LimitError
from ntagen.files import require_apart, write_files

if TYPE_CHECKING:
    from ntagen.files import Content
    from ntagen.suites import Limits, Suite

KINDS_SHOWN: Final = ("locations", "edges", "queries")
_DEFAULT: Final = ("locations", "edges")


def _limits(**values: Any) -> Limits:  # noqa: ANN401  click's values
    from ntagen.suites import Limits

    return Limits(**values)


def search_limits() -> Decorator:
    """The options of the limits of each search, gathered as ``limits``."""
    timeout = click.option(
        "--timeout",
        "timeout_s",
        metavar="TIME",
        type=duration,
        help="Stop each search after this time, for example 60s or 2min; a number without a unit "
        "is in seconds.  [default: no limit]",
    )
    options = {"states": LIMITS["states"], "memory_bytes": LIMITS["memory_bytes"]}
    return gathered("limits", {**options, "timeout_s": timeout}, _limits)


@click.command(
    "test",
    epilog="Exit codes: 0 every goal is covered or proven unreachable, 2 the input is rejected, "
    "3 a limit came before some goal was decided, 4 run-time error in the model.",
)
@path_argument("path", metavar="MODEL")
@click.option(
    "--cover",
    "kinds",
    type=click.Choice(KINDS_SHOWN),
    multiple=True,
    help="What the tests cover: locations, edges, or queries (their witnesses and "
    "counterexamples). You can give this option several times.  [default: locations and edges]",
)
@click.option(
    "--each-process",
    is_flag=True,
    help="Cover the locations and edges of a template in each of its processes, not just in one.",
)
@output_option("FILE.json|-", "Write the suite: its tests with exact times, and all goals.")
@path_option(
    "--template",
    metavar="FILE.jinja",
    help="Write tests by this template (Jinja).",
)
@click.option(
    "--name",
    metavar="NAME",
    help="The name of the file that --template makes; with {} in it there is a file for each test, "
    "and {} is the name of the test.  [default: that of the template without .jinja]",
)
@path_option(
    "--folder",
    metavar="DIR",
    default=Path(),
    help="Where files of tests are written.  [default: the current folder]",
)
@constant_option()
@include_option()
@overflow_rule()
@search_limits()
def command(
    path: Path,
    kinds: tuple[Any, ...],
    each_process: bool,
    output: Path | None,
    template: Path | None,
    name: str | None,
    folder: Path,
    constants: dict[str, str],
    include: tuple[Path, ...],
    overflow: Any,  # noqa: ANN401  click gives a str where the engine wants literals
    limits: Limits,
) -> int:
    """Make a test suite of a model: a small set of traces that cover it.

    MODEL is an environment (.nsl) or a UPPAAL model in XML.

    For each location, edge or query that no test covers yet, the engine looks for a trace with the
    fewest steps; of all these traces only those are kept that are needed. Each trace has exact
    times, and has been replayed independently of the search. What cannot be reached is told as
    such: the engine has then searched all states.

    Test code in the model, as UPPAAL's test generator reads it (testcodeEnter, testcodeExit,
    testcode, TEST_PREFIX, TEST_POSTFIX, TEST_FILENAME, TEST_FILEEXT), is written to a file for each
    test. With --template, your template writes the files instead.

    \b
    Examples:
      ntagen test model.xml
      ntagen test model.xml --cover edges --cover queries -o suite.json
      ntagen test examples/tests/vending.xml --template examples/tests/test_vending.py.jinja
      ntagen test model.xml --template case.py.jinja --name "{}.py" --folder generated
    """  # noqa: D301  click wants the control character
    if template is None:
        say_idle({"name": "--name"}, "without --template")
    inputs = {"model": path} | ({"template": template} if template else {})
    require_apart({"--output": output}, inputs)
    from ntagen.suites import cover, harness_of, suite_json
    from ntagen.suites.layout import layout_of

    with pointing_to_explanations(True):
        with doing("loading the model"):
            model = load_model(path, include, overflow, constants).model
        harness = harness_of(layout_of(model))
        suite = cover(
            model,
            kinds or _DEFAULT,
            name=path.name,
            each_process=each_process,
            limits=limits,
            constants=constants,
        )
    files: dict[str, str] = {}
    if template is not None:
        files = template_files(suite, harness, template, name)
    elif harness:
        files = code_files(suite, harness)
    contents: dict[Path, Content] = {folder / name: text for name, text in files.items()}
    require_apart({f"--folder {folder}:": one for one in contents}, inputs)
    if output is not None and str(output) != "-":
        contents[output] = suite_json(suite)
    write_files(contents)
    if output is not None and str(output) == "-":
        echo(suite_json(suite), nl=False)
    else:
        _show(suite)
    say([f"wrote {one}" for one in contents])
    return LimitError.exit_code if suite.count("unknown") else 0


def _show(suite: Suite) -> None:
    """Prints the tests, how much they cover, and what they do not cover."""
    from ntagen.suites.rendering import number

    rows = [
        [case.name, str(len(case.steps)), number(case.duration), case.goal] for case in suite.tests
    ]
    if rows:
        print_table(["test", "steps", "time", "made for"], rows, ("steps", "time"))
    for kind in KINDS_SHOWN:
        goals = [one for one in suite.goals if one.goal.kind == kind]
        if goals:
            covered = sum(one.verdict == "covered" for one in goals)
            echo(f"{kind}: {covered} of {len(goals)} covered")
            for one in goals:
                if one.verdict != "covered":
                    echo(f"  {one.verdict}: {one.goal.name} ({one.reason})")
