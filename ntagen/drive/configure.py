"""The settings of a run, from three sources: defaults, then the file, then the command line.

The command line wins over the file, and the file over the defaults. Each value keeps its origin.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import field, fields, replace
from itertools import pairwise
from statistics import NormalDist
from typing import Final

from ntagen.drive.needles import Chosen, choose
from ntagen.drive.reliance import with_default_margins
from ntagen.drive.settings import STEERING, Settings, value_of, with_values
from ntagen.errors import InputError
from ntagen.needle.errors import Errors
from ntagen.needle.vectors import distance
from ntagen.parameters import NEEDLE, PARAMETERS, Given, Parameter, Value
from ntagen.scene import Scene
from ntagen.values import dataclass

COMMAND_LINE: Final = "command line"
"""The origin of a value that stands on the command line."""

DEFAULT: Final = "default"
"""The origin of a value that nobody gave."""

_RADIUS: Final = f"{NEEDLE}.radius_mm"
_RADIUS_ERROR: Final = f"{NEEDLE}.radius_ratio"
_WAYS: Final = 3.0
"""A run may take as long as so many insertions along the straight way to the last target, if that
is more than the usual limit: after a failure half way, the next plan may begin at the entry; ours.
"""

_NO_FORCE: Final = "follows from force sensing off"
_AS_NEEDLE: Final = "follows from the scene and the needle"


@dataclass(frozen=True, slots=True)
class Configuration:
    """The settings of a run and where they come from.

    Attributes:
        settings: The driver's settings.
        errors: The errors of a simulated needle.
        seed: The seed of these errors.
        origins: The origin of each value that is not a default, by its field.
        needle: The needle.
    """

    settings: Settings = field(default_factory=Settings)
    errors: Errors = field(default_factory=Errors)
    seed: int = 0
    origins: Mapping[str, str] = field(default_factory=dict)
    needle: Chosen = field(default_factory=lambda: choose("virtual", Errors()))

    def value(self, parameter: Parameter) -> Value | None:
        """The value of a setting."""
        part, _, name = parameter.field.partition(".")
        if part != NEEDLE:
            value: Value = value_of(self.settings, parameter.field)
            return value
        if name == "seed":
            return self.seed
        return self.needle.error(name)

    def origin(self, parameter: Parameter) -> str:
        """Where the value of a setting comes from."""
        return self.origins.get(parameter.field, DEFAULT)

    def rows(self) -> list[tuple[str, str, str]]:
        """All settings: words, value in its usual unit, origin."""
        return [
            (parameter.words, parameter.shown(self.value(parameter)), self.origin(parameter))
            for parameter in PARAMETERS
        ]


def configure(
    given: Iterable[Given], scene: Scene, known: str = "all", needle: str = "virtual"
) -> Configuration:
    """The configuration of values that were given; a later one wins over an earlier one.

    Args:
        given: The values of the file, then those of the command line.
        scene: The actual scene.
        known: The critical regions that the driver knows (`ntagen.drive.knowledge.told`).
        needle: The name of the needle (`ntagen.drive.needles`).

    Raises:
        InputError: The driver cannot work with these values together; the message has the origin
            of each. Or there is no needle of this name.
    """
    chosen = {one.parameter.field: one for one in given}
    origins = {name: one.origin for name, one in chosen.items()}
    values = {name: _exact(one) for name, one in chosen.items()}
    if {_RADIUS, _RADIUS_ERROR} <= chosen.keys():
        places = " and ".join(sorted({origins[_RADIUS], origins[_RADIUS_ERROR]}))
        raise InputError(
            "`radius error` and `true radius` both say what the true radius is\n"
            f"hint: leave out one of them\nnote: they are given here: {places}"
        )
    errors = Errors(
        **{
            one.name: values[f"{NEEDLE}.{one.name}"]
            for one in fields(Errors)
            if f"{NEEDLE}.{one.name}" in values
        }  # type: ignore[arg-type]
    )
    its_needle = choose(needle, errors)
    steering = {p.field: values[p.field] for p in STEERING if p.field in values}
    try:
        default = Settings()
        usual = its_needle.usual(replace(default, timeout_s=_limit_s(default, scene)), scene)
        for p in STEERING:
            if p.field not in origins and value_of(usual, p.field) != value_of(default, p.field):
                origins[p.field] = _AS_NEEDLE
        settings = with_values(usual, steering)
        settings = _fitting(settings, its_needle, scene, known, origins)
        settings = _with_margins(settings, origins)
        require_knowable(settings, scene, whole_shape=its_needle.whole_shape)
    except InputError as error:
        said = [f"`{one.parameter.words}`: {one.origin}" for one in chosen.values()]
        raise InputError("\n".join([str(error), *(f"note: {line}" for line in said)])) from error
    seed = values.get(f"{NEEDLE}.seed", 0)
    whole_seed = int(seed) if isinstance(seed, int) else 0
    return Configuration(settings, errors, whole_seed, origins, its_needle)


def _limit_s(default: Settings, scene: Scene) -> float:
    """The time limit of a run if nobody gives one."""
    places = [scene.needle.tip.position_mm, *(target.center_mm for target in scene.targets)]
    way_mm = sum(distance(one, other) for one, other in pairwise(places))
    return max(default.timeout_s, math.ceil(_WAYS * way_mm / scene.needle.speed_mm_per_s))


def _exact(given: Given) -> Value:
    """The value in the type of its field: sizes and counts are whole."""
    if given.parameter.kind in ("data", "count") and isinstance(given.value, int | float):
        return round(given.value)
    return given.value


def _fitting(
    settings: Settings, needle: Chosen, scene: Scene, known: str, origins: dict[str, str]
) -> Settings:
    """The settings that fit the needle and the scene (`Chosen.fitting`).

    Priors that somebody gave stay: a driver with wrong assumptions can be tried.
    """
    fitting = needle.fitting(settings, scene, known)
    kept = {}
    for parameter in STEERING:
        name = parameter.field
        if value_of(fitting, name) == value_of(settings, name):
            continue
        if name.startswith("priors.") and name in origins:
            kept[name] = value_of(settings, name)
        else:
            given = f" (given: {origins[name]})" if name in origins else ""
            origins[name] = f"{_AS_NEEDLE}{given}"
    return with_values(fitting, kept)


def _with_margins(settings: Settings, origins: dict[str, str]) -> Settings:
    """The settings with the margins that they need, except those that were given."""
    safe = with_default_margins(settings, origins)
    if safe != settings:
        origins["margins.clearance_mm"] = _NO_FORCE
    return safe


def require_knowable(settings: Settings, scene: Scene, *, whole_shape: bool = False) -> None:
    """Refuses a last target in which no tip is with the confidence that is asked for.

    Only needles that do not bend exactly as planned need the confidence, and only where the target
    keeps still. At best, the needle bends as expected, is never rolled or pulled back, and is
    measured all along the way. What the estimator then knows of the tip at the target is not
    exceeded in a run: in random tasks with the phantom needle, runs end with the same standard
    deviation, or up to 7 % more.

    Args:
        settings: How to drive.
        scene: The actual scene.
        whole_shape: Whether places all along the needle are measured.

    Raises:
        InputError: The target is too small.
    """
    target = scene.targets[-1]
    if not settings.counts_reserve or target.motion is not None:
        return
    depth_mm, std_mm = target.shape.depth_mm, _best_std_mm(settings, scene, whole_shape)
    normal = NormalDist()
    needed_mm, confidence = normal.inv_cdf(settings.accept) * std_mm, normal.cdf(depth_mm / std_mm)
    if depth_mm >= needed_mm:
        return
    raise InputError(
        f"the target '{target.name}' is too small for what measures the tip: its middle is "
        f"{depth_mm:.3g} mm deep, and the tip is known to {std_mm:.3g} mm at best (one standard "
        f"deviation); it would be in there with a confidence of {confidence:.3f}, and "
        f"{settings.accept:g} is asked for\n"
        f"hint: a target that is {math.ceil(100.0 * needed_mm) / 100.0:g} mm deep would do, "
        f"a tracker with less noise, or --set 'accept {math.floor(100.0 * confidence) / 100.0:g}'"
    )


def _best_std_mm(settings: Settings, scene: Scene, whole_shape: bool) -> float:
    """The standard deviation of the tip at the last target, in the direction known worst."""
    # They take NumPy, which a first plan does without.
    from ntagen.needle.estimate import Estimator
    from ntagen.needle.measurement import Measurement
    from ntagen.needle.path import Path, sample_poses

    tip, radius_mm = scene.needle.tip, scene.needle.radius_mm
    away_mm = math.dist(tip.position_mm, scene.targets[-1].center_mm)
    length_mm = max(away_mm, settings.initial_push_mm)
    count = max(1, round(length_mm / settings.spacing_mm))
    estimator, path = Estimator(tip, radius_mm, settings.priors), Path(tip)
    for number in range(count):
        path = path.push(radius_mm, length_mm / count)
        estimator.push(length_mm / count)
        places = sample_poses(path.arcs, settings.priors.shape_spacing_mm) if whole_shape else []
        shape = tuple(pose.position_mm for pose in places)
        estimator.measure(Measurement(float(number), path.tip.position_mm, 0.0, shape=shape))
    return estimator.estimate().position_std_mm(0.0)
