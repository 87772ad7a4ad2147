"""The published cases of shields, as they are asked of models here.

Sources: Brorholt et al., "Shielded Reinforcement Learning for Hybrid Systems", AISoLA 2023, and
"Uppaal Coshy: Automatic Synthesis of Compact Shields for Hybrid Systems", 2025. Of 10,000 runs
under their shields none was unsafe. Grids and samples here are coarser than theirs where that is
enough, and fewer runs are made where a thousand take seconds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Shielding:
    """A shield for a model.

    Attributes:
        model: The name of the file of the model.
        keep: What must hold for ever.
        axes: The grid.
        bound: How long a run is.
        options: How the shield is sampled.
        runs: So many runs under it are made.
    """

    model: str
    keep: str
    axes: str
    bound: str = "<=120"
    options: dict[str, Any] = field(default_factory=dict)
    runs: int = 10_000

    @property
    def text(self) -> str:
        """The model."""
        return (HERE / f"{self.model}.xta").read_text(encoding="utf-8")

    @property
    def query(self) -> str:
        """What is asked for."""
        return f"strategy S = acontrol: A[] {self.keep} {{ {self.axes} }}"

    @property
    def broken(self) -> str:
        """The chance that a run is unsafe."""
        return f"Pr[{self.bound}; {self.runs}](<> !({self.keep}))"


WALK = Shielding(
    "walk",
    "t < 1",
    "x[0,1]:100, t[0,1]:100",
    "#<=100",
    {"shield_samples": 4, "shield_repeats": 20},
)
CASES = (
    WALK,
    Shielding(
        "ball",
        "!Ball.Lost",
        "height[0,11]:275, speed[-13,13]:650",
        options={"out_of_bounds": "safe", "shield_samples": 2},
        runs=1000,
    ),
    Shielding(
        "cruise",
        "distance > 0",
        "own[-5,10], front[-5,10], distance[1,201]",
        options={"shield_repeats": 20},
    ),
    Shielding(
        "boost",
        "current < 4 && voltage >= 14.5 && voltage < 15.5",
        "current[-0.1,4]:41, voltage[14.5,15.5]:40, load[30,201]:9",
        options={"shield_samples": 2, "shield_repeats": 5},
        runs=2000,
    ),
    Shielding(
        "pump",
        "volume >= 4.9 && volume < 25.1",
        "part[0,99], pumping[0,1], rest[0,10], volume[4.9,25.1]:101",
        options={"shield_samples": 2, "shield_repeats": 3},
        runs=2000,
    ),
)
