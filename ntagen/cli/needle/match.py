"""`ntagen match`: which pushes, rolls and start explain measured traces of the tip."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.loading import load_task, show_warnings
from ntagen.cli.needle.match_tables import show
from ntagen.cli.options import include_option, output_option, path_argument
from ntagen.cli.quantities import length
from ntagen.cli.terminal import echo
from ntagen.errors import InputError
from ntagen.files import require_apart
from ntagen.units import deg_from_rad

if TYPE_CHECKING:
    from ntagen.cli.needle.match_tables import Matched
    from ntagen.scene import Scene
    from ntagen.traces.matching import Options
    from ntagen.traces.prediction import Prediction
    from ntagen.traces.reading import Columns

_STARTS: Final = ("free", "fit", "model")


def _start(value: object) -> tuple[Any, float]:
    """What is known of the start, and the length of the first part that says it, in mm."""
    start, _, part = str(value).partition(":")
    if start not in _STARTS:
        raise click.BadParameter(f"{start!r} is not one of {', '.join(_STARTS)}")
    return start, length(part or "20mm")


@click.command(
    "match",
    cls=Renamed,
    former={"--first": "write --start fit:{} or --start model:{}"},
    epilog="Exit codes: 0 done, 2 the environment or a trace is wrong, 70 internal error.",
)
@path_argument("environment", metavar="ENV.nsl")
@path_argument("traces", metavar="TRACE…", nargs=-1, required=True)
@click.option(
    "--start",
    metavar="free|fit|model[:LENGTH]",
    type=_start,
    default="free",
    show_default=True,
    help="What is known of the start: nothing (free); its pose by a circle fit of the first part "
    "(fit), as in the paper; or its position alone, and the model chooses the orientation on a "
    "grid of 1 deg (model), as in the work before it.",
)
@click.option(
    "--radius",
    type=click.Choice(["scene", "fit"]),
    default="scene",
    show_default=True,
    help="Take the radius of the environment, or fit it; then that of the environment is expected, "
    "with a curvature that may be off by 20 %.",
)
@click.option(
    "--rolls",
    metavar="N",
    type=click.IntRange(min=0),
    help="Match with exactly N rolls; predict with at most N.  [default: as many as each lower the "
    "deviation by 40 %, at most those of the environment]",
)
@click.option(
    "--from",
    "from_mm",
    metavar="LENGTH",
    type=length,
    default="0mm",
    help="Match the trace from this depth on, for example after what was no insertion yet. All "
    "other depths are counted from there.",
)
@click.option(
    "--until",
    "until_mm",
    metavar="LENGTH",
    type=length,
    help="Match the trace up to this depth only, for example before a pull.",
)
@click.option("--predict", is_flag=True, help="Predict the rest from the first 20, 30 and 40 mm.")
@click.option(
    "--columns",
    metavar="NAME|X,Y,Z",
    help="The columns of the tip's position: what their names begin with (AuroraTip), or three "
    "names or numbers; of a bag, the topic.  [default: x_mm, y_mm, z_mm and the like; without "
    "names, three columns; of a bag, /sensor/tip]",
)
@click.option(
    "--unit",
    type=click.Choice(["mm", "cm", "m", "um"]),
    help="The unit of positions whose columns do not name one.  [default: mm; in a bag, m]",
)
@output_option(
    "FILE.png|pdf|svg",
    "Draw the traces, the paths and their deviations.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object a trace on a line.")
@include_option()
def command(
    environment: Path,
    traces: tuple[Path, ...],
    start: tuple[Any, float],
    radius: Any,  # noqa: ANN401  one of the choices
    rolls: int | None,
    from_mm: float,
    until_mm: float | None,
    predict: bool,
    columns: str | None,
    unit: str | None,
    output: Path | None,
    as_json: bool,
    include: tuple[Path, ...],
) -> int:
    """Explain measured traces of the tip by the model.

    Finds the pushes, the rolls and the start of the environment's needle whose path is nearest to
    each trace, and prints the least, mean and greatest distance of the trace from it, in mm. Where
    the regions lie does not matter. A trace is a table (CSV, columns with blanks or semicolons, or
    a table of an NDI tracker), the log of a run (MCAP), or a bag of ROS 2 (MCAP or SQLite, a
    folder or a file; pip install 'ntagen[bags]'); a jump backwards of more than 5 mm ends it. See
    docs/matching.md.

    \b
    Examples:
      ntagen match examples/traces/bench.nsl examples/traces/two_rolls.csv -o match.png
      ntagen match bench.nsl trial*.csv --radius fit --predict --columns AuroraTip
      ntagen match bench.nsl rosbag2_2026_11_26/ --columns /sensor/tip --unit mm
    """  # noqa: D301  click wants the control character
    from ntagen.traces.matching import Options
    from ntagen.traces.reading import Columns

    if output is not None:
        _require_picture(output, environment, traces)
    task = load_task(environment, include)
    options = Options(start=start[0], radius=radius, rolls=rolls, first_mm=start[1])
    part_mm = (math.inf if until_mm is None else until_mm, from_mm)
    found = []
    for path in traces:
        try:
            one = _matched(task.scene, path, Columns(columns, unit), options, part_mm, predict)
        except InputError as error:
            # The other traces are matched all the same.
            echo(f"error: {error}", err=True)
            continue
        show_warnings([f"warning: {text}" for text in one.match.trace.samples.warnings])
        if as_json:
            echo(json.dumps(_document(one)))
        found.append(one)
    if not as_json and found:
        show(task.scene, options, found)
    if output is not None and found:
        _draw(found, task.scene, output)
        echo(f"wrote {output}", err=as_json)
    return 0 if len(found) == len(traces) else InputError.exit_code


def _matched(
    scene: Scene,
    path: Path,
    columns: Columns,
    options: Options,
    part_mm: tuple[float, float],
    predicts: bool,
) -> Matched:
    """The match of a file, or of its part up to a depth and from another one on."""
    from ntagen.cli.needle.match_tables import Matched
    from ntagen.traces.matching import match_trace
    from ntagen.traces.prediction import predict
    from ntagen.traces.reading import read_samples
    from ntagen.traces.trace import trace_of

    trace = trace_of(read_samples(path, columns), *part_mm)
    match = match_trace(scene, trace, options)
    return Matched(path, match, predict(scene, trace, options) if predicts else None)


def _require_picture(output: Path, environment: Path, traces: Sequence[Path]) -> None:
    """Refuses a picture that cannot be drawn, before anything is computed."""
    from ntagen.checker.picture.page import kind_of
    from ntagen.plot.matches import MOST_ROWS

    kind_of(output)
    inputs = {"environment": environment}
    inputs |= {f"trace {number}": path for number, path in enumerate(traces, start=1)}
    require_apart({"-o": output}, inputs)
    if len(traces) > MOST_ROWS:
        raise InputError(
            f"{len(traces)} traces are too many for one picture, which has at most {MOST_ROWS}\n"
            "hint: draw them in several parts"
        )


def _draw(found: Sequence[Matched], scene: Scene, output: Path) -> None:
    from ntagen.plot.matches import MatchRow, draw_matches
    from ntagen.plot.save import save

    rows = [MatchRow(one.path.name, one.match, one.predictions or ()) for one in found]
    save(draw_matches(rows, f"measured traces and the model of {scene.name}"), output)


def _document(one: Matched) -> dict[str, Any]:
    """A match for JSON, in mm and degrees."""
    from ntagen.plan.document import plan_to_json

    match, trace = one.match, one.match.trace
    tip = match.needle.tip
    return {
        "trace": str(one.path),
        "points": len(trace.points_mm),
        "missing": trace.samples.missing,
        "outliers": trace.outliers,
        "length_mm": trace.length_mm,
        "min_mm": match.min_mm,
        "avg_mm": match.avg_mm,
        "max_mm": match.max_mm,
        "rms_mm": match.rms_mm,
        "radius_mm": match.needle.radius_mm,
        "rolls": [
            {"depth_mm": depth_mm, "angle_deg": round(deg_from_rad(angle_rad), 9)}
            for depth_mm, angle_rad in match.rolls
        ],
        "actions": plan_to_json(match.plan),
        "start": {
            "position_mm": tip.position_mm,
            "heading": tip.heading,
            "bevel": tip.bevel,
        },
        "rms_by_rolls_mm": match.rms_by_rolls_mm,
        "predictions": None if one.predictions is None else list(map(_prediction, one.predictions)),
    }


def _prediction(prediction: Prediction) -> dict[str, Any]:
    return {
        "from_mm": prediction.from_mm,
        "rolls": len(prediction.match.rolls),
        "radius_mm": prediction.match.needle.radius_mm,
        "ahead": list(map(asdict, prediction.ahead)),
    }
