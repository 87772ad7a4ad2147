"""`ntagen calibrate pivot` and `ntagen calibrate hand-eye`: calibrations from poses."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Final

import click

from ntagen.cli.options import output_option, path_argument
from ntagen.cli.terminal import Styled, echo
from ntagen.files import require_apart, write_files

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ntagen.scene import Vector
    from ntagen.tracking.hand_eye import HandEye
    from ntagen.tracking.pivot import Pivot

_CODES: Final = "Exit codes: 0 done, 2 the poses are rejected, 70 internal error."
_FEW_POSES: Final = 12


@click.command("pivot", epilog=_CODES)
@path_argument("poses", metavar="POSES.csv")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
def pivot(poses: Path, as_json: bool) -> int:
    """Find the tip of a tool from poses while it rests in a divot.

    POSES.csv has poses of the tool's sensor, in the tracker's frame, with the columns x_mm, y_mm,
    z_mm, qx, qy, qz, qw. Record them while the tip rests in a divot and you tilt the tool by 30 deg
    to all sides.

    The output has the tip in the sensor's frame, as `tip=X/Y/Z` of `ntagen drive --tracker` takes
    it, and its expected error. Poses that turn the tool too little, and poses that do not fit the
    others, are refused.

    \b
    Examples:
      ntagen calibrate pivot examples/tracker/pivot.csv
      ntagen calibrate pivot poses.csv --json
    """  # noqa: D301  click wants the control character
    from ntagen.tracking.pivot import MOST_POSES, find_tip
    from ntagen.tracking.poses import read_poses

    found = find_tip(read_poses(poses, MOST_POSES))
    if as_json:
        echo(json.dumps(_pivot_json(found)))
    else:
        _tell_pivot(found)
    return 0


def _pivot_json(found: Pivot) -> dict[str, object]:
    from ntagen.tracking.transform_file import known

    return {
        "tip_mm": list(found.tip_mm),
        "tip_error_mm": found.tip_error_mm,
        "divot_mm": list(found.divot_mm),
        "frame": found.frame or "tracker",
        "rms_mm": found.rms_mm,
        "max_mm": max(found.residuals_mm),
        "left_out_rms_mm": known(found.left_out_rms_mm),
        "turns_deg": list(found.turns_deg),
        "least_turned": list(found.least_turned),
        "poses": [
            {"name": name, "residual_mm": residual_mm, "left_out_mm": known(left_out_mm)}
            for name, residual_mm, left_out_mm in zip(
                found.names, found.residuals_mm, found.left_out_mm, strict=True
            )
        ],
    }


def _tell_pivot(found: Pivot) -> None:
    worst = max(zip(found.residuals_mm, found.names, strict=True))
    echo(f"{len(found.names)} poses in the frame {found.frame or 'tracker'}")
    echo(f"tip in the sensor's frame    {_numbers(found.tip_mm)} mm")
    echo(f"divot in the tracker's frame {_numbers(found.divot_mm)} mm")
    echo(
        f"residual {found.rms_mm:.2f} mm (root mean square), at most {worst[0]:.2f} mm: {worst[1]}"
    )
    echo(f"left out {_mm(found.left_out_rms_mm)} (root mean square)")
    echo(
        f"each direction of the tool is turned by {found.turns_deg[0]:.1f} deg or more (root mean "
        f"square); least {_numbers(found.least_turned)}"
    )
    echo(f"expected error of the tip {found.tip_error_mm:.2f} mm")
    echo("for `ntagen drive --tracker openigtlink:HOST:PORT:TOOL,…`: " + _as_option(found.tip_mm))


@click.command("hand-eye", epilog=_CODES)
@path_argument("stage_poses", metavar="STAGE.csv")
@path_argument("tracker_poses", metavar="TRACKER.csv")
@output_option(
    "FILE.json",
    "The file to write the registration to, for `ntagen drive --registration`.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, nothing else.")
def hand_eye(stage_poses: Path, tracker_poses: Path, output: Path | None, as_json: bool) -> int:
    """Find where a stage lies for a tracker, from poses of both.

    STAGE.csv has poses of the stage's carriage, TRACKER.csv the poses of a sensor that is fixed to
    it, both with the columns x_mm, y_mm, z_mm, qx, qy, qz, qw. Poses belong together that have the
    same name in a column name; without names, line by line.

    The frames are called stage and tracker, or as the columns say: with bench_x_mm, …, the stage's
    frame is bench. Write the scene in this frame.

    Rotations about one axis only do not show how the tracker is turned about it. So they are
    refused, as are small rotations.

    \b
    Examples:
      ntagen calibrate hand-eye examples/tracker/stage.csv examples/tracker/sensor.csv
      ntagen calibrate hand-eye stage.csv sensor.csv -o registration.json
    """  # noqa: D301  click wants the control character
    from ntagen.tracking.hand_eye import MOST_POSES, find_stage
    from ntagen.tracking.poses import pair_poses, read_poses
    from ntagen.tracking.transform_file import stage_to_json

    files = (stage_poses, tracker_poses)
    found = find_stage(*pair_poses(*(read_poses(file, MOST_POSES) for file in files)))
    document = stage_to_json(found)
    if output is not None:
        inputs = {"file of the stage": stage_poses, "file of the tracker": tracker_poses}
        require_apart({"--output": output}, inputs)
        write_files({output: json.dumps(document, indent=1) + "\n"})
    if as_json:
        echo(json.dumps({**document, "warnings": _warnings(found)}))
    else:
        _tell_stage(found, output)
    return 0


def _warnings(found: HandEye) -> list[str]:
    """What makes a calibration doubtful, though it is one."""
    warnings = []
    if len(found.names) < _FEW_POSES:
        warnings.append(
            f"there are {len(found.names)} poses; with {_FEW_POSES} or more, errors show better"
        )
    if found.suspect is not None:
        warnings.append(f"{found.suspect} does not fit the others; measure it again")
    return warnings


def _tell_stage(found: HandEye, output: Path | None) -> None:
    from ntagen.tracking.pivot import rms

    transform = found.transform
    echo(f"{len(found.names)} pairs of poses, from {transform.source} to {transform.target}")
    width = max(4, *(len(name) for name in found.names))
    echo(f"{'pose':<{width}}  residual           left out")
    for name, mm, deg, left_mm, left_deg in zip(
        found.names,
        found.residuals_mm,
        found.residuals_deg,
        found.left_out_mm,
        found.left_out_deg,
        strict=True,
    ):
        echo(f"{name:<{width}} {_both(mm, deg)}  {_both(left_mm, left_deg)}")
    whole = _both(rms(found.residuals_mm), rms(found.residuals_deg))
    left = _both(rms(found.left_out_mm), rms(found.left_out_deg))
    echo(f"root mean square: residual{whole}, left out{left}")
    echo(f"the tracker's origin in the frame {transform.target}: ", nl=False)
    echo(f"{_numbers(transform.translation_mm)} mm")
    echo(f"the sensor on the carriage: {_numbers(found.sensor.translation_mm)} mm")
    for warning in _warnings(found):
        echo(Styled("warning", "yellow", bold=True), f": {warning}", err=True)
    if output is not None:
        echo(f"wrote {output}")


# Words.


def _numbers(vector: Vector) -> str:
    return "({})".format(", ".join(f"{round(part, 2) + 0.0:.2f}" for part in vector))


def _as_option(tip_mm: Sequence[float]) -> str:
    return "tip=" + "/".join(f"{round(part, 2) + 0.0:.2f}" for part in tip_mm)


def _mm(length_mm: float) -> str:
    return f"{length_mm:.2f} mm" if math.isfinite(length_mm) else "-"


def _both(length_mm: float, angle_deg: float) -> str:
    known = math.isfinite(length_mm)
    return f"{length_mm:6.2f} mm {angle_deg:5.2f} deg" if known else f"{'-':>19}"
