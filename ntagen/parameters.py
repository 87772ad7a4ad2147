"""The table of all that steers: its words, its unit, its help.

A new setting is one row of `PARAMETERS`, and a field in `ntagen.drive.settings` (or, for the
virtual needle, in `ntagen.needle.errors`). From the row follow the language (`ntagen.nsl`: words,
dimension, diagnostics, layout), what ``--set`` takes, and the lists of settings.

Values are in mm, rad, s, N and bytes, wherever they come from.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any, Final, Literal

from ntagen.rules import Breach
from ntagen.units import BYTES_PER, MM_PER, N_PER, N_PER_MM, RAD_PER, RAD_PER_S, S_PER
from ntagen.values import dataclass

Kind = Literal[
    "length",
    "angle",
    "time",
    "force",
    "force per length",
    "angle per time",
    "data",
    "ratio",
    "percentage",
    "count",
    "switch",
    "words",
]
"""What a value is: a quantity, a plain number, a whole number, ``on`` or ``off``, or words."""

Value = float | int | bool | tuple[str, ...]
"""The value of a setting, in the unit of its field."""

_QUANTITY: Final = re.compile(
    r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(%|[^\W\d]*(?:/[a-z]+)?)\s*"
)

LARGEST: Final = 1e6
"""The largest value of any setting, in its usual unit."""


@dataclass(frozen=True, slots=True)
class Measure:
    """How the values of a kind are written.

    Attributes:
        noun: What a value is, for messages.
        unit: The usual unit, in which help and tables show it; empty for a plain number.
        units: All units, by how much one is of the unit in which values are kept.
        example: A value as an example.
    """

    noun: str
    unit: str
    units: Mapping[str, float]
    example: str


MEASURES: Final[dict[Kind, Measure]] = {
    "length": Measure("a length", "mm", MM_PER, "2 mm"),
    "angle": Measure("an angle", "deg", RAD_PER, "2 deg"),
    "time": Measure("a time", "s", S_PER, "60 s"),
    "force": Measure("a force", "N", N_PER, "0.1 N"),
    "force per length": Measure("a force per length", "N/mm", N_PER_MM, "0.5 N/mm"),
    "angle per time": Measure("an angle per time", "deg/s", RAD_PER_S, "90 deg/s"),
    "data": Measure("a size", "MiB", BYTES_PER, "512 MiB"),
    "ratio": Measure("a plain number", "", {"": 1.0}, "0.05"),
    "percentage": Measure("a percentage", "%", {"%": 0.01}, "10 %"),
    "count": Measure("a whole number", "", {"": 1.0}, "3"),
    "switch": Measure("on or off", "", {}, "off"),
    "words": Measure("a list of words", "", {}, "clearance, rolls"),
}
"""How each kind is written."""


@dataclass(frozen=True, slots=True)
class Parameter:
    """A setting.

    Attributes:
        field: Its place in the settings: a field, or part and field with a dot.
        words: Its words in ``drive { … }``.
        kind: What its values are.
        help: What it is, as a sentence.
        least: The least value, in the unit of the field.
        is_above: Whether a value must be greater than `least`.
        most: A value must be less than this, if it is given.
        option: Its own option of ``ntagen drive``, if it has one besides ``--set``.
        choices: The words that it can have.
        sample: A value as an example; by default that of its kind.
    """

    field: str
    words: str
    kind: Kind
    help: str
    least: float = 0.0
    is_above: bool = False
    option: str = ""
    choices: tuple[str, ...] = ()
    most: float | None = None
    sample: str = ""

    @property
    def part(self) -> str:
        """The part of the settings in which it is, one of `PARTS`."""
        return self.field.rpartition(".")[0]

    @property
    def spelling(self) -> str:
        """What gives it on the command line, for messages."""
        return self.option or f"--set '{self.words} …'"

    @property
    def form(self) -> str:
        """How it is written, without its value."""
        value = "…, …" if self.kind == "words" else "|".join(self.choices) or "…"
        return f"{self.words} {value} {MEASURES[self.kind].unit}".rstrip()

    @property
    def is_quantity(self) -> bool:
        """Whether its values are numbers."""
        return self.kind not in ("switch", "words")

    @property
    def words_and_unit(self) -> str:
        """Its words with the usual unit, as on an axis."""
        unit = MEASURES[self.kind].unit
        return f"{self.words} [{unit}]" if unit else self.words

    @property
    def example(self) -> str:
        """How it is written in a file, as an example."""
        return f"{self.words} {self.sample or MEASURES[self.kind].example}"

    def breach(self, value: Value) -> Breach | None:
        """What is wrong with a value in the unit of the field, or None."""
        if isinstance(value, bool | tuple):
            return None
        measure = MEASURES[self.kind]
        factor = measure.units.get(measure.unit, 1.0)
        is_low = value < self.least or (self.is_above and value == self.least)
        is_high = value > LARGEST * factor or (self.most is not None and value >= self.most)
        if math.isfinite(value) and not is_low and not is_high:
            return None
        bound = "greater than" if self.is_above else "at least"
        most = f"at most {self.shown(LARGEST * factor)}"
        if self.most is not None:
            most = f"less than {self.shown(self.most)}"
        return Breach(
            "setting-out-of-range",
            f"`{self.words}` must be {bound} {self.shown(self.least)} and {most}",
            f"write for example `{self.example}`",
        )

    def parse(self, text: str) -> Value:
        """The value of a text without its words; a number without a unit is in the usual one.

        Raises:
            ValueError: The text is not such a value; the message says what is wrong.
        """
        measure = MEASURES[self.kind]
        if self.kind == "switch":
            if text not in ("on", "off"):
                raise ValueError(f"'{text}' is not on or off")
            return text == "on"
        if self.kind == "words":
            return tuple(word.strip() for word in text.split(","))
        match = _QUANTITY.fullmatch(text)
        factor = measure.units.get(match[2] or measure.unit) if match else None
        if match is None or factor is None:
            units = ", ".join(unit for unit in measure.units if unit)
            hint = f"; units are {units}" if units else ""
            example = (self.sample or measure.example).replace(" ", "")
            raise ValueError(f"'{text}' is not {measure.noun}; write for example {example}{hint}")
        value = float(match[1]) * factor
        breach = self.breach(value)
        if breach is not None:
            reason = breach.message.replace("`", "")
            raise ValueError(f"'{text}' is not {measure.noun} that is allowed: {reason}")
        if self.kind != "count":
            return value
        if value != round(value):
            raise ValueError(f"'{text}' is not a whole number")
        return round(value)

    def in_usual_unit(self, value: float) -> float:
        """A number in the usual unit, without the digits that only the conversion makes."""
        measure = MEASURES[self.kind]
        return float(f"{value / measure.units.get(measure.unit, 1.0):.12g}")

    def written(self, value: Value) -> str:
        """A value as a text for `parse`, to 12 digits."""
        if isinstance(value, bool | tuple):
            return self.shown(value)
        measure = MEASURES[self.kind]
        return f"{self.in_usual_unit(value)!r}{measure.unit}"

    def shown(self, value: Value | None) -> str:
        """A value as a person writes it, in the usual unit."""
        measure = MEASURES[self.kind]
        if value is None:
            return "as in the scene"
        if isinstance(value, bool):
            return "on" if value else "off"
        if isinstance(value, tuple):
            return ", ".join(value)
        return f"{self.in_usual_unit(value):.6g} {measure.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Given:
    """A value that somebody gave.

    Attributes:
        parameter: The setting.
        value: Its value, in the unit of the field.
        origin: Where it comes from: a place in a file, or the command line.
    """

    parameter: Parameter
    value: Value
    origin: str


NEEDLE: Final = "needle"
"""The part of the settings that only the simulated needle knows."""

SEED: Final = "seed"
"""The words of the setting that a campaign does not take: it makes runs with many seeds."""

PARTS: Final = {
    "": "How the driver steers",
    "margins": "What plans keep clear of",
    "priors": "What is assumed before anything is measured",
    NEEDLE: "What is true of a simulated needle",
}
"""The parts of the settings, with their headings in a list."""

_KINDS: Final[dict[str, Kind]] = {
    "_n_per_mm": "force per length",
    "_rad_per_s": "angle per time",
    "_mm": "length",
    "_rad": "angle",
    "_n": "force",
    "_s": "time",
    "_bytes": "data",
    "_ratio": "ratio",
}
"""The kinds of values by the unit at the end of a field; the longer ones come first."""


def _setting(
    field: str,
    meaning: str,
    least: float = 0.0,
    *,
    words: str = "",
    kind: Kind | None = None,
    **rest: Any,  # noqa: ANN401  the other fields of `Parameter`
) -> Parameter:
    """A setting: its kind follows from the unit in its field, and its words from the rest of it."""
    part, _, name = field.rpartition(".")
    unit = next((unit for unit in _KINDS if name.endswith(unit)), "")
    stem = name.removesuffix(unit).replace("_", " ")
    kind = kind or _KINDS[unit]
    words = words or (f"prior {stem}" if part == "priors" else stem)
    if kind == "switch":
        rest["choices"] = ("on", "off")
    return Parameter(field, words, kind, meaning, least, **rest)


PARAMETERS: Final = (
    _setting("pull_mm", "How far the needle is pulled back to readjust."),
    _setting("push_mm", "The push before the next estimate; less than the pull."),
    _setting("initial_push_mm", "The length of the first push."),
    _setting("spacing_mm", "A push is made in pieces of this length.", 0.01),
    _setting(
        "review_mm",
        "After this much insertion, the rest of the plan is certified again for the newest "
        "estimate.",
        1e-3,
    ),
    _setting(
        "deviation_mm", "How far the tip may be off the plan, in the mean of the last measurements."
    ),
    _setting(
        "deviation_count", "The least number of measurements whose mean counts.", 1, kind="count"
    ),
    _setting("force_n", "The rise of the force that is an alarm.", 1e-6),
    _setting(
        "halt_force_n",
        "While the needle moves, the force may be this much more than expected.",
        1e-6,
    ),
    _setting("force_noise_n", "The standard deviation of a measured force."),
    _setting(
        "force_rise_n_per_mm", "The least rise of the force on the way towards a region.", 1e-6
    ),
    _setting(
        "felt_clearance_mm",
        "A needle that feels a region goes on while the force says that it is farther away.",
    ),
    _setting(
        "false_alarm",
        "The probability that noise alone stops a run, for force and deviation each.",
        1e-9,
        kind="ratio",
    ),
    _setting("overrun_mm", "How far the needle moves on after it was told to stop."),
    _setting(
        "force_sensing",
        "Whether the force is watched. If it is off, plans keep more clearance.",
        kind="switch",
    ),
    _setting("margins.clearance_mm", "A plan stays farther than this from critical regions."),
    _setting(
        "margins.detection_mm",
        "A plan stays farther than this from detection regions.",
        words="detection clearance",
    ),
    _setting(
        "margins.depth_mm",
        "A plan ends at least this deep in the last target.",
        words="depth in target",
    ),
    _setting("sensing_margin_mm", "The distance from an unknown region at which the force rises."),
    _setting("learned_radius_mm", "The radius of a critical region that is learned.", 0.01),
    _setting(
        "priors.position_mm",
        "Assumed standard deviation of each coordinate of the entry point.",
        is_above=True,
    ),
    _setting(
        "priors.heading_rad",
        "Assumed standard deviation of the heading at the entry.",
        is_above=True,
    ),
    _setting(
        "priors.bevel_rad",
        "Assumed standard deviation of the bevel's angle at the entry.",
        is_above=True,
    ),
    _setting(
        "priors.curvature_ratio",
        "Assumed standard deviation of the curvature, relative to the expected one.",
        is_above=True,
    ),
    _setting(
        "priors.roll_rad", "Assumed standard deviation of the error of each roll.", is_above=True
    ),
    _setting(
        "priors.noise_mm", "Assumed standard deviation of each measured coordinate.", is_above=True
    ),
    _setting(
        "priors.direction_rad", "Assumed standard deviation of a measured direction.", is_above=True
    ),
    _setting(
        "priors.curvature_drift",
        "Assumed change of the curvature over 10 mm, as a ratio; 0 if it stays the same.",
        kind="ratio",
    ),
    _setting("priors.turn_drift_rad", "Assumed turn of the bend plane over 10 mm without a roll."),
    _setting(
        "priors.lag_rad",
        "Assumed further error of each roll at a depth of 100 mm, as friction holds the shaft.",
    ),
    _setting(
        "priors.distortion_mm",
        "Assumed further error of each measured coordinate, about the same over 10 mm of a path.",
    ),
    _setting(
        "priors.first_ratio",
        "By how much more the needle bends on its first 10 mm, as a ratio.",
        words="prior first curvature",
    ),
    _setting(
        "priors.bite_mm",
        "Length that seems straight at the beginning of a channel that leaves another one.",
    ),
    _setting(
        "priors.shape_spacing_mm",
        "Places of a measured shape that are nearer to each other share their error.",
        0.1,
    ),
    _setting(
        "compensated_lag_rad",
        "The tip's lag at a depth of 100 mm, by which rolls go too far and come back; 0 for none.",
        words="lag compensation",
    ),
    _setting(
        "ranking",
        "How plans are ranked, the most important criterion first: clearance, reserve, rolls, "
        "length, target.",
        kind="words",
        choices=("clearance", "reserve", "rolls", "length", "target"),
    ),
    _setting(
        "pull_speed_ratio",
        "Pulling is faster than insertion by this factor.",
        0.01,
        words="pull speed ratio",
    ),
    _setting(
        "roll_rad_per_s",
        "The speed of rolls, to know how long a plan takes.",
        1e-3,
        words="roll speed",
    ),
    _setting("max_plans", "A synthesis lists at most this many plans.", 1, kind="count"),
    _setting(
        "engine_time_s", "A synthesis ends the run if the engine takes longer.", is_above=True
    ),
    _setting(
        "engine_memory_bytes", "A synthesis ends the run if the engine's states take more.", 1.0
    ),
    _setting(
        "guarantee",
        "Whether a strategy is followed as soon as one wins against all that the estimate leaves "
        "open.",
        kind="switch",
    ),
    _setting(
        "accept",
        "The least confidence with which a push stays clear of critical regions until it is looked "
        "at, and the tip is in the target.",
        kind="ratio",
        is_above=True,
        most=1.0,
        sample="0.98",
    ),
    _setting(
        "timeout_s",
        "Stop the run after this time on the needle's clock; if it is not given, after three "
        "straight insertions to the last target, but not before 120 s.",
        words="time limit",
        is_above=True,
        option="--timeout",
    ),
    _setting(
        "needle.noise_mm",
        "Simulated needle: standard deviation of each measured coordinate.",
        option="--noise",
    ),
    _setting(
        "needle.roll_rad",
        "Virtual needle: standard deviation of the angle of each roll.",
        words="roll error",
    ),
    _setting(
        "needle.radius_mm",
        "Simulated needle: the true radius of the motion circle, if the scene's is wrong.",
        words="true radius",
        is_above=True,
    ),
    _setting(
        "needle.radius_ratio",
        "Simulated needle: by how much its true radius is greater than the scene's.",
        -1.0,
        words="radius error",
        kind="percentage",
        is_above=True,
    ),
    _setting(
        "needle.bevel_rad",
        "Simulated needle: by which angle about the heading the true bevel differs from the "
        "scene's.",
        -math.pi,
        words="true bevel",
    ),
    _setting(
        "needle.lag_rad",
        "Phantom needle: the true lag of its tip at a depth of 100 mm, as friction holds the "
        "shaft; rolls make up for `lag compensation` only.",
        words="roll lag",
    ),
    _setting(
        "needle.latency_s",
        "Phantom needle: a measurement shows position and force as they were this long ago.",
        words="delay",
    ),
    _setting(
        "needle.whole_shape",
        "Phantom needle: whether places all along it are measured, and not its tip only.",
        kind="switch",
    ),
    _setting(
        "needle.seed",
        "Simulated needle: for all that is random in it; the same seed gives the same errors.",
        kind="count",
        option="--seed",
    ),
)
"""All settings, in the order in which they are listed."""

BY_WORDS: Final = {parameter.words: parameter for parameter in PARAMETERS}
"""The settings by their words in a file."""

BY_FIELD: Final = {parameter.field: parameter for parameter in PARAMETERS}
"""The settings by their fields."""
