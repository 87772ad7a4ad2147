"""The driver's settings: with scene, device and seed, they determine a run.

`ntagen.parameters` has how each of them is written in a file and on the command line.

If no source gives a value, the default is our choice; the docstring says so with "ours".
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Any, Final

from ntagen.drive.json_values import value_from_json
from ntagen.errors import InputError
from ntagen.needle.priors import Priors
from ntagen.parameters import NEEDLE, PARAMETERS, Value
from ntagen.plan.rank import DEFAULT_RANKING, parse_ranking
from ntagen.plan.synthesise import EngineSynthesiser, Margins
from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Settings:
    """The parameters of the driver.

    Attributes:
        initial_push_mm: The length of the first push, before there is a plan. The paper's virtual
            runs need 5.1 s for it and its fit, at 1 mm/s.
        spacing_mm: A push is made in pieces of this length, with a measurement after each. Ours:
            small compared with a detection margin of 2 to 3 mm.
        review_mm: After this much insertion, the rest of the plan is certified again, for the
            newest estimate; ours. Insertions without a look at the needle were at most 10 mm in
            Stanford's experiments.
        deviation_mm: The tip may be off the plan by this much, in the mean of the last
            measurements (`ntagen.drive.deviation`). Ours; the authors tried 0 to 10 mm.
        deviation_count: The least number of measurements whose mean counts, so that one bad
            measurement is not enough. With more noise, more of them count.
        force_sensing: Whether the force is watched. Without it, the driver relies on known regions
            only, and plans keep more distance from them (`ntagen.drive.reliance`).
        force_n: The rise of the force that must be felt (`ntagen.drive.force`). The authors used
            rises of 0.1 to 0.2 in an unknown unit.
        halt_force_n: A push is ended at once when the force is this much more than what is expected
            (`ntagen.drive.supervisor`). Friction in motion is more than friction at rest, so this
            is more than `force_n`; ours.
        force_noise_n: The standard deviation of a measured force; ours. 0 says that it has none,
            so that a force that stays the same is not that of a dead sensor.
        force_rise_n_per_mm: The least rise of the force on the way towards a region, once it rises;
            ours.
        felt_clearance_mm: A needle that feels a region goes on while the force says that it is
            farther than this from its surface. With the sensing margin or more, it stops as soon
            as it feels one, as in the paper.
        false_alarm: The probability that noise alone stops a run, for the force and for the
            deviation each; ours.
        overrun_mm: How far the needle moves on after it was told to stop. 0 for needles that are
            moved in steps (the virtual ones); 0.8 mm is enough for GRBL at 5 mm/s.
        pull_mm: The length by which the needle is pulled back to readjust. It is fixed, as in the
            paper; the value is ours.
        push_mm: The length of the push before the next estimate; less than `pull_mm`; ours.
        compensated_lag_rad: The lag of the tip at a depth of 100 mm for which rolls make up
            (`ntagen.drive.torsion`); 0 for none.
        pull_speed_ratio: Pulling in the open channel is faster than insertion by this factor, to
            know how long it takes; ours.
        roll_rad_per_s: The speed of rolls, to know how long a plan takes; ours.
        accept: A needle that does not bend exactly as planned is pushed only if it touches no known
            critical region with this confidence until the driver looks again (`ntagen.drive.tube`),
            and it has reached the last target if it is there with this confidence.
        guarantee: Whether such a needle is led by a strategy as soon as one wins against all that
            the estimate leaves open (`ntagen.drive.posterior`).
        timeout_s: A run ends after this time (paper, section 4); `ntagen.drive.configure` gives
            more for deep targets.
        sensing_margin_mm: The expected distance from an unknown region at which the force rises;
            ours.
        learned_radius_mm: The radius of a learned critical region; ours.
        margins: The margins that a plan must have in exact kinematics.
        ranking: The criteria by which the plan is chosen.
        priors: The assumptions of the estimator.
        max_plans: A synthesis lists at most this many plans.
        engine_time_s: The engine stops after this time of a synthesis.
        engine_memory_bytes: The engine stops when its states take this much.
    """

    initial_push_mm: float = 5.0
    spacing_mm: float = 0.25
    review_mm: float = 5.0
    deviation_mm: float = 1.5
    deviation_count: int = 3
    force_sensing: bool = True
    force_n: float = 0.1
    halt_force_n: float = 1.0
    force_noise_n: float = 0.01
    force_rise_n_per_mm: float = 0.5
    felt_clearance_mm: float = 3.0
    false_alarm: float = 0.001
    overrun_mm: float = 0.0
    pull_mm: float = 10.0
    push_mm: float = 2.0
    compensated_lag_rad: float = 0.0
    pull_speed_ratio: float = 5.0
    roll_rad_per_s: float = math.pi
    accept: float = 0.98
    guarantee: bool = True
    timeout_s: float = 120.0
    sensing_margin_mm: float = 3.0
    learned_radius_mm: float = 2.0
    margins: Margins = field(default_factory=Margins)
    ranking: tuple[str, ...] = DEFAULT_RANKING
    priors: Priors = field(default_factory=Priors)
    max_plans: int = 100_000
    engine_time_s: float = 60.0
    engine_memory_bytes: int = 2 << 30

    def __post_init__(self) -> None:
        """Refuses settings with which the driver cannot work.

        Raises:
            InputError: A value is not a number, or too large or too small.
        """
        for parameter in STEERING:
            value = value_of(self, parameter.field)
            is_number = isinstance(value, int | float)
            if not is_number and parameter.kind != "words":
                raise InputError(f"the setting {parameter.field} is {value!r}, which is no number")
            breach = parameter.breach(value)
            if breach is not None:
                raise InputError(f"{breach.message}, but this is {value!r}\nhint: {breach.hint}")
        if self.pull_mm - self.push_mm < _LEAST_PULLED_MM:
            raise InputError(
                f"`pull` ({self.pull_mm:g} mm) must be greater than `push` ({self.push_mm:g} mm) "
                f"by at least {_LEAST_PULLED_MM:g} mm: the needle must be pulled back"
            )
        parse_ranking(",".join(self.ranking))

    @property
    def counts_reserve(self) -> bool:
        """Whether the reserve comes first: for needles that do not bend exactly as planned."""
        return self.ranking[0] == "reserve"

    def with_spacing(self, spacing_mm: float) -> Settings:
        """The same settings with pushes of another length."""
        return dataclasses.replace(self, spacing_mm=spacing_mm)

    def to_json(self) -> dict[str, Any]:
        """The settings as JSON."""
        return dataclasses.asdict(self)

    @staticmethod
    def from_json(document: object) -> Settings:
        """The settings of such a document.

        Raises:
            InputError: The document has unknown or missing settings, or values of a wrong kind.
        """
        try:
            return value_from_json(document, Settings)
        except ValueError as error:
            raise InputError(f"the settings of the run cannot be read: {error}") from error


STEERING: Final = tuple(
    parameter for parameter in PARAMETERS if not parameter.field.startswith(f"{NEEDLE}.")
)
"""The settings of the driver; the others are those of the simulated needle."""

_LEAST_PULLED_MM: Final = 0.01


def value_of(settings: Settings, field: str) -> Any:  # noqa: ANN401  it depends on the field
    """The value of a field, which may be a part and a field with a dot between them."""
    return functools.reduce(getattr, field.split("."), settings)


def with_values(settings: Settings, values: Mapping[str, Value]) -> Settings:
    """The settings with other values of some fields.

    Raises:
        InputError: The driver cannot work with the settings.
    """
    changes: dict[str, Any] = {}
    for field_name, value in values.items():
        part, _, inner = field_name.rpartition(".")
        if part:
            changes[part] = replace(changes.get(part, getattr(settings, part)), **{inner: value})
        else:
            changes[inner] = value
    return replace(settings, **changes)


def engine_for(
    settings: Settings,
    listen: Callable[[], None] = lambda: None,
    *,
    keeps_strategy: bool = False,
) -> EngineSynthesiser:
    """The synthesiser that lists plans; see `EngineSynthesiser` for the arguments."""
    return EngineSynthesiser(
        margins=settings.margins,
        ranking=settings.ranking,
        max_plans=settings.max_plans,
        timeout_s=settings.engine_time_s,
        memory_bytes=settings.engine_memory_bytes,
        keeps_strategy=keeps_strategy,
        listen=listen,
    )
