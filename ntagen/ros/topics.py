"""What a node listens to and publishes: names, frames, units and quality of service.

A file of TOML says what differs from the defaults (``--topics``), and parameters of the node win
over it. Both have the same words::

    units = "mm"
    stage_frame = "world"

    [names]
    "/sensor/tip" = "/em/tip"
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import field, fields, replace
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from ntagen.bags import LOG as LOG
from ntagen.errors import InputError
from ntagen.files import read_file
from ntagen.tracking.mount import AXES
from ntagen.units import MM_PER
from ntagen.values import dataclass

TIP: Final = "/sensor/tip"
SHAPE: Final = "/needle/state/shape"
FORCE: Final = "/sensor/force"
TARGET: Final = "/subject/state/target"
ENTRY: Final = "/subject/state/skin_entry"
STAGE_STATE: Final = "/stage/state/needle_pose"
STAGE_COMMAND: Final = "/stage/control/needle_pose"
COMMAND: Final = "/stage/control/cmd"
POSE: Final = "/needle/state/pose"
TIP_POSE: Final = "/needle/state/tip"
PREDICTED: Final = "/needle/state/predicted_shape"
MARKERS: Final = "/visualization_marker_array"
DIAGNOSTICS: Final = "/diagnostics"
STATUS: Final = "/ntagen/status"

NAMES: Final = (
    *(TIP, SHAPE, FORCE, TARGET, ENTRY, STAGE_STATE, STAGE_COMMAND, COMMAND),
    *(POSE, TIP_POSE, PREDICTED, MARKERS, DIAGNOSTICS, STATUS, LOG),
)
"""The topics by the names that labs of needle steering use."""

_MOST_BYTES: Final = 2**20
_HINT: Final = "\nhint: docs/ros.md says what each parameter may be"
_FREE: Final = frozenset({"names"})


@dataclass(frozen=True, slots=True)
class Topics:
    """The settings of a node. Each but `names` is also a parameter of the node.

    Attributes:
        units: The unit of lengths in all messages, ``m`` (REP 103) or ``mm``.
        sensor_units: The same for the tip, its shape and their frames; empty: as `units`.
        stage_frame: The frame in which the task is written.
        needle_frame: The frame at the entry whose z axis is the direction of insertion and whose
            x axis is the bevel direction there.
        tip_from: What measures the tip: ``tip`` (a pose) or ``shape`` (poses along the needle).
        axis: The axis of the measured pose that points in the direction of insertion.
        bevel: Its axis in the bevel direction; empty if the sensor does not see the roll, as a
            shape does not.
        force_axis: The component of the force that counts.
        reliability: What is asked of publishers of sensors: ``best_effort`` takes any.
        depth: How many samples may wait.
        stale_s: A sample is waited for so long, and a stage may be silent for so long.
        latency_s: How long a sample of the tip is under way.
        stage_tolerance_mm: The stage has arrived when it is so near to what was asked.
        stage_ramp_mm_per_s2: The acceleration with which the stage stops; 10 is GRBL's.
        names: Other names of topics, by those in `NAMES`.
    """

    units: Literal["m", "mm"] = "m"
    sensor_units: Literal["", "m", "mm"] = ""
    stage_frame: str = "stage"
    needle_frame: str = "needle"
    tip_from: Literal["tip", "shape"] = "tip"
    axis: str = "+z"
    bevel: str = ""
    force_axis: Literal["x", "y", "z"] = "z"
    reliability: Literal["best_effort", "reliable"] = "best_effort"
    depth: int = 5
    stale_s: float = 0.5
    latency_s: float = 0.0
    stage_tolerance_mm: float = 0.05
    stage_ramp_mm_per_s2: float = 10.0
    names: dict[str, str] = field(default_factory=dict)

    @property
    def mm_per_unit(self) -> float:
        """Millimetres in the unit of all topics but those of sensors."""
        return MM_PER[self.units]

    @property
    def sensor_mm_per_unit(self) -> float:
        """Millimetres in the unit of sensors."""
        return MM_PER[self.sensor_units or self.units]

    def name(self, usual: str) -> str:
        """The name of a topic, before ROS remaps it."""
        return self.names.get(usual, usual)

    @property
    def tip(self) -> str:
        """The topic that says where the tip is."""
        return self.name(TIP if self.tip_from == "tip" else SHAPE)


def parameters() -> dict[str, Any]:
    """The names of the node's parameters with their defaults."""
    plain = Topics()
    return {one.name: getattr(plain, one.name) for one in fields(Topics) if one.name not in _FREE}


