"""Millimetres to integer units."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ntagen.errors import InputError
from ntagen.render.fixed_point import LARGEST_UNITS, c_literal, fixed_point


@given(st.floats(-200.0, 200.0), st.integers(1, 1_000_000))
def test_the_error_is_at_most_half_a_unit(value: float, resolution: int) -> None:
    units = fixed_point(value, resolution, "it")
    assert abs(Fraction(value) - Fraction(units, resolution)) <= Fraction(1, 2 * resolution)


@given(st.integers(-LARGEST_UNITS, LARGEST_UNITS), st.integers(1, 10_000))
def test_a_literal_means_its_units(units: int, resolution: int) -> None:
    assert eval(c_literal(units, resolution), {"_SI_": resolution}) == units


@pytest.mark.parametrize(
    ("units", "text"), [(0, "0"), (1000, "1*_SI_"), (-25_000, "-25*_SI_"), (-25_500, "-25500")]
)
def test_literals_are_whole_millimetres_where_they_can(units: int, text: str) -> None:
    assert c_literal(units, 1000) == text


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 268_436.0, -1e300])
def test_what_does_not_fit_is_refused_by_name(value: float) -> None:
    with pytest.raises(InputError, match="the radius of C1"):
        fixed_point(value, 1000, "the radius of C1")
