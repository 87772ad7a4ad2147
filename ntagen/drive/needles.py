"""The needles by name, each with its settings and with what a log says about it."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Final

from ntagen.drive.fitting import overrun_mm, settings_for, settings_for_phantom
from ntagen.drive.force import stop_force_n
from ntagen.drive.settings import Settings
from ntagen.errors import InputError
from ntagen.extensions import DEVICES, described, names
from ntagen.needle.errors import Errors
from ntagen.parameters import NEEDLE
from ntagen.plan.rank import ROBUST_RANKING
from ntagen.scene import Scene
from ntagen.values import dataclass

if TYPE_CHECKING:
    from ntagen.drive.simulate import Maker
    from ntagen.needle.phantom_parameters import PhantomParameters

NAMES: Final = ("virtual", "phantom", "grbl+sim")
"""The simulated needles; the last is a phantom behind an emulated stepper controller."""

LAB: Final = "lab"
"""A phantom needle in a lab of its own (`ntagen.lab`): it is driven as a real needle is."""

REAL: Final = "grbl"
"""A needle behind a GRBL controller: `grbl:PORT`, or `grbl` for the port in the task."""

ROS: Final = "ros"
"""A needle behind a stage that `ntagen ros` commands over topics."""

_REAL_ROLL_RAD_PER_S: Final = 0.5 * math.pi
"""A real needle is rolled at half the speed of simulated ones; ours."""

_NOT_VIRTUAL: Final = frozenset({"lag_rad", "latency_s", "whole_shape"})
"""The virtual needle turns as its base does, and is measured as it is now."""

_NOT_PHANTOM: Final = frozenset({"roll_rad"})
"""Rolls of the phantom's base are exact; what its tip does follows from the friction."""

_SURE_RISE_RATIO: Final = 0.9
"""Near a region, the force rises by at least this part of what was measured before; ours."""

_FELT_CLEARANCE_MM: Final = 0.75
"""A needle whose force was measured before passes a region that it feels at this distance; ours:
the way between two readings, and as much again for each of noise and latency."""

_HALT_ABOVE_N: Final = 0.5
"""A push is ended at once at this much more than the rise at which the needle stops after it."""

_LAYER_SIGMAS: Final = 3.0
"""Differences of layers are no alarm up to this many standard deviations; ours."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """A needle that was chosen.

    Attributes:
        name: Its name.
        errors: The errors of a simulated needle.
        parameters: The parameters of the phantom needle, with these errors; None for another one.
    """

    name: str
    errors: Errors
    parameters: PhantomParameters | None = None

    @property
    def is_real(self) -> bool:
        """Whether it is no simulation."""
        return self.name not in (*NAMES, LAB)

    @property
    def whole_shape(self) -> bool:
        """Whether it is known before a run that its whole shape is measured."""
        return self.parameters is not None and self.parameters.sensing.whole_shape

    @property
    def kind(self) -> str:
        """What it is, in words."""
        if self.is_real:
            return "a real needle"
        return "the virtual needle" if self.parameters is None else "a phantom needle"

    def ignores(self, name: str) -> bool:
        """Whether a setting, by its field, is an error that means nothing to this needle."""
        part, _, error = name.partition(".")
        if part != NEEDLE or error == "seed":
            return False
        if self.is_real:
            return True
        return error in (_NOT_VIRTUAL if self.parameters is None else _NOT_PHANTOM)

    def error(self, name: str) -> float | bool | None:
        """An error of the needle by its field of `Errors`; None if it is as in the scene."""
        if self.parameters is not None:
            sensing, torsion = self.parameters.sensing, self.parameters.torsion
            own: dict[str, float | bool] = {"noise_mm": sensing.noise_mm}
            own["latency_s"] = sensing.latency_s
            own["lag_rad"] = torsion.lag_rad
            own["whole_shape"] = sensing.whole_shape
        else:
            own = dict.fromkeys(("noise_mm", "latency_s", "lag_rad"), 0.0)
            own["noise_mm"] = self.errors.noise_mm or 0.0
        value: float | bool | None = own[name] if name in own else getattr(self.errors, name)
        return value

    @property
    def make(self) -> Maker | None:
        """Makes it; None for a real needle and a lab. What it takes is imported now."""
        if self.is_real or self.name == LAB:
            return None
        from ntagen.drive.simulate import phantom, virtual
        from ntagen.drive.stepped import stepped

        if self.parameters is None:
            return virtual(self.errors)
        make = phantom(self.parameters)
        return make if self.name == "phantom" else stepped(make)

    def made_in(self, scene: Scene) -> Maker | None:
        """As `make`; a virtual needle in a tissue with chance deviates as the tissue says."""
        if self.name != "virtual" or not scene.tissue.is_stochastic:
            return self.make
        from ntagen.drive.simulate import answering

        return answering(self.errors, scene, "drawn")

    def usual(self, settings: Settings, scene: Scene) -> Settings:
        """The settings with which this needle is driven if nobody says otherwise."""
        if self.is_real or self.name == LAB:
            way_mm = overrun_mm(scene.needle.speed_mm_per_s)
            settings = replace(
                settings,
                overrun_mm=way_mm,
                roll_rad_per_s=_REAL_ROLL_RAD_PER_S,
                ranking=ROBUST_RANKING,
            )
        if self.is_real or self.parameters is None:
            return settings
        # Half of the rise to be detected is slack: layers never add to the sum of the test.
        layers_n = self.parameters.forces.layers_n(_LAYER_SIGMAS)
        settings = replace(
            settings,
            compensated_lag_rad=_usual_phantom().torsion.lag_rad,
            force_n=max(settings.force_n, 2.0 * layers_n),
            force_rise_n_per_mm=_SURE_RISE_RATIO * self.parameters.forces.region_n_per_mm,
            felt_clearance_mm=_FELT_CLEARANCE_MM,
            ranking=ROBUST_RANKING,
        )
        halt_n = stop_force_n(settings) + _HALT_ABOVE_N
        return replace(settings, halt_force_n=max(settings.halt_force_n, halt_n))

    def fitting(self, settings: Settings, scene: Scene, known: str) -> Settings:
        """The settings that fit this needle and the scene, as after a calibration.

        Raises:
            InputError: No push is short enough to feel a hidden region before it is pierced.
        """
        if self.parameters is None:
            return settings_for(settings, self.errors, scene, known)
        return settings_for_phantom(settings, self.parameters, scene, known)

    def facts(self) -> dict[str, Any]:
        """What a log says about the needle."""
        facts: dict[str, Any] = {"needle": self.name}
        if self.parameters is not None:
            facts["phantom"] = asdict(self.parameters)
        return facts


def choose(name: str, errors: Errors) -> Chosen:
    """The needle of a name.

    Args:
        name: One of `NAMES`, `LAB`, or a real needle: `REAL`, or the name of a plugin, both perhaps
            with a colon and more.
        errors: The errors of a simulated needle.

    Raises:
        InputError: There is no needle of this name.
    """
    kind, _, _ = name.partition(":")
    if name in (*NAMES, LAB) and name != "virtual":
        return Chosen(name, errors, errors.true_phantom(_usual_phantom()))
    if name in ("virtual", ROS) or kind == REAL or kind in names(DEVICES):
        return Chosen(name, errors)
    raise InputError(
        f"there is no needle '{name}'\n"
        f"hint: choose from {', '.join(sorted(NAMES))}, grbl:PORT; installed plugins: "
        f"{described(DEVICES)}"
    )


def _usual_phantom() -> PhantomParameters:
    from ntagen.needle.phantom_parameters import PhantomParameters

    return PhantomParameters()
