"""The rules for the values of a scene, wherever the scene comes from.

A scene that is made in Python is checked when it is made (`ntagen.scene`). For a scene in a file,
all mistakes are reported with their places (`ntagen.nsl.build`). Each rule is a function that
returns what is wrong, or None. Rules about the positions of regions are not here: a driver that
learns may find that it is inside a critical region.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Final

from ntagen.units import deg_from_rad
from ntagen.values import dataclass

if TYPE_CHECKING:
    from fractions import Fraction

LARGEST_UNITS: Final = 2**28
"""The largest absolute value that a scene may put into the model, in units. The model adds and
subtracts such numbers in 32 bits (a centre is a tip minus a radius, a distance is a difference), so
three bits are kept free."""

MAX_ROLLS: Final = 100
"""A plan has at most this many rolls."""

LARGEST_PART: Final = 0.5
"""The curvature is wrong by at most this part: with more, a plan would be for another needle."""

PAPER_QUERIES: Final = {
    "PathExists": "E<> Checker.Final_TR_Reached",
    "ReachFinalTR": "control: A<> Checker.Final_TR_Reached",
}
"""The queries of section 2 of the paper, which every model has. The paper names only the second;
the name of the first is ours."""

UNIT_TOLERANCE: Final = 1e-6
"""How far the length of a direction may be from 1, and the cosine of a right angle from 0; decimals
in a file are rounded."""

WHOLE_TOLERANCE: Final = 1e-9
"""How far a computed number may be from a whole number to count as whole."""


@dataclass(frozen=True, slots=True)
class Breach:
    """A value breaks a rule.

    Attributes:
        rule: The name of the rule, which is also the name of a diagnostic.
        message: What is wrong: one line, lower case, no full stop.
        hint: How to fix it.
    """

    rule: str
    message: str
    hint: str | None = None


def finite(values: Iterable[float], what: str) -> Breach | None:
    """All values are finite numbers."""
    for value in values:
        if not isinstance(value, int | float) or not math.isfinite(value):
            return Breach("not-a-number", f"{what} is {value}, which is not a finite number")
    return None


def positive(value: float, what: str, rule: str = "radius-not-positive") -> Breach | None:
    """A value is greater than 0."""
    return None if value > 0.0 else Breach(rule, f"{what} must be greater than 0")


def not_negative(value: float, what: str, rule: str = "distance-negative") -> Breach | None:
    """A value is at least 0."""
    return None if value >= 0.0 else Breach(rule, f"{what} cannot be negative")


def part(value: float, what: str) -> Breach | None:
    """A part of a whole is at least 0 and at most a half."""
    if 0.0 <= value <= LARGEST_PART:
        return None
    return Breach(
        "tissue-out-of-range",
        f"{what} must be from 0 to {LARGEST_PART:.0%}, but this is {100.0 * value:.4g}%",
        "write for example `curvature 10 %`",
    )


def roll_error(value_rad: float) -> Breach | None:
    """A roll goes wrong by less than a quarter of a turn."""
    if 0.0 <= value_rad < 0.5 * math.pi:
        return None
    return Breach(
        "tissue-out-of-range",
        f"the roll error must be from 0 to less than 90 deg, but this is "
        f"{deg_from_rad(value_rad):.4g} deg",
        "write for example `roll 5 deg`",
    )


def unit_vector(vector: Sequence[float], what: str) -> Breach | None:
    """A direction has the length 1."""
    length = math.hypot(*vector)
    if abs(length - 1.0) <= UNIT_TOLERANCE:
        return None
    return Breach(
        "direction-not-unit",
        f"{what} must be a vector of length 1, but its length is {length:.6g}",
        "divide it by its length" if length > 0.0 else "give it a direction",
    )


def direction(vector: Sequence[float], what: str, hint: str) -> Breach | None:
    """A direction is not the zero vector."""
    return None if any(vector) else Breach("direction-zero", f"{what} has no direction", hint)


def right_angle(heading: Sequence[float], bevel: Sequence[float]) -> Breach | None:
    """Two directions of length 1 are at right angles."""
    cosine = math.fsum(a * b for a, b in zip(heading, bevel, strict=True))
    if abs(cosine) <= UNIT_TOLERANCE:
        return None
    angle_deg = deg_from_rad(math.acos(max(-1.0, min(1.0, cosine))))
    return Breach(
        "bevel-not-perpendicular",
        f"heading and bevel must be at right angles, but the angle is {angle_deg:.4g} deg",
    )


def roll(angle_rad: float) -> Breach | None:
    """A roll is by whole degrees, more than 0 and less than 360."""
    degrees = deg_from_rad(angle_rad)
    if not WHOLE_TOLERANCE < degrees < 360.0 - WHOLE_TOLERANCE:
        wrapped = degrees % 360.0
        return Breach(
            "roll-out-of-range",
            f"a roll must be more than 0 and less than 360 deg, but this is {degrees:g} deg",
            f"write {wrapped:g} deg" if 0.0 < wrapped < 360.0 else "remove it",
        )
    if abs(degrees - round(degrees)) > WHOLE_TOLERANCE:
        return Breach(
            "roll-not-whole-degrees",
            f"a roll must be a whole number of degrees, but this is {degrees:.6g} deg",
            f"write {max(1, min(359, round(degrees)))} deg",
        )
    return None


def spin(fraction: float) -> Breach | None:
    """A needle spins in more than none and less than all of the way."""
    if WHOLE_TOLERANCE < fraction < 1.0 - WHOLE_TOLERANCE:
        return None
    return Breach(
        "spin-out-of-range",
        "a spun fraction must be more than 0 % and less than 100 %, but this is "
        f"{100.0 * fraction:.6g} %",
        f"write {fraction:g} %"
        if 1.0 < fraction < 100.0
        else "remove it: plans that do not spin the needle are always looked for"
        if fraction == 0.0
        else "write for example `spin 90 %`, after which the needle is nearly straight",
    )


def spin_repeated(fractions: Sequence[float], index: int) -> Breach | None:
    """A spun fraction is none of those before it."""
    fraction = fractions[index]
    if all(abs(fraction - other) > WHOLE_TOLERANCE for other in fractions[:index]):
        return None
    return Breach(
        "spin-repeated", f"{100.0 * fraction:.6g} % is written twice", "remove one of the two"
    )


def spin_possible(kind: str, *, is_moving: bool) -> Breach | None:
    """Plans that spin the needle are made in static tissue in which no region moves.

    Args:
        kind: That of the tissue.
        is_moving: Whether regions move.
    """
    if kind != "static":
        return Breach(
            "spin-misused",
            f"a needle that spins, and a tissue that is {kind}, cannot be in one task",
            "write `tissue static`, or leave `spin` out",
        )
    if is_moving:
        return Breach(
            "spin-misused",
            "a needle that spins, and regions that move, cannot be in one task",
            "make the regions as large as where they get, or leave `spin` out",
        )
    return None


def roll_count(count: int) -> Breach | None:
    """A plan has from 0 to 100 rolls."""
    if isinstance(count, int) and 0 <= count <= MAX_ROLLS:
        return None
    return Breach(
        "roll-count-out-of-range",
        f"the number of rolls must be from 0 to {MAX_ROLLS}, but this is {count:g}",
    )


def resolution(per_mm: float) -> Breach | None:
    """The fixed-point scale is a whole number that fits into the model."""
    whole = max(1, round(per_mm))
    if per_mm < 1.0 - WHOLE_TOLERANCE or abs(per_mm - whole) > WHOLE_TOLERANCE * whole:
        return Breach(
            "resolution-not-whole",
            f"the resolution must be a whole number per mm, at least 1,"
            f" but this is {per_mm:g} per mm",
            f"write `{whole} per mm`",
        )
    if whole > LARGEST_UNITS:
        return Breach(
            "value-out-of-range",
            f"the resolution does not fit: it is at most {LARGEST_UNITS} per mm",
            "write for example `1000 per mm`",
        )
    return None


def fits(length_mm: float, per_mm: int, what: str) -> Breach | None:
    """A length fits into the model's numbers."""
    largest_mm = LARGEST_UNITS / per_mm
    if abs(length_mm) <= largest_mm:
        return None
    return Breach(
        "value-out-of-range",
        f"{what} does not fit: at {per_mm} per mm the model can represent at most "
        f"{largest_mm:.6g} mm",
        "make it smaller, or the resolution coarser",
    )


