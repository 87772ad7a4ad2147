"""`ntagen calibrate needle`: how a needle bends, from five insertions."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from ntagen.cli.options import include_option, path_argument, path_option
from ntagen.cli.terminal import Styled, echo
from ntagen.errors import InputError
from ntagen.units import deg_from_rad

if TYPE_CHECKING:
    from ntagen.scene import Scene
    from ntagen.tracking.frames import Transform
    from ntagen.tracking.insertions import Insertion
    from ntagen.tracking.needle_fit import Found


@click.command(
    "needle", epilog="Exit codes: 0 done, 2 the insertions are rejected, 70 internal error."
)
@path_argument("environment", metavar="ENV.nsl")
@path_argument("files", metavar="[INSERTIONS]…", nargs=-1)
@click.option(
    "--registration",
    metavar="FILE.json",
    help="Where the scene lies for the tracker, if the positions are in the tracker's frame: a "
    "file of `ntagen calibrate`.",
)
@path_option(
    "--into",
    metavar="FILE.nsl",
    help="Write radius, bevel and lag into this file: ENV.nsl, or a file that it includes in which "
    "the needle is described. All else stays as it is.",
)
@include_option()
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
def needle(
    environment: Path,
    files: tuple[Path, ...],
    registration: str | None,
    into: Path | None,
    include: tuple[Path, ...],
    as_json: bool,
) -> int:
    """Find radius, bevel and lag of a needle from five insertions.

    Without INSERTIONS, print which five to make with the needle of ENV.nsl.

    INSERTIONS are tables with a row for each measured position of the tip, in the columns depth_mm,
    roll_deg (by which the base was turned), x_mm, y_mm, z_mm. One table can have all of them, with
    their numbers in a column insertion. A log of `ntagen drive` is an insertion up to its first
    pull.

    The output has each number with its error, the residual of each insertion, and how far its tip
    ends from where the others predict it. Insertions that leave something open are refused: too
    short, without a roll, with rolls in one direction only, too noisy.

    \b
    Examples:
      ntagen calibrate needle examples/needles/bent_tip.nsl
      ntagen calibrate needle examples/needles/bent_tip.nsl examples/tracker/insertions.csv
      ntagen calibrate needle task.nsl first.csv second.csv third.csv fourth.csv fifth.csv \\
        --registration registration.json --into task.nsl
    """  # noqa: D301  click wants the control character
    from ntagen.cli.loading import load_task

    scene = load_task(environment, include).scene
    if not files:
        _require_files(registration, into)
        _tell_recipe(scene, as_json)
        return 0
    from ntagen.tracking.needle_fit import find_needle

    found = find_needle(scene.needle, _insertions(files, _registration(registration)))
    if into is not None:
        _write(into, environment, include, found)
    if as_json:
        echo(json.dumps(_as_json(found)))
    else:
        _tell(found, environment, into)
    return 0


def _require_files(registration: str | None, into: Path | None) -> None:
    """Refuses options that mean nothing without insertions."""
    for name, value in (("--registration", registration), ("--into", into)):
        if value is not None:
            raise InputError(
                f"{name} {value} is for insertions, and there are none\n"
                "hint: name their files after ENV.nsl; without them, the recipe is printed"
            )


def _registration(path: str | None) -> Transform | None:
    if path is None:
        return None
    from ntagen.tracking.transform_file import read_transform

    return read_transform(Path(path))


def _insertions(files: tuple[Path, ...], transform: Transform | None) -> list[Insertion]:
    from ntagen.tracking.insertions import read_insertions

    seen: dict[Path, Path] = {}
    for file in files:
        if seen.setdefault(file.resolve(), file) is not file:
            raise InputError(f"{file} is given twice\nhint: each insertion counts once")
    return [one for file in files for one in read_insertions(file, transform)]


# The recipe.


def _tell_recipe(scene: Scene, as_json: bool) -> None:
    from ntagen.tracking.recipe import ANGLES_DEG, recipe

    depth_mm, roll_mm = recipe(scene.needle)
    if as_json:
        insertions = [
            {"depth_mm": depth_mm, "roll_at_mm": roll_mm if angle else None, "roll_deg": angle}
            for angle in ANGLES_DEG
        ]
        echo(json.dumps({"insertions": insertions}))
        return
    echo(f"five insertions, each {depth_mm:g} mm deep and from the same entry pose, in tissue that")
    echo(
        "was not cut before; no lag compensation; measure the tip every mm or more often, at rest:"
    )
    for number, angle in enumerate(ANGLES_DEG, start=1):
        turn = f"roll the base by {angle:+d} deg at {roll_mm:g} mm" if angle else "do not roll"
        echo(f"  {number}  {turn}")
    echo("write a row for each position: insertion,depth_mm,roll_deg,x_mm,y_mm,z_mm")
    echo("roll_deg is how far the base is turned then, right-handed about the heading")


# The result.


def _bevel(found: Found) -> str:
    """The bevel as a direction of the language."""
    words = ", ".join(f"{round(part, 6) + 0.0:g}" for part in found.needle.tip.bevel)
    return f"({words})"


def _radius(found: Found) -> str:
    return f"{found.radius_mm.value:.2f} mm"


def _lag(found: Found) -> str:
    """The lag as a setting of the driver, which is not less than 0."""
    return f"{max(0.0, deg_from_rad(found.lag_rad.value)):.1f} deg"


def _write(into: Path, environment: Path, include: tuple[Path, ...], found: Found) -> None:
    """Writes the three numbers into an environment file, and nothing else."""
    from ntagen.files import read_file, write_files
    from ntagen.nsl import loads_task
    from ntagen.nsl.revise import revised
    from ntagen.nsl.source import MAX_SOURCE_BYTES

    try:
        text = read_file(into, MAX_SOURCE_BYTES).decode()
    except OSError as error:
        raise InputError(f"cannot read {into}: {(error.strerror or str(error)).lower()}") from error
    except UnicodeDecodeError:
        raise InputError(f"{into}: this is not text in UTF-8") from None
    values = {"radius": _radius(found), "bevel": _bevel(found)}
    new = revised(text, str(into), values, {"lag compensation": _lag(found)})
    if into.resolve() == environment.resolve():
        # What is written must be a task.
        loads_task(new, str(into), include=include)
    write_files({into: new.encode()})


def _as_json(found: Found) -> dict[str, Any]:
    def known(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "radius_mm": found.radius_mm.value,
        "radius_std_mm": found.radius_mm.std,
        "bevel_deg": deg_from_rad(found.bevel_rad.value),
        "bevel_std_deg": deg_from_rad(found.bevel_rad.std),
        "bevel": list(found.needle.tip.bevel),
        "lag_deg": deg_from_rad(found.lag_rad.value),
        "lag_std_deg": deg_from_rad(found.lag_rad.std),
        "noise_mm": found.noise_mm,
        "scatter": found.scatter,
        "suspect": found.suspect or None,
        "insertions": [
            {
                "name": name,
                "radius_mm": radius_mm,
                "bevel_deg": deg_from_rad(bevel_rad),
                "lag_deg": known(deg_from_rad(lag_rad)),
                "residual_mm": residual_mm,
                "left_out_mm": known(left_mm),
            }
            for name, (radius_mm, bevel_rad, lag_rad), residual_mm, left_mm in zip(
                found.names, found.alone, found.residuals_mm, found.left_out_mm, strict=True
            )
        ],
    }


def _tell(found: Found, environment: Path, into: Path | None) -> None:
    degrees = deg_from_rad
    echo(f"{len(found.names)} insertions, noise of each coordinate {found.noise_mm:.2f} mm")
    width = max(9, *(len(name) for name in found.names))
    echo(f"{'insertion':<{width}}     radius    bevel      lag  residual  tip, left out")
    for name, (radius_mm, bevel_rad, lag_rad), residual_mm, left_mm in zip(
        found.names, found.alone, found.residuals_mm, found.left_out_mm, strict=True
    ):
        lag_text = f"{degrees(lag_rad):5.0f} deg" if math.isfinite(lag_rad) else f"{'-':>9}"
        left = f"{left_mm:10.2f} mm" if math.isfinite(left_mm) else f"{'-':>13}"
        echo(
            f"{name:<{width}} {radius_mm:7.1f} mm {degrees(bevel_rad):4.0f} deg{lag_text} "
            f"{residual_mm:6.2f} mm {left}"
        )
    radius, bevel, lag = found.radius_mm, found.bevel_rad, found.lag_rad
    echo(f"radius {radius.value:.2f} ± {radius.std:.2f} mm")
    echo(
        f"bevel  {_bevel(found)}, {degrees(bevel.value):.1f} ± {degrees(bevel.std):.1f} deg about "
        "the heading from that of the scene"
    )
    echo(f"lag    {degrees(lag.value):.1f} ± {degrees(lag.std):.1f} deg at a depth of 100 mm")
    for warning in _warnings(found):
        echo(Styled("warning", "yellow", bold=True), f": {warning}", err=True)
    if into is not None:
        echo(f"wrote {into}")
        return
    echo(f"for needle {{ … }} in {environment}: radius {_radius(found)}  bevel {_bevel(found)}")
    echo(f"for drive {{ … }}: lag compensation {_lag(found)}")


def _warnings(found: Found) -> list[str]:
    """What makes a calibration doubtful, though it is one."""
    warnings = []
    if found.suspect:
        warnings.append(f"{found.suspect} does not fit the others; make it again")
    if found.scatter > _MOST_SCATTER:
        warnings.append(
            f"the insertions differ {found.scatter:.1f} times as much as in gelatine; all errors "
            "above are larger by this factor"
        )
    if found.lag_rad.value < -2.0 * found.lag_rad.std:
        warnings.append(
            "the lag is less than 0: the tip turns farther than the base; is roll_deg right-handed "
            "about the heading?"
        )
    return warnings


_MOST_SCATTER: Final = 2.0
