"""The published cases under a fixed or random choice, simulated without the engine."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Step = Callable[[Vector, Vector], Vector]


@dataclass(frozen=True)
class Mean:
    """A mean of random runs, with half of its interval at 95 %."""

    value: float
    half: float


def mean_of(values: Vector) -> Mean:
    """The mean of independent values."""
    return Mean(float(values.mean()), float(1.96 * values.std() / math.sqrt(len(values))))


def commute_at_random() -> Fraction:
    """The mean time to work, if all that may be chosen is equally likely.

    From the platform it takes p = 4.5 + 10/11 * 17.5 + 1/11 (1 + p/2 + h/2), and from home it takes
    h = 1 + (43.5 + car + p) / 3.
    """
    seat = Fraction(10, 11)
    car = seat * 10 + (1 - seat) * 70
    platform = Fraction(9, 2) + seat * Fraction(35, 2) + (1 - seat)
    half = (1 - seat) / 2
    home = 1 + (Fraction(87, 2) + car + platform / (1 - half)) / 3
    return home / (1 - half / (1 - half) / 3)


def commute_by_car() -> Fraction:
    """The mean time by car, at once, which is the least."""
    return Fraction(10, 11) * 10 + Fraction(1, 11) * 70


# The pole on the cart: place, speed, angle, angular speed.


def _change(state: Vector, force: Vector) -> Vector:
    """The derivative of the state."""
    _, speed, angle, turning = state
    thrust = (force + 0.05 * turning**2 * np.sin(angle)) / 1.1
    angular = (9.8 * np.sin(angle) - np.cos(angle) * thrust) / (
        0.5 * (4 / 3 - 0.1 * np.cos(angle) ** 2 / 1.1)
    )
    linear = thrust - 0.05 * angular * np.cos(angle) / 1.1
    return np.array([speed, linear, turning, angular])


def runge_kutta(state: Vector, force: Vector) -> Vector:
    """0.02 s in two steps of fourth order, which is exact here to many digits."""
    step = 0.01
    for _ in range(2):
        first = _change(state, force)
        second = _change(state + step / 2 * first, force)
        third = _change(state + step / 2 * second, force)
        last = _change(state + step * third, force)
        state = state + step / 6 * (first + 2 * second + 2 * third + last)
    return state


def semi_implicit(state: Vector, force: Vector) -> Vector:
    """0.02 s in one step of Euler's: first the speeds, then places with the new speeds."""
    step = 0.02
    change = _change(state, force)
    speed, turning = state[1] + step * change[1], state[3] + step * change[3]
    return np.array([state[0] + step * speed, speed, state[2] + step * turning, turning])


def pole_at_random(runs: int, seed: int, step: Step) -> Mean:
    """How often the pole falls in 10 s."""
    source = np.random.default_rng(seed)
    force, falls = np.zeros(runs), np.zeros(runs)
    state = source.uniform(-0.05, 0.05, (4, runs))
    for _ in range(500):
        state = step(state, force)
        force = np.where(source.random(runs) < 0.5, 10.0, -10.0)
        fallen = (abs(state[0]) > 2.4) | (abs(state[2]) > 12 * math.pi / 180)
        falls += fallen
        state[:, fallen] = source.uniform(-0.05, 0.05, (4, int(fallen.sum())))
    return mean_of(falls)


def stroll_at_random(runs: int, seed: int) -> Mean:
    """What the walk costs, with 1,000 for coming too late."""
    source = random.Random(seed)

    def error() -> float:
        return source.uniform(-0.04, 0.04)

    def run() -> float:
        place, time, cost = 0.0, 0.0, 0.0
        while place <= 1 and time <= 1:
            fast = source.random() < 0.5
            place += (0.17 if fast else 0.1) + error()
            time += (0.05 if fast else 0.12) + error()
            wave = 1.5 * math.sin(4 * math.pi * place)
            cost += 1.5 + 3 + wave if fast else 1.5 + 1 - wave
        return cost + (1000 if time > 1 else 0)

    return mean_of(np.array([run() for _ in range(runs)]))


def ball_without_hits(runs: int, seed: int) -> Mean:
    """How often the ball is lost in 120 units of time if nobody hits it: from bounce to bounce."""
    source = random.Random(seed)

    def run() -> float:
        time, lost = 0.0, 0
        while True:
            speed = math.sqrt(2 * 9.81 * (7 + source.uniform(0, 3)))
            time += speed / 9.81
            while time <= 120:
                speed *= source.uniform(0.85, 0.97)
                if speed <= 1:
                    lost += 1
                    break
                time += 2 * speed / 9.81
            if time > 120:
                return lost

    return mean_of(np.array([run() for _ in range(runs)], float))
