"""The simulated needles that can be chosen, driven by the real controller."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from ntagen.drive.configure import configure
from ntagen.drive.needles import NAMES, choose
from ntagen.drive.records import Measured
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.errors import InputError
from ntagen.needle.phantom_parameters import PhantomParameters
from ntagen.needle.virtual import Errors
from ntagen.parameters import BY_FIELD, BY_WORDS, Given
from ntagen.plan.rank import ROBUST_RANKING
from ntagen.scene import Scene, Tissue, Vector
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


def test_only_the_virtual_needle_deviates_by_the_chances_of_the_tissue() -> None:
    chance = replace(OPEN, tissue=Tissue("stochastic", 0.1, 0.2, 0.3))

    def ends(of: Scene, name: str) -> set[Vector]:
        make = choose(name, Errors()).made_in(of)
        assert make is not None
        found = set()
        for seed in range(3):
            needle = make(of.needle, (), seed)
            needle.push(20.0)
            found.add(needle.true_tip.position_mm)
        return found

    assert len(ends(OPEN, "virtual")) == 1
    assert len(ends(chance, "virtual")) == 3
    assert ends(chance, "phantom") == ends(OPEN, "phantom")


def test_the_estimator_expects_the_spreads_of_the_tissue() -> None:
    chance = replace(OPEN, tissue=Tissue("stochastic", 0.3, 0.4, 0.3))
    settings = choose("virtual", Errors()).fitting(Settings(), chance, "all")
    assert settings.priors.curvature_ratio >= 0.3
    assert settings.priors.roll_rad >= 0.4


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


def given(words: str, text: str) -> Given:
    return Given(BY_WORDS[words], BY_WORDS[words].parse(text), "row")


def test_the_phantom_errs_as_it_is_told_and_is_driven_as_usual() -> None:
    told = [given("noise", "0.5mm"), given("roll lag", "60deg"), given("delay", "200ms")]
    configuration = configure(told, OPEN, needle="phantom")
    parameters = configuration.needle.parameters
    assert parameters is not None
    assert parameters.sensing.noise_mm == 0.5
    assert parameters.sensing.latency_s == 0.2
    assert parameters.torsion.lag_rad == pytest.approx(math.radians(60.0))
    # The driver was calibrated to the noise; rolls make up for the usual lag, not for this one.
    assert configuration.settings.priors.noise_mm == pytest.approx(0.5, abs=1e-3)
    assert configuration.settings.compensated_lag_rad == pytest.approx(math.radians(45.0))
    shown = {words: value for words, value, _ in configuration.rows()}
    assert (shown["noise"], shown["roll lag"], shown["delay"]) == ("0.5 mm", "60 deg", "0.2 s")


def test_settings_show_what_a_needle_has_by_itself() -> None:
    for name, expected in (("phantom", ("0.08 mm", "45 deg")), ("virtual", ("0 mm", "0 deg"))):
        shown = {words: value for words, value, _ in configure([], OPEN, needle=name).rows()}
        assert (shown["noise"], shown["roll lag"]) == expected


@pytest.mark.parametrize("delay_s", [0.0, 0.5, 2.0])
def test_a_delayed_measurement_shows_where_the_needle_was(delay_s: float) -> None:
    told = [given("delay", f"{delay_s} s"), given("noise", "0")]
    make = configure(told, OPEN, needle="phantom").needle.make
    assert make is not None
    needle = make(OPEN.needle, (), 3)
    needle.push(10.0)
    speed_mm_per_s = OPEN.needle.speed_mm_per_s
    behind_mm = needle.true_tip.position_mm[1] - needle.measure().position_mm[1]
    # What is left are the distortion of the tracker and the bend of the way.
    assert behind_mm == pytest.approx(-delay_s * speed_mm_per_s, abs=0.4)
    needle.wait(delay_s)
    still_mm = needle.true_tip.position_mm[1] - needle.measure().position_mm[1]
    assert still_mm == pytest.approx(0.0, abs=0.4)


def test_a_radius_error_is_relative_to_the_scene_and_excludes_a_true_radius() -> None:
    wider = configure([given("radius error", "-20%")], OPEN)
    true = wider.errors.true_needle(OPEN.needle)
    assert true.radius_mm == pytest.approx(0.8 * OPEN.needle.radius_mm)
    both = [given("radius error", "10%"), given("true radius", "33mm")]
    with pytest.raises(InputError, match="both say what the true radius is"):
        configure(both, OPEN)


@pytest.mark.parametrize(
    ("name", "ignored"),
    [
        ("virtual", {"roll lag", "delay", "whole shape"}),
        ("phantom", {"roll error"}),
        ("grbl+sim", {"roll error"}),
        (
            "grbl:/dev/x",
            {w for w, p in BY_WORDS.items() if p.field.startswith("needle.")} - {"seed"},
        ),
    ],
)
def test_which_errors_mean_nothing_to_a_needle(name: str, ignored: set[str]) -> None:
    needle = choose(name, Errors())
    assert {words for words, one in BY_WORDS.items() if needle.ignores(one.field)} == ignored
