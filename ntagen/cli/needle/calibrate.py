"""`ntagen calibrate`: the registration of a tracker with the scene, from pairs of points.

The words `pivot`, `hand-eye` and `needle` are commands of their own
(`ntagen.cli.needle.calibrate_poses`, `ntagen.cli.needle.calibrate_needle`).
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.former_options import Renamed
from ntagen.cli.needle.calibrate_needle import needle
from ntagen.cli.needle.calibrate_poses import hand_eye, pivot
from ntagen.cli.options import output_option, path_argument
from ntagen.cli.terminal import Styled, echo
from ntagen.errors import InputError
from ntagen.files import require_apart, write_files

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from ntagen.scene import Vector
    from ntagen.tracking.registration import Fit, Pairs


def _places(
    _ctx: click.Context, _option: click.Parameter, texts: tuple[str, ...]
) -> tuple[Vector | Path, ...]:
    """Positions, each written as three numbers with commas, and the files of scenes."""
    found: list[Vector | Path] = []
    for text in texts:
        if text.endswith(".nsl"):
            found.append(Path(text))
            continue
        try:
            x, y, z = (float(part) for part in text.split(","))
        except ValueError:
            x = y = z = math.nan
        if not all(map(math.isfinite, (x, y, z))):
            raise click.BadParameter(f"'{text}' is not a position; write for example 0,-50,0")
        found.append((x, y, z))
    return tuple(found)


_WIDTH: Final = 100
_COMMANDS: Final = {"pivot": pivot, "hand-eye": hand_eye, "needle": needle}


def _first_words(
    _ctx: click.Context, _argument: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """What a shell offers for the first word: files, and the other calibrations.

    The shells show files where no word fits; bash forgets what comes before them.
    """
    from click.shell_completion import CompletionItem

    words = [
        CompletionItem(name, help=one.get_short_help_str(_WIDTH))
        for name, one in _COMMANDS.items()
        if name.startswith(incomplete)
    ]
    return [CompletionItem(incomplete, type="file"), *words]


class _ByPoints(Renamed):
    """The registration by points; its help lists the other calibrations, too."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options, then the commands."""
        super().format_options(ctx, formatter)
        with formatter.section("Commands"):
            formatter.write_dl(
                [(name, one.get_short_help_str(_WIDTH)) for name, one in _COMMANDS.items()]
            )


class _Calibrations(click.Group):
    """Calibrations by name. Any other first word belongs to the one by points."""

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,  # noqa: ANN401  click's settings
    ) -> click.Context:
        """The context of the group, or of the registration by points."""
        if args and args[0] in self.commands:
            return super().make_context(info_name, args, parent, **extra)
        return _by_points.make_context(info_name, args, parent, **extra)

    def get_help(self, ctx: click.Context) -> str:
        """The help of the registration by points."""
        with click.Context(_by_points, ctx.parent, ctx.info_name) as points:
            points.max_content_width, points.terminal_width = (
                ctx.max_content_width,
                ctx.terminal_width,
            )
            return _by_points.get_help(points)


