"""What others report of their cases, as they ask it of models here.

The numbers are UPPAAL's, of random runs, and its integrator is not exact: `simulation.py` says what
exact physics give. Sources: the demonstrations of UPPAAL Stratego (DEIS-Tools/uppaal-models), and
the results that come with the models of Brorholt et al., Shielded Reinforcement Learning for Hybrid
Systems, 2023 (those of one repetition, with 12,000 runs of learning).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Published:
    """A value of `query`, under the last of `strategies` if there are any.

    `margin` is half of the published interval, or what the digits and the runs leave open.
    """

    model: str
    query: str
    value: float
    margin: float
    strategies: tuple[str, ...] = ()

    @property
    def path(self) -> Path:
        """The model's file."""
        return HERE / f"{self.model}.xta"

    @property
    def name(self) -> str:
        """For lists of tests."""
        under = f" under {self.strategies[-1].split()[1]}" if self.strategies else ""
        return f"{self.model}: {self.query}{under}"


ALL_DONE = "Ada.Done && Ben.Done && Cleo.Done && Dan.Done"
ALL_TIME = f"E[<=100; 20000](max: {ALL_DONE} ? 0.0 : time)"
LATE = "E[#<=30; 20000](max: cost + (t > 1) * 1000)"

RANDOM = (
    Published("commute", "E[<=200; 20000](max: travel)", 28.0, 0.5),
    Published("commute", "Pr[<=60; 20000](<> Worker.Work)", 0.975, 0.025),
    Published("readers", ALL_TIME, 58.07, 0.27),
    Published("readers", "Pr[<=60; 20000](<> Ben.Done)", 0.69, 0.01),
    Published("readers", "E[<=100; 20000](max: Dan.waited)", 34.6, 4.0),
    Published("follow", "Pr[<=100; 20000](<> distance <= 5)", 0.90, 0.05),
    Published("pole", "E[<=10; 1000](max: falls)", 23.77, 0.163),
    Published("stroll", LATE, 98.3, 50.7),
)
"""Where nobody learned: the choice is random."""

SAFE_WORK = "strategy Safe = control: A<> Worker.Work && time <= 60"
SAFE_DRIVE = "strategy Safe = control: A[] distance > 5"
TRAVEL = "strategy Travel = control: A<> Ben.Done && time <= 60"
LEARNED = (
    Published("commute", "E[<=200; 20000](max: travel)", 33.0, 2.0, (SAFE_WORK,)),
    Published(
        "commute",
        "E[<=200; 20000](max: travel)",
        15.4,
        2.2,
        ("strategy Fast = minE(travel)[<=200]: <> Worker.Work",),
    ),
    Published(
        "commute",
        "E[<=200; 20000](max: travel)",
        22.4,
        2.0,
        (SAFE_WORK, "strategy FastSafe = minE(travel)[<=200]: <> Worker.Work under Safe"),
    ),
    Published(
        "readers", ALL_TIME, 55.60, 0.25, (f"strategy Best = minE(time)[<=100]: <> {ALL_DONE}",)
    ),
    Published(
        "readers",
        "E[<=200; 20000](max: Dan.waited)",
        21.2,
        1.0,
        ("strategy Calm = minE(Dan.waited)[<=200]: <> Dan.Done",),
    ),
    Published("readers", "E[<=60; 20000](max: Ben.Done ? 0.0 : time)", 42.96, 0.21, (TRAVEL,)),
    Published(
        "readers",
        "E[<=60; 20000](max: Dan.Done ? 0.0 : time)",
        14.6,
        0.5,
        (TRAVEL, "strategy Both = minE(time)[<=60]: <> Dan.Done under Travel"),
    ),
    Published("follow", "Pr[<=100; 20000](<> distance <= 5)", 0.0, 0.01, (SAFE_DRIVE,)),
    Published(
        "follow",
        "E[<=100; 1000](max: total_gap)",
        0.0,
        5000.0,
        (SAFE_DRIVE, "strategy Near = minE(total_gap)[<=105]: <> time >= 100 under Safe"),
    ),
    Published(
        "pole",
        "E[<=10; 1000](max: falls)",
        0.001,
        0.002,
        ("strategy Up = minE(falls)[<=10]{}->{place, speed, angle, turning}: <> time >= 10",),
    ),
    Published(
        "stroll",
        LATE,
        23.13,
        0.57,
        ("strategy Cheap = minE(cost + (t > 1) * 1000)[#<=30]{}->{x, t}: <> x >= 1 or t >= 1",),
    ),
    Published(
        "stroll",
        "E[#<=30; 20000](max: cost)",
        21.48,
        0.5,
        ("strategy Cheap = minE(cost + (t > 1) * 1000)[#<=30]{}->{x, t}: <> x >= 1 or t >= 1",),
    ),
    Published(
        "ball",
        "E[<=120; 1000](max: hits)",
        39.1,
        1.0,
        ("strategy Keep = minE(hits + 1000 * lost)[<=120]{}->{height, speed}: <> time >= 120",),
    ),
    Published(
        "ball",
        "E[<=120; 1000](max: lost)",
        0.007,
        0.007,
        ("strategy Keep = minE(hits + 1000 * lost)[<=120]{}->{height, speed}: <> time >= 120",),
    ),
)
"""Under learned strategies: what a learner has to reach. A gap of 50 m for 100 s is 5,000 m s."""
