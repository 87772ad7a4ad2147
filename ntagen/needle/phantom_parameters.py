"""The parameters of the phantom needle, all in this file, each with its source.

Sources:

* **[ultrasteer]** 12 measured insertions of a steerable needle without rolls, of Greer et al.'s
  public repository `josephgreer/ultrasteer` (`data/JRes/Res/9_18_15`; 50 to 99 mm, radius 78 mm).
  Circles were fitted to whole insertions, halves and windows. The whole-insertion curvature has a
  standard deviation of 3.9 % (extremes -9 and +7 %). Windows of 20 mm spread from -27 to +35 % (5 %
  and 95 % quantiles), with the noise of the fit; the first one is 16 % tighter. The bend plane of
  the second half differs from that of the first by 9.8 degrees (median; 24 at most). The points lie
  0.16 mm from the circle (mean of absolute distances).
* **[Reed]** Reed, Okamura and Cowan, "Modeling and control of needles with torsional friction",
  IEEE Trans. Biomed. Eng. 56, 2009: the tip lags by more than 45 degrees at 10 cm in some phantoms.
* **[Okamura]** Okamura, Simone and O'Leary, "Force modeling for needle insertion into soft tissue",
  IEEE Trans. Biomed. Eng. 51, 2004: axial force = stiffness + friction + cutting. We could not read
  its numbers again; the sizes here are ours, of the same order.
* **[lisa]** Stationary files of the public repository `maribernardes/trajcontrol_lisa` (an NDI
  Aurora tracker): 0.07 to 0.11 mm for each coordinate.
* **ours**: no source has a value.

How the shape was calibrated: independent fluctuations of the curvature cannot give both a spread of
20 % in windows of 20 mm and one of 4 % in whole insertions; slow ones give too much of the second.
So the curvature has a share that is constant in one insertion and a fluctuation with a wavelength,
which averages out over an insertion. Fluctuations alone would give residuals of half the measured
size: the rest is an error of the tracker that is correlated along the path. With the values here,
`tests/benchmarks/phantom.py` prints the spreads beside the published ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Fluctuation:
    """A random process along the path: an oscillator of second order, driven by white noise.

    Attributes:
        std: Its standard deviation, in the unit of what fluctuates.
        wavelength_mm: Its undamped wavelength.
        damping: Its damping ratio, between 0 and 1.
    """

    std: float
    wavelength_mm: float
    damping: float


@dataclass(frozen=True, slots=True)
class Shape:
    """How the needle bends.

    Attributes:
        curvature_ratio: Standard deviation of the share of the curvature that is constant in one
            insertion. [ultrasteer], calibrated: with the fluctuation, whole insertions have 3.9 %.
        curvature: The fluctuation of the curvature, as a ratio. [ultrasteer], calibrated.
        first_ratio: The curvature of the first part is greater by this ratio. [ultrasteer]
        first_mm: The length of the first part. [ultrasteer]
        turn_rad_per_mm: Standard deviation of the rate at which the bend plane turns, constant in
            one insertion. [ultrasteer], calibrated: median 10 degrees between halves of 40 mm.
        turn_rad: The fluctuation of the bend plane. [ultrasteer], calibrated.
        spin_ratio: Spinning in a part of the way takes away this much more or less of the curvature
            than that part: the standard deviation, constant in one insertion, as a ratio. Ours.
    """

    curvature_ratio: float = 0.02
    curvature: Fluctuation = Fluctuation(0.10, 30.0, 0.2)
    first_ratio: float = 0.16
    first_mm: float = 10.0
    turn_rad_per_mm: float = math.radians(13.0) / 38.0
    turn_rad: Fluctuation = Fluctuation(math.radians(6.0), 30.0, 0.2)
    spin_ratio: float = 0.03


@dataclass(frozen=True, slots=True)
class Torsion:
    """How friction along the shaft holds back the tip when the base is rolled.

    The tip turns only when the base is ahead by more than the lag. The friction of each mm of the
    shaft winds up all of it between there and the base, so the lag grows with the square of the
    depth (ours, from a shaft of constant stiffness and constant friction).

    Attributes:
        lag_rad: The lag at `depth_mm`. [Reed]: more than 45 degrees at 10 cm in some phantoms.
        depth_mm: The depth for which it is given. [Reed]
        spread_ratio: Standard deviation of the friction between insertions, as a ratio; ours.
        friction: The fluctuation of the friction along the depth, as a ratio; ours.
    """

    lag_rad: float = math.radians(45.0)
    depth_mm: float = 100.0
    spread_ratio: float = 0.15
    friction: Fluctuation = Fluctuation(0.05, 20.0, 0.5)


@dataclass(frozen=True, slots=True)
class Reinsertion:
    """What happens when the needle is pushed where it has been before.

    Attributes:
        capture_rad: The tip follows the old channel if its bend direction differs from that of the
            channel by at most this angle; otherwise it cuts a new one. Ours.
        tolerance_mm: The old channel is wider than the needle: the tip follows it to within this
            distance. Ours; the shafts of the sources have diameters of 0.5 to 1 mm.
        settle_mm: The length over which the tip comes to its place in the old channel. Ours.
        bite_mm: A new channel that leaves an old one begins with a weaker curvature over this
            length, since the tip has less tissue to press on. Ours.
        bite_ratio: The curvature there, as a ratio. Ours.
    """

    capture_rad: float = math.radians(30.0)
    tolerance_mm: float = 0.15
    settle_mm: float = 2.0
    bite_mm: float = 2.0
    bite_ratio: float = 0.6


@dataclass(frozen=True, slots=True)
class Forces:
    """The axial force at the base, which is what a sensor there measures ([Okamura]: its parts).

    Attributes:
        cutting_n: The force of cutting. Ours; the order of [Okamura].
        friction_n_per_mm: The friction for each mm of inserted length. Ours; the order of
            [Okamura]. On a pull it acts the other way.
        friction_ratio: Standard deviation of the friction between insertions, as a ratio; ours.
        layer_mm: The mean thickness of layers. Ours.
        layer_ratio: Standard deviation of the cutting force between layers, as a ratio. Ours: a
            gelatine phantom is nearly homogeneous.
        puncture_n: The rise before the boundary of a layer breaks. Ours.
        puncture_mm: The length over which it rises. Ours.
        region_n_per_mm: The rise for each mm within the sensing margin of a critical region; that
            of the virtual needle (ours).
    """

    cutting_n: float = 0.5
    friction_n_per_mm: float = 0.01
    friction_ratio: float = 0.1
    layer_mm: float = 30.0
    layer_ratio: float = 0.05
    puncture_n: float = 0.05
    puncture_mm: float = 1.0
    region_n_per_mm: float = 1.0

    def layers_n(self, sigmas: float) -> float:
        """The greatest rise of the force that layers cause: a boundary, and a stronger layer.

        Args:
            sigmas: The difference of two layers counts up to this many standard deviations.
        """
        difference_n = math.sqrt(2.0) * self.layer_ratio * self.cutting_n
        return self.puncture_n + sigmas * difference_n


@dataclass(frozen=True, slots=True)
class Sensing:
    """The errors of the tracker and the force sensor.

    Attributes:
        noise_mm: White noise of each coordinate. [lisa]
        distortion_mm: An error of each coordinate that is correlated along the path, as of a
            distorted magnetic field. [ultrasteer], calibrated with the residuals of the fits.
        step_mm: Positions are rounded to multiples of this; ours.
        noise_n: White noise of the force; ours.
        step_n: Forces are rounded to multiples of this; ours.
        latency_s: A measurement shows the needle as it was this long ago; ours.
        frame_s: The time between two readings of the tracker: 40 Hz, as the Aurora's data sheet
            says.
        lost_ratio: The probability that a reading is lost after one that was not; ours.
        found_ratio: The probability that the next one after a lost reading is not lost; ours.
        patience_s: If all readings of this time are lost, the sensor reports a failure; ours.
        direction_rad: White noise of a measured direction, about each axis, if the tracker sees
            directions; ours.
        whole_shape: Whether places all along the needle are measured, and not its tip only. Each
            has the noise and the distortion of the tip.
        shape_apart_mm: The distance of these places; ours.
        shape_free_mm: The shape begins so far outside of the tissue; ours.
    """

    noise_mm: float = 0.08
    distortion_mm: Fluctuation = Fluctuation(0.085, 20.0, 0.7)
    step_mm: float = 0.01
    noise_n: float = 0.02
    step_n: float = 0.005
    latency_s: float = 0.05
    frame_s: float = 0.025
    lost_ratio: float = 0.01
    found_ratio: float = 0.5
    patience_s: float = 1.0
    direction_rad: float = math.radians(0.3)
    whole_shape: bool = False
    shape_apart_mm: float = 1.0
    shape_free_mm: float = 20.0


@dataclass(frozen=True, slots=True)
class PhantomParameters:
    """All parameters of a phantom needle; the defaults are one phantom of gelatine."""

    shape: Shape = field(default_factory=Shape)
    torsion: Torsion = field(default_factory=Torsion)
    reinsertion: Reinsertion = field(default_factory=Reinsertion)
    forces: Forces = field(default_factory=Forces)
    sensing: Sensing = field(default_factory=Sensing)
