"""`ntagen plot`: draws a scene with its plans, a run, or what a query of a model finds."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.guard import current, doing, guarded
from ntagen.cli.loading import load_task
from ntagen.cli.models.options import LEARNING_SETTINGS
from ntagen.cli.models.plot_learned import MOST_LEAVES, OF_LEARNING
from ntagen.cli.models.plot_models import (
    KINDS,
    MODELS,
    MOST_DRAWN,
    MOST_SEARCHED,
    OF_RUNS,
    OF_SOME,
    RUN_SETTINGS,
    Wish,
    plot_model,
)
from ntagen.cli.options import include_option, limits, output_option, path_argument, path_option
from ntagen.cli.settings import Setting, settings_option
from ntagen.cli.terminal import echo, say_idle
from ntagen.files import open_file, require_apart

if TYPE_CHECKING:
    from ntagen.drive.configure import Configuration
    from ntagen.plot.picture import Picture
    from ntagen.scene import Scene

_MCAP_MAGIC: Final = b"\x89MCAP"
_RANK: Final = "--set 'ranking …'"

SETTINGS: Final = (
    Setting(
        "ranking CRITERION,…",
        click.STRING,
        "Of a scene: how plans are ranked, the most important criterion first: clearance, reserve, "
        "rolls, length, target.  [default: as drive { … } says, else clearance,rolls,length]",
    ),
    Setting(
        "clocks X,Y",
        click.STRING,
        "With --as zones: the clocks of the two axes.  "
        "[default: the first on which decisions depend]",
    ),
    Setting(
        "features X,Y",
        click.STRING,
        "With --as decisions: the features of the two axes, or of one.  "
        "[default: the first on which decisions depend]",
    ),
    Setting(
        "limit N",
        click.IntRange(min=1),
        "With --as states or discrete: draw at most this many states. A graph with more is not "
        f"drawn, and the message says how many it has.  [default: {MOST_DRAWN}; a file that ends "
        f"in .dot may have {MOST_SEARCHED:,}]  With --as tree: at most this many leaves.  "
        f"[default: {MOST_LEAVES}]",
    ),
    *RUN_SETTINGS,
    *LEARNING_SETTINGS,
)
"""What ``--set`` takes."""

_LIMITS: Final = limits(default="none for a model; of an environment, what drive { … } says")


@click.command(
    "plot",
    cls=Renamed,
    epilog="Exit codes: 0 drawn, 2 the input or the name of the picture is wrong, "
    "3 the engine reached a limit; what random runs say until then is drawn.",
)
@path_argument("source", metavar="ENV.nsl|RUN.mcap|MODEL")
@output_option(
    "FILE.png|pdf|svg|html|gif|dot",
    "The picture to write; .html and .gif are for scenes and runs, .dot is for state spaces.  "
    "[default: the source's name with .png, of a model with .svg, in the current folder]",
)
@click.option(
    "--plans",
    "shown",
    metavar="N",
    default=60,
    show_default=True,
    type=click.IntRange(min=0),
    help="Draw at most this many plans. 0 draws the scene alone, without a search for plans.",
)
@path_option(
    "--strategy",
    "tree_path",
    metavar="FILE.json",
    help="In a tissue that answers, draw the strategy in this file, which ntagen check --plans "
    "wrote for this task, and do not look for one.",
)
@click.option(
    "--as",
    "kind",
    type=click.Choice(list(KINDS)),
    help="Of a model: " + "; ".join(f"{kind}: {what}" for kind, what in KINDS.items()) + ".  "
    "[default for a UPPAAL model: runs if the query is Pr, E or simulate, decisions for minE and "
    "its kin, else gantt]",
)
@click.option(
    "--query",
    "asked",
    metavar="TEXT|NAME",
    help="Of a model: the query whose trace, random runs or strategy are drawn.  [default: the "
    "model's only query]",
)
@click.option(
    "--at",
    metavar="STATE",
    help="With --as zones: the state, as locations and values where they differ from the initial "
    "state, for example 'Train(1).Cross n=1'. A clock with a value (x=3/2) is fixed; one without "
    "may have any. With --as decisions or tree: values of what the strategy sees.",
)
@_LIMITS["timeout_s"]
@_LIMITS["memory_bytes"]
@include_option()
@settings_option(SETTINGS, "runs 2000")
@guarded
def command(
    source: Path,
    output: Path | None,
    shown: int,
    tree_path: Path | None,
    kind: str | None,
    asked: str | None,
    at: str | None,
    timeout_s: float | None,
    memory_bytes: int | None,
    include: tuple[Path, ...],
    settings: dict[str, Any],
) -> int:
    """Draw a scene with its plans, a run from its log, or what a query of a model finds.

    The picture shows two projections and a view in space. Targets are green, critical regions red,
    detection regions dashed orange, unexplored ones grey, safe ones dotted. The best plan is blue,
    the others are faint; where the needle spins, it is dashed. In a tissue that answers (tissue
    adversarial), all branches of a strategy against it are drawn instead, the expected one thick.
    For a run, the picture also shows the true path, the measurements and what the driver learned.

    A file that ends in .html is a page for a browser: you turn the scene with the mouse, switch
    regions and paths on and off, and step through the time of a run. It needs no network.

    Of a UPPAAL model (.xml, .xta), and with --as of the model of an environment, it draws the trace
    of a query, what the strategy of a game does over two clocks (--as zones), the templates
    (--as templates), or the states of a small model (--as states). Of a strategy that was learned,
    it draws what is decided (--as decisions, --as tree) and how it was learned (--as learning).
    For Pr and E it draws a histogram and the cumulative distribution with its band, for simulate
    the runs over time. All pictures may end in .svg, .png or .pdf.

    \b
    Examples:
      ntagen plot examples/paper.nsl -o scene.pdf --plans 10
      ntagen plot run.mcap
      ntagen plot run.mcap -o run.html
      ntagen plot run.mcap -o run.gif
      ntagen plot model.xml --query "E<> Gate.Open" -o trace.svg
      ntagen plot model.xml --query "E<> Gate.Open" --as sequence -o trace.svg
      ntagen plot model.xml --query "Pr[<=10](<> Gate.Open)" -o reached.png
      ntagen plot model.xml --query "simulate[<=10; 5]{Gate.Open, x}" -o runs.svg
      ntagen plot game.xml --query "control: A<> P.Won" --as zones --at "P.Middle" -o zones.svg
      ntagen plot model.xml --query "strategy S = minE(cost)[<=9]: <> P.Done" --as decisions
      ntagen plot model.xml --as states --set "limit 300" -o states.pdf
    """  # noqa: D301  click wants the control character
    from ntagen.checker.picture.page import kind_of
    from ntagen.plan.rank import parse_ranking
    from ntagen.plot.save import PAGES, write_picture

    if kind is not None or source.suffix.lower() in MODELS:
        _without_scene()
        wish = Wish(kind, asked, at, settings, memory_bytes)
        path, code = plot_model(source, output, wish, include)
        echo(f"wrote {path}")
        return code
    say_idle(
        {"asked": "--query"} | OF_SOME | OF_LEARNING,
        "without --as: the scene is drawn, not its model",
    )
    say_idle(OF_RUNS, "here: no random runs are drawn")
    ranking = settings.get("ranking")
    criteria = () if ranking is None else parse_ranking(ranking)
    if _is_log(source):
        say_idle({"ranking": _RANK}, "here: the plans of a run were ranked during the run")
        say_idle({"tree_path": "--strategy"}, "here: the log of a run contains its strategy")
        say_idle({"include": "--include"}, "here: the log of a run contains its scene")
    elif shown == 0:
        say_idle({"ranking": _RANK, "tree_path": "--strategy"}, "with --plans 0")
    path = Path(f"{source.stem or source.name}.png") if output is None else output
    kind_of(path, PAGES)
    require_apart({"-o": path}, {"source": source})
    picture = (
        _of_run(source, shown)
        if _is_log(source)
        else _of_scene(source, shown, criteria, include, tree_path, memory_bytes)
    )
    with doing("drawing the picture"):
        write_picture(picture, path)
    echo(f"wrote {path}")
    return 0


def _without_scene() -> None:
    """Says which options have no effect on the picture of a model."""
    idle = {"shown": "--plans", "tree_path": "--strategy", "ranking": _RANK}
    say_idle(idle, "here: the model is drawn, not a scene")


def _is_log(source: Path) -> bool:
    """Whether a file is a log, by its name or its first bytes."""
    if source.suffix == ".mcap":
        return True
    # A pipe can be read only once, so its name decides.
    if not source.is_file():
        return False
    with open_file(source, sys.maxsize) as file:
        return file.read(len(_MCAP_MAGIC)) == _MCAP_MAGIC


def _of_run(source: Path, shown: int) -> Picture:
    from ntagen.drive.reading import read_log
    from ntagen.plot.run import picture_of_run

    return picture_of_run(read_log(source), shown)


def _of_scene(
    source: Path,
    shown: int,
    ranking: tuple[str, ...],
    include: tuple[Path, ...],
    tree_path: Path | None,
    memory_bytes: int | None,
) -> Picture:
    from ntagen.drive.configure import configure
    from ntagen.drive.settings import engine_for
    from ntagen.plot.face import picture_with_plans
    from ntagen.plot.run import picture_of_plans

    with doing("loading the task"):
        task = load_task(source, include)
    configuration = configure(task.given, task.scene)
    settings = configuration.settings
    timeout_s = current().left_s()
    settings = replace(
        settings,
        engine_time_s=settings.engine_time_s if timeout_s is None else timeout_s,
        engine_memory_bytes=memory_bytes or settings.engine_memory_bytes,
    )
    configuration = replace(configuration, settings=settings)
    engine = engine_for(settings)
    engine = replace(engine, ranking=ranking or settings.ranking)
    if shown == 0:
        return picture_of_plans(task.scene, None, shown)
    if not task.scene.tissue.is_adversarial:
        say_idle({"tree_path": "--strategy"}, f"in a tissue that is {task.scene.tissue.kind}")
    elif (found := _of_strategy(task.scene, configuration, tree_path)) is not None:
        say_idle({"ranking": _RANK}, "here: a strategy against the tissue is drawn, not plans")
        return found
    with doing("the search for plans"):
        return picture_with_plans(task.scene, engine, shown)


def _of_strategy(
    scene: Scene, configuration: Configuration, tree_path: Path | None
) -> Picture | None:
    """The picture of the strategy against the tissue; None, and the reason, if there is none."""
    from ntagen.cli.needle.answering_tissue import Wanted, course_of
    from ntagen.plot.strategy import picture_of_strategy

    course = course_of(Wanted(tree_path=tree_path), scene, configuration, lambda: None)
    if course is None or course.tree is None:
        lack = "no strategy is wanted" if course is None else course.lack
        echo(f"note: {lack}; plans for the expected tissue are drawn", err=True)
        return None
    return picture_of_strategy(scene, course.tree)
