"""The options of `ntagen check` for statistical queries: a row for each."""

from __future__ import annotations

import math
from typing import Final

import click

from ntagen.cli.rules import Decorator


class _Number(click.ParamType[float]):
    """A number between two others, which are not included."""

    name = "number"

    def __init__(self, low: float, high: float) -> None:
        self._low = low
        self._high = high

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        try:
            number = float(str(value))
        except ValueError:
            number = math.nan
        if not self._low < number < self._high:
            wanted = (
                f"a number between {self._low:g} and {self._high:g}"
                if self._high < math.inf
                else f"a number greater than {self._low:g}"
            )
            self.fail(f"{value!r} is not {wanted}", param, ctx)
        return number


class _Pair(click.ParamType[tuple[float, float]]):
    """Two numbers with a comma between them, the lesser one first; or one number for both."""

    name = "pair"

    def __init__(self, low: float, high: float, *, one_is_enough: bool = False) -> None:
        self._number = _Number(low, high)
        self._one_is_enough = one_is_enough

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[float, float]:
        if isinstance(value, tuple):
            return value
        words = str(value).split(",")
        if len(words) == 1 and self._one_is_enough:
            words *= 2
        if len(words) != 2:
            self.fail(f"{value!r} is not a pair of numbers; write LOW,HIGH", param, ctx)
        first, second = (self._number.convert(word.strip(), param, ctx) for word in words)
        if not self._one_is_enough and not first < second:
            self.fail(f"{value!r}: the first number must be less than the second", param, ctx)
        return first, second


_SHARE: Final = _Number(0, 1)

STATISTICAL: Final[dict[str, Decorator]] = {
    "runs": click.option(
        "--runs",
        metavar="N",
        type=click.IntRange(min=1),
        help="For Pr and E: make N random runs.  [default: as many as the query says, or as "
        "--epsilon needs]",
    ),
    "alpha": click.option(
        "--alpha",
        metavar="RISK",
        type=_SHARE,
        default=0.05,
        help="For Pr and E: the risk that the interval misses, or that Pr >= p is rejected "
        "wrongly.  [default: 0.05]",
    ),
    "beta": click.option(
        "--beta",
        metavar="RISK",
        type=_SHARE,
        default=0.05,
        help="For Pr >= p: the risk that it is accepted wrongly.  [default: 0.05]",
    ),
    "epsilon": click.option(
        "--epsilon",
        metavar="WIDTH",
        type=_SHARE,
        default=0.05,
        help="For Pr: make runs until both ends of the interval are so near to the estimate.  "
        "[default: 0.05]",
    ),
    "anytime": click.option(
        "--anytime",
        is_flag=True,
        help="For Pr and E: intervals that hold after every run, all together, so that you may "
        "look and stop when you want. They are wider. For E, bounds of the value must be known.",
    ),
    "relative": click.option(
        "--relative",
        metavar="PART",
        type=_SHARE,
        help="For Pr and E: make runs until both ends of the interval are within this part of the "
        "estimate. The interval is one of --anytime. It never ends for a probability of 0: bound "
        "it by --runs or --timeout.",
    ),
    "value_bounds": click.option(
        "--value-bounds",
        metavar="LOW,HIGH",
        type=_Pair(-math.inf, math.inf),
        help="For E: in every run the value lies between these; then the interval is right for any "
        "number of runs.  [default: what the ranges of integers in the query say]",
    ),
    "mean_interval": click.option(
        "--mean-interval",
        type=click.Choice(["auto", "student", "bernstein", "dkw"]),
        default="auto",
        help="What makes the interval of E: Student's distribution, which is right in the limit of "
        "many runs only; empirical Bernstein intervals, or the band of Dvoretzky, Kiefer and "
        "Wolfowitz, for values between known bounds.  [default: bernstein if bounds are known, "
        "else student]",
    ),
    "levels": click.option(
        "--levels",
        metavar="EXPR",
        help="For Pr of a rare event: an expression that says how near a state is to it, such as "
        "the length of a queue that must not overflow. The estimate is made by importance "
        "splitting: runs are started again where others came nearer.",
    ),
    "effort": click.option(
        "--effort",
        metavar="N",
        type=click.IntRange(min=1, max=1_000_000),
        default=1000,
        help="With --levels: make N parts of runs between two levels.  [default: 1000]",
    ),
    "repetitions": click.option(
        "--repetitions",
        metavar="N",
        type=click.IntRange(min=2, max=1_000_000),
        default=40,
        help="With --levels: make the interval of N independent repetitions.  [default: 40]",
    ),
    "delta": click.option(
        "--delta",
        metavar="WIDTH[,WIDTH]",
        type=_Pair(0, 1, one_is_enough=True),
        default=(0.01, 0.01),
        help="For Pr >= p: so near to p nothing is promised; one number for both sides, or one for "
        "below and one for above.  [default: 0.01]",
    ),
    "odds_ratios": click.option(
        "--odds-ratios",
        metavar="LOW,HIGH",
        type=_Pair(0, math.inf),
        default=(0.9, 1.1),
        help="For Pr >= Pr: if the ratio of the odds lies between these, nothing is promised.  "
        "[default: 0.9,1.1]",
    ),
    "discretisation": click.option(
        "--discretisation",
        metavar="STEP",
        type=_Number(0, math.inf),
        help="Solve equations of clocks in steps of this length.  [default: as their errors need]",
    ),
}
"""The options on the command line, by their fields of `ntagen.checker.Options`."""