def visible(length_mm: float, per_mm: int, what: str) -> Breach | None:
    """A length that fits is at least one unit of the model."""
    if units_of(length_mm, per_mm) >= 1:
        return None
    return Breach(
        "value-too-small",
        f"{what} is {length_mm:g} mm, which is rounded to 0 at a resolution of {per_mm} per mm",
        "make it larger, or the resolution finer",
    )


MOST_ENTRIES: Final = 2**22
"""All tables of distances of a model together have at most so many entries."""


def table_fits(entries: int) -> Breach | None:
    """The tables of distances of all shapes from files fit into a model."""
    if entries <= MOST_ENTRIES:
        return None
    return Breach(
        "image-too-large",
        f"the shapes from files have {entries:,} distances together,"
        f" more than the {MOST_ENTRIES:,} that a model can have",
        "write a coarser `grid` for some of them",
    )


def motion(
    step_s: float, speed_mm_per_s: float, radius_mm: float, per_mm: int, *, swept: bool
) -> Breach | None:
    """One push turns the tip by at least one unit of the model; if swept, by less than half a turn.

    If the turn were rounded to 0, the tip would stand still while the needle is inserted for ever.
    The radius and the length of a push are at least one unit, as other rules ensure.
    """
    dt, velocity_mm, _ = time_units(step_s, speed_mm_per_s)
    insertion = dt * units_of(velocity_mm, per_mm)
    circle = units_of(radius_mm, per_mm)
    if insertion * per_mm < circle:
        return Breach(
            "step-too-short",
            f"a push of {speed_mm_per_s * step_s:g} mm does not bend the needle at a resolution of "
            f"{per_mm} per mm",
            "make the step longer or the resolution finer",
        )
    if swept and insertion >= math.pi * circle:
        return Breach(
            "step-around-circle",
            "a push goes half around the motion circle or farther, which `safety swept` cannot "
            "check",
            "make the step shorter",
        )
    return None


