"""What the tissue of one phantom is like at each depth, drawn once from a seed."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ntagen.needle.phantom_parameters import Fluctuation, PhantomParameters

_Array = NDArray[np.float64]

CELL_MM = 0.25
"""The tissue is constant in cells of this depth."""


@dataclass(frozen=True, slots=True)
class _Layer:
    start_mm: float
    cutting_n: float


class Tissue:
    """The tissue along the depth; the same seed always gives the same tissue.

    Args:
        parameters: What is drawn.
        length_mm: The greatest depth; deeper tissue is like that at this depth.
        seed: The seed.
    """

    def __init__(
        self, parameters: PhantomParameters, length_mm: float, seed: np.random.SeedSequence
    ) -> None:
        self._parameters = parameters
        generators = [np.random.default_rng(stream) for stream in seed.spawn(5)]
        bend, turn, twist, force, field = generators
        count = max(3, math.ceil(length_mm / CELL_MM) + 1)
        middle_mm = CELL_MM * (np.arange(count) + 0.5)
        shape, torsion, forces = parameters.shape, parameters.torsion, parameters.forces
        constant = 1.0 + float(bend.normal(0.0, shape.curvature_ratio))
        ratio = constant + fluctuation(bend, count, shape.curvature)
        first = np.where(middle_mm < shape.first_mm, 1.0 + shape.first_ratio, 1.0)
        # A bevel tip does not bend backwards.
        self._curvature_ratio = np.maximum(0.05, ratio * first)
        self._turn_rad = turn.normal(0.0, shape.turn_rad_per_mm) * middle_mm
        wobble_rad = fluctuation(turn, count, shape.turn_rad)
        self._turn_rad += wobble_rad - wobble_rad[0]
        constant = 1.0 + float(twist.normal(0.0, torsion.spread_ratio))
        friction = constant + fluctuation(twist, count, torsion.friction)
        self._twist_ratio = np.maximum(0.0, friction)
        self._friction_n_per_mm = forces.friction_n_per_mm * max(
            0.0, 1.0 + float(force.normal(0.0, forces.friction_ratio))
        )
        self._layers = _layers(parameters, length_mm, force)
        distortion = parameters.sensing.distortion_mm
        self._distortion_mm = np.stack(
            [fluctuation(field, count, distortion) for _ in range(3)], axis=1
        )

    def cell(self, depth_mm: float) -> int:
        """The number of the cell that begins at a depth, or in which it lies."""
        return min(len(self._turn_rad) - 1, math.floor(depth_mm / CELL_MM + 1e-9))

    def curvature_ratio(self, cell: int) -> float:
        """The curvature in a cell, relative to the nominal one."""
        return float(self._curvature_ratio[cell])

    def turn_rad(self, cell: int) -> float:
        """By how much the bend plane has turned in a cell."""
        return float(self._turn_rad[cell])

    def lag_rad(self, depth_mm: float) -> float:
        """The lag of the tip when the base is rolled at a depth."""
        torsion = self._parameters.torsion
        ratio = float(self._twist_ratio[self.cell(depth_mm)])
        return torsion.lag_rad * ratio * (depth_mm / torsion.depth_mm) ** 2

    def cutting_n(self, depth_mm: float) -> float:
        """The force of cutting at a depth, with the rise before the boundary of a layer."""
        starts = [layer.start_mm for layer in self._layers]
        number = bisect.bisect_right(starts, depth_mm) - 1
        force_n = self._layers[number].cutting_n
        if number + 1 < len(self._layers):
            forces = self._parameters.forces
            ahead_mm = self._layers[number + 1].start_mm - depth_mm
            force_n += forces.puncture_n * max(0.0, 1.0 - ahead_mm / forces.puncture_mm)
        return force_n

    def friction_n(self, depth_mm: float) -> float:
        """The friction along the shaft at a depth."""
        return self._friction_n_per_mm * depth_mm

    def distortion_mm(self, depth_mm: float) -> _Array:
        """The correlated error of the tracker where the tip is at a depth."""
        place = min(max(depth_mm / CELL_MM, 0.0), len(self._distortion_mm) - 1.001)
        cell = int(place)
        share = place - cell
        return np.asarray(
            (1.0 - share) * self._distortion_mm[cell] + share * self._distortion_mm[cell + 1]
        )


def fluctuation(generator: np.random.Generator, count: int, process: Fluctuation) -> _Array:
    """A stationary stretch of a process, one value for each cell.

    It is the autoregression of second order whose roots are those of the damped oscillator; its
    first two values are drawn from the stationary distribution.
    """
    rate = 2.0 * math.pi * CELL_MM / process.wavelength_mm
    decay = math.exp(-process.damping * rate)
    first = 2.0 * decay * math.cos(rate * math.sqrt(1.0 - process.damping**2))
    second = -(decay**2)
    correlation = first / (1.0 - second)
    gain = (1.0 - second) / ((1.0 + second) * ((1.0 - second) ** 2 - first**2))
    drawn = generator.normal(size=count)
    values = np.empty(count)
    values[0] = drawn[0]
    values[1] = correlation * drawn[0] + math.sqrt(1.0 - correlation**2) * drawn[1]
    step = 1.0 / math.sqrt(gain)
    for index in range(2, count):
        values[index] = first * values[index - 1] + second * values[index - 2] + step * drawn[index]
    return process.std * values


def _layers(
    parameters: PhantomParameters, length_mm: float, generator: np.random.Generator
) -> list[_Layer]:
    """Layers of random thickness and strength, down to a depth."""
    forces = parameters.forces
    layers: list[_Layer] = []
    start_mm = 0.0
    while start_mm < length_mm or not layers:
        strength = max(0.0, 1.0 + float(generator.normal(0.0, forces.layer_ratio)))
        layers.append(_Layer(start_mm, forces.cutting_n * strength))
        start_mm += forces.layer_mm * (0.5 + float(generator.exponential(0.5)))
    return layers