@click.command(
    "calibrate",
    cls=_ByPoints,
    former={"--scene": "write --at {}"},
    epilog="Exit codes: 0 done, 2 the points are rejected, 70 internal error.",
)
@path_argument("tracker_points", metavar="POINTS", shell_complete=_first_words)
@path_argument("scene_points", metavar="[SCENE_POINTS]", required=False)
@click.option(
    "--frame",
    "frames",
    metavar="FRAME",
    multiple=True,
    help="The frame of a CSV file that does not name it: RAS, LPS, or a name of your own. Give it "
    "once for each such file, in their order.",
)
@click.option(
    "--from",
    "source",
    metavar="RAS|LPS",
    help="The frame in which the tracker's positions will arrive.  [default: that of its points]",
)
@click.option(
    "--to",
    "target",
    metavar="RAS|LPS",
    help="The frame in which the scene is written.  [default: that of its points]",
)
@click.option(
    "--by-order", is_flag=True, help="Pair the points by their order, not by their names."
)
@click.option(
    "--at",
    "places",
    metavar="X,Y,Z|ENV.nsl",
    multiple=True,
    callback=_places,
    help="Estimate the error at this position in the scene, in mm, or at the targets and critical "
    "regions of this scene. It can be given many times.",
)
@output_option(
    "FILE.json",
    "The file to write the registration to, for `ntagen drive --registration`.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
def _by_points(
    tracker_points: Path,
    scene_points: Path | None,
    frames: tuple[str, ...],
    source: str | None,
    target: str | None,
    by_order: bool,
    places: tuple[Vector | Path, ...],
    output: Path | None,
    as_json: bool,
) -> int:
    """Find where the scene lies for a tracker, from pairs of points.

    POINTS has positions that the tracker measured, SCENE_POINTS the positions of the same points in
    the scene. Both can be markups of 3D Slicer (.fcsv, .mrk.json) or CSV files with the columns
    name, x_mm, y_mm, z_mm. One CSV file can have both, with the frames in the names of the columns:
    name, tracker_x_mm, …, scene_x_mm, …

    The frames RAS and LPS of medical images differ in the signs of x and y. They are never guessed.

    The output has the residual of each pair, and its residual after a fit to all others. FRE is the
    root mean square of the first. TRE, the expected error of the registration at a place, is what
    counts: see it with --at. A set that is mirrored, on a line, in another unit or
    paired wrongly is refused.

    \b
    Examples:
      ntagen calibrate examples/calibration.csv --at examples/paper.nsl -o registration.json
      ntagen calibrate measured.csv image.fcsv --frame tracker --to LPS -o registration.json

    \b
    A file that is called as one of the commands below is ./pivot, ./hand-eye or ./needle.
    """  # noqa: D301  click wants the control character
    from ntagen.tracking.registration import register
    from ntagen.tracking.transform_file import to_json

    files = [tracker_points] if scene_points is None else [tracker_points, scene_points]
    try:
        fit = register(_pairs(files, frames, (source, target), by_order))
    except InputError as error:
        if any(str(file) in str(error) for file in files):
            raise
        raise InputError(f"{' and '.join(map(str, files))}: {error}") from error
    errors = _errors(fit, places)
    document = to_json(fit)
    if output is not None:
        inputs = {f"file of points {number}": file for number, file in enumerate(files, start=1)}
        require_apart({"--output": output}, inputs)
        write_files({output: json.dumps(document, indent=1) + "\n"})
    if as_json:
        echo(json.dumps({**document, "tre": errors, "warnings": _warnings(fit)}))
    else:
        _report(fit, errors, output)
    return 0


command = _Calibrations("calibrate", _COMMANDS)


def _pairs(
    files: list[Path],
    frames: tuple[str, ...],
    wanted: tuple[str | None, str | None],
    by_order: bool,
) -> Pairs:
    """The pairs of points in the files, in the frames that are wanted."""
    from ntagen.tracking.frames import frame_named
    from ntagen.tracking.points import pair, read_points

    left = iter(frames)
    sets = [one for file in files for one in read_points(file, left)]
    if len(sets) != 2:
        raise InputError(
            f"there are {len(sets)} sets of points, and two are needed: measured by the tracker, "
            "and in the scene\nhint: give two files, or one CSV file with the columns of both"
        )
    for frame in left:
        named = " and ".join(one.frame for one in sets)
        raise InputError(
            f"--frame {frame} is too much: the files or other options name the frames {named}"
        )
    first, second = (
        one.within(frame_named(frame)) if frame else one
        for one, frame in zip(sets, wanted, strict=True)
    )
    return pair(first, second, by_order=by_order)


def _errors(fit: Fit, places: tuple[Vector | Path, ...]) -> list[dict[str, Any]]:
    """The estimated errors at places of the scene, positions first."""
    from ntagen.nsl import load

    wanted = [("centre of the points", fit.center_mm)]
    for place in places:
        if not isinstance(place, Path):
            wanted.append((", ".join(f"{number:g}" for number in place), place))
    for scene in (load(place) for place in places if isinstance(place, Path)):
        wanted += [(one.name, one.center_mm) for one in (*scene.targets, *scene.criticals)]
    return [
        {"at": name, "position_mm": list(place), "tre_mm": fit.tre_mm(place)}
        for name, place in wanted
    ]


def _warnings(fit: Fit) -> list[str]:
    """What makes a registration doubtful, though it is one."""
    found = []
    if len(fit.names) == 3:
        found.append("three points fit almost always: nothing checks them; add one or more")
    if fit.is_flat:
        found.append(
            "the points are in a plane, where a mirrored set looks like a turned one; add a point "
            "beside the plane"
        )
    if fit.suspect is not None:
        found.append(f"{fit.suspect} does not fit the others; measure it again")
    return found


def _report(fit: Fit, errors: list[dict[str, Any]], output: Path | None) -> None:
    transform = fit.transform
    echo(f"{len(fit.names)} pairs of points, from {transform.source} to {transform.target}")
    width = max(5, *(len(name) for name in fit.names))
    echo(f"{'point':<{width}}  residual  left out")
    for name, residual_mm, left_out_mm in zip(
        fit.names, fit.residuals_mm, fit.left_out_mm, strict=True
    ):
        left_out = "        -" if left_out_mm is None else f"{left_out_mm:6.2f} mm"
        echo(f"{name:<{width}} {residual_mm:6.2f} mm {left_out}")
    echo(f"FRE {fit.fre_mm:.2f} mm, estimated error of one measured point {fit.fle_mm:.2f} mm")
    echo("expected error of the registration (TRE):")
    wide = max(len(one["at"]) for one in errors)
    for one in errors:
        echo(f"  {one['at']:<{wide}}  {one['tre_mm']:.2f} mm")
    for warning in _warnings(fit):
        echo(Styled("warning", "yellow", bold=True), f": {warning}", err=True)
    if output is not None:
        echo(f"wrote {output}")
