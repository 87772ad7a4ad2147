"""Solid shapes: distances, bounds and volumes, in mm. Pure geometry; it knows nothing of scenes."""

from ntagen.shapes.ellipsoid import Ellipsoid
from ntagen.shapes.field import SAMPLES_PER_MM, Field
from ntagen.shapes.round import Capsule, HalfSpace, Sphere
from ntagen.shapes.shape import (
    UPRIGHT,
    Axes,
    Bounds,
    Points,
    Shape,
    Vector,
    axes_of,
    turning,
    vector_of,
)
from ntagen.shapes.skin import skin
from ntagen.shapes.straight import Box, Cylinder
from ntagen.shapes.surface import (
    directions,
    is_in,
    outline_mm,
    overlap,
    surface_mm,
    thickness_mm,
    triangles,
)

__all__ = [
    "SAMPLES_PER_MM",
    "UPRIGHT",
    "Axes",
    "Bounds",
    "Box",
    "Capsule",
    "Cylinder",
    "Ellipsoid",
    "Field",
    "HalfSpace",
    "Points",
    "Shape",
    "Sphere",
    "Vector",
    "axes_of",
    "directions",
    "is_in",
    "outline_mm",
    "overlap",
    "skin",
    "surface_mm",
    "thickness_mm",
    "triangles",
    "turning",
    "vector_of",
]
