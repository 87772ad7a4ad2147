"""The driver's settings: with scene, device and seed, they determine a run.

If no source gives a value, the default is our choice; the docstring says so with "ours".
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Final

from ntagen.drive.json_values import value_from_json
from ntagen.errors import InputError
from ntagen.needle.estimate import Priors
from ntagen.plan.rank import DEFAULT_RANKING, parse_ranking
from ntagen.plan.synthesise import Margins


@dataclass(frozen=True, slots=True)
class Settings:
    """The parameters of the driver.

    Attributes:
        initial_push_mm: The length of the first push, before there is a plan. The paper's virtual
            runs need 5.1 s for it and its fit, at 1 mm/s.
        spacing_mm: A push is made in pieces of this length, with a measurement after each. Ours:
            small compared with a detection margin of 2 to 3 mm.
        deviation_mm: The measured position may differ this much from the prediction. Ours; the
            authors tried 0 to 10 mm.
        deviation_count: The number of measurements in a row that must differ for an alarm, so that
            one bad measurement is not enough.
        force_n: A force above this is an alarm. The authors used rises of 0.1 to 0.2 in an unknown
            unit.
        pull_mm: The length by which the needle is pulled back to readjust. It is fixed, as in the
            paper; the value is ours.
        push_mm: The length of the push before the next estimate; less than `pull_mm`; ours.
        timeout_s: A run ends after this time (paper, section 4).
        sensing_margin_mm: The expected distance from an unknown region at which the force rises;
            ours.
        learned_radius_mm: The radius of a learned critical region; ours.
        margins: The margins that a plan must have in exact kinematics.
        ranking: The criteria by which the plan is chosen.
        priors: The assumptions of the estimator.
    """

    initial_push_mm: float = 5.0
    spacing_mm: float = 0.25
    deviation_mm: float = 1.5
    deviation_count: int = 3
    force_n: float = 0.1
    pull_mm: float = 10.0
    push_mm: float = 2.0
    timeout_s: float = 120.0
    sensing_margin_mm: float = 3.0
    learned_radius_mm: float = 2.0
    margins: Margins = field(default_factory=Margins)
    ranking: tuple[str, ...] = DEFAULT_RANKING
    priors: Priors = field(default_factory=Priors)

    def __post_init__(self) -> None:
        """Refuses settings with which the driver cannot work.

        Raises:
            InputError: A value is not a number, or too large or too small.
        """
        for name, value in _numbers(self):
            least = _LEAST.get(name, 0.0)
            if not isinstance(value, int | float) or not least <= value <= _LARGEST:
                raise InputError(
                    f"the setting {name} is {value!r}, which is not allowed\n"
                    f"hint: choose a number from {least:g} to {_LARGEST:g}"
                )
        if self.pull_mm - self.push_mm < _LEAST["spacing_mm"]:
            raise InputError(
                "pull_mm must be greater than push_mm by at least "
                f"{_LEAST['spacing_mm']:g} mm: the needle must be pulled back"
            )
        parse_ranking(",".join(self.ranking))

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


_LARGEST: Final = 1e6
"""The largest value of any setting, in its unit."""

_LEAST: Final = {
    "spacing_mm": 0.01,
    "learned_radius_mm": 0.01,
    "deviation_count": 1.0,
    **dict.fromkeys((field.name for field in dataclasses.fields(Priors)), 1e-12),
    # Without drift or lag the needle is as the paper has it.
    **dict.fromkeys(("curvature_drift", "turn_drift_rad", "lag_rad"), 0.0),
}
"""The least values of the settings that cannot be 0."""


def _numbers(settings: Settings) -> Iterator[tuple[str, object]]:
    """All numbers by name, including those of its parts."""
    for part in (settings, settings.margins, settings.priors):
        for one in dataclasses.fields(part):
            if one.name not in ("margins", "priors", "ranking"):
                yield one.name, getattr(part, one.name)
