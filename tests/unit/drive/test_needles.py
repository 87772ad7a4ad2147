"""The simulated needles that can be chosen, driven by the real controller."""

from __future__ import annotations

import math

import pytest

from ntagen.drive.configure import configure
from ntagen.drive.needles import NAMES, choose
from ntagen.drive.records import Measured
from ntagen.drive.simulate import simulate
from ntagen.errors import InputError
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.virtual import Errors
from ntagen.parameters import BY_FIELD, Given
from ntagen.plan.rank import ROBUST_RANKING
from tests.drive.runs import Diary
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import scene, sphere

OPEN = scene(targets=[sphere("T1", "target", (0.0, -12.0, 0.0), 5.0)], name="open")
"""A near target with nothing in the way."""


@pytest.mark.parametrize("name", NAMES)
def test_each_needle_can_be_driven(name: str) -> None:
    configuration = configure([], OPEN, needle=name)
    diary = Diary()
    result = simulate(
        OPEN,
        oracle_synthesis,
        configuration.settings,
        diary,
        make=configuration.needle.make,
        seed=1,
    )
    assert result.ended.outcome == "target reached"
    assert result.target_distance_mm < 0.0
    assert diary.of(Measured)
    assert result.pierced


def test_the_phantom_is_driven_with_settings_for_its_errors() -> None:
    configuration = configure([], OPEN, needle="phantom")
    settings = configuration.settings
    assert settings.compensated_lag_rad == pytest.approx(math.radians(45.0))
    assert "needle" in configuration.origins["compensated_lag_rad"]
    assert settings.priors.curvature_drift > 0.0
    assert settings.priors.turn_drift_rad > 0.0
    off = Given(BY_FIELD["compensated_lag_rad"], 0.0, "command line")
    # Tissue has layers, and bends a needle less well than a plan says.
    layers_n = PhantomParameters().forces.layers_n(3.0)
    assert 0.1 < layers_n == pytest.approx(0.5 * configuration.settings.force_n)
    assert configuration.settings.ranking == ROBUST_RANKING
    uncompensated = configure([off], OPEN, needle="phantom").settings
    assert uncompensated.compensated_lag_rad == 0.0
    assert 0.0 < settings.priors.lag_rad < 0.5 * uncompensated.priors.lag_rad


def test_the_virtual_needle_needs_no_compensation() -> None:
    assert configure([], OPEN).settings.compensated_lag_rad == 0.0


def test_the_log_says_which_needle_it_was() -> None:
    facts = choose("phantom", Errors()).facts()
    assert facts["needle"] == "phantom"
    assert facts["phantom"]["torsion"]["lag_rad"] == pytest.approx(math.pi / 4)
    assert choose("virtual", Errors()).facts() == {"needle": "virtual"}


def test_another_name_is_refused_with_the_names_that_there_are() -> None:
    with pytest.raises(InputError, match=r"choose from grbl\+sim, phantom, virtual"):
        configure([], OPEN, needle="real")