def read_topics(path: Path | None) -> Topics:
    """The settings in a file; the defaults without one.

    Raises:
        InputError: It cannot be read, or has a mistake.
    """
    if path is None:
        return Topics()
    try:
        values = tomllib.loads(read_file(path, _MOST_BYTES).decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: this is no TOML: {error}") from error
    return topics_of(values, str(path))


def topics_of(values: dict[str, Any], place: str) -> Topics:
    """The settings with these values, and the defaults for the rest.

    Args:
        values: The values by their words.
        place: Where they stand, for messages.

    Raises:
        InputError: A value is wrong.
    """
    known = {one.name for one in fields(Topics)}
    unknown = sorted(values.keys() - known)
    if unknown:
        raise InputError(
            f"{place}: there is no `{unknown[0]}`\nhint: there are {', '.join(sorted(known))}"
        )
    try:
        found = msgspec.convert(values, Topics)
    except msgspec.ValidationError as error:
        raise InputError(f"{place}: {error}{_HINT}") from error
    problem = _problem(found)
    if problem:
        raise InputError(f"{place}: {problem}" + ("" if "hint:" in problem else _HINT))
    return found


def _problem(found: Topics) -> str:
    """What is wrong with the settings; empty if nothing."""
    positive = ("depth", "stale_s", "stage_tolerance_mm", "stage_ramp_mm_per_s2")
    for name in positive:
        value = getattr(found, name)
        if not 0.0 < value < math.inf:
            return f"`{name}` is {value:g}, and it must be greater than 0"
    if not 0.0 <= found.latency_s < math.inf:
        return f"`latency_s` is {found.latency_s:g}, and it must not be negative"
    if not found.stage_frame or not found.needle_frame:
        return "a frame needs a name"
    if found.stage_frame == found.needle_frame:
        return f"`stage_frame` and `needle_frame` are both '{found.stage_frame}'"
    if problem := _problem_of_sensor(found):
        return problem
    for usual, name in found.names.items():
        if usual not in NAMES:
            return f"there is no topic {usual}\nhint: there are {', '.join(NAMES)}"
        if not name:
            return f"the new name of {usual} is empty"
    return ""


def _problem_of_sensor(found: Topics) -> str:
    """What is wrong with how the tip is measured; empty if nothing."""
    for name, value in (("axis", found.axis), ("bevel", found.bevel or "+x")):
        if value not in AXES:
            return f"`{name}` is '{value}', and must be one of {', '.join(AXES)}"
    if found.bevel and found.axis[1] == found.bevel[1]:
        return f"`axis` {found.axis} and `bevel` {found.bevel} are on one line"
    if found.tip_from == "shape" and found.bevel:
        return (
            f"`tip_from` is shape, and places along a needle say nothing of its `bevel` "
            f"{found.bevel}\nhint: leave out one of both"
        )
    return ""


def apart(topics: Topics, under: str) -> Topics:
    """The same with sensors and stage under other names, so that nobody else hears or moves them.

    Args:
        topics: The topics.
        under: What the names begin with.
    """
    own = (TIP, SHAPE, FORCE, TARGET, ENTRY, STAGE_STATE, STAGE_COMMAND, COMMAND)
    return replace(topics, names=topics.names | {name: under + name for name in own})