def query(name: str, text: str) -> Breach | None:
    """A query has a text, and not the name of one of the paper's queries, unless it is that one."""
    if re.search(r"[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", text):
        return Breach("query-malformed", f"`{name}` has a character that a model cannot contain")
    text = " ".join(text.split())
    if PAPER_QUERIES.get(name, text) == text:
        return None
    return Breach(
        "duplicate-name",
        f"there is a query `{name}` in every model: {PAPER_QUERIES[name]}",
        f"rename the one that says `{text}`",
    )


def time_units(step_s: float, speed_mm_per_s: float) -> tuple[int, float, float]:
    """The step in the model's units of time, the insertion in one of them in mm, and the unit in s.

    The unit is 1 s if the step is a whole number of seconds, otherwise the step itself.
    """
    whole = round(step_s)
    if whole >= 1 and abs(step_s - whole) <= WHOLE_TOLERANCE * whole:
        return whole, speed_mm_per_s, 1.0
    return 1, speed_mm_per_s * step_s, step_s


TIMES_PER_S: Final = 10_000
"""Times of models with moving regions are whole multiples of 1 / this of a second."""


MAX_PAUSES: Final = 100
"""A plan waits at most at this many places although it may push."""


def pause_count(count: int) -> Breach | None:
    """The number of pauses is one that the model counts."""
    if 0 <= count <= MAX_PAUSES:
        return None
    return Breach("wait-wrong", f"the number of waits is {count}", f"use 0 to {MAX_PAUSES}")


def rounded_time(time_s: float) -> Fraction:
    """A time as a whole multiple of 0.1 ms, in s."""
    from fractions import Fraction

    return Fraction(round(time_s * TIMES_PER_S), TIMES_PER_S)


def common_time(*times_s: float) -> Fraction:
    """The longest time of which all these are whole multiples, in s, after rounding to 0.1 ms."""
    from fractions import Fraction

    fractions = [rounded_time(time_s) for time_s in times_s]
    denominator = math.lcm(*(one.denominator for one in fractions))
    numerator = math.gcd(*(int(one * denominator) for one in fractions))
    return Fraction(numerator, denominator)


def units_of(value: float, per_mm: int) -> int:
    """The number of units nearest to a finite value (ties go to the even number)."""
    numerator, denominator = value.as_integer_ratio()
    whole, rest = divmod(numerator * per_mm, denominator)
    # Half a unit goes up if the whole number is odd.
    return whole + (2 * rest > denominator - whole % 2)
