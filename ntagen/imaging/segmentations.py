"""Parts of segmentations: the voxels of a named segment, or those with a number."""

from __future__ import annotations

import difflib
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from ntagen.imaging.mistakes import ImageError, malformed
from ntagen.imaging.nifti import Matrix, read_nifti
from ntagen.imaging.nrrd import data_file_of, read_nrrd
from ntagen.imaging.space import Rigid, Space, rigid
from ntagen.imaging.volumes import Volume, voxels_of
from ntagen.shapes import Vector, vector_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

_NRRD: Final = (".nrrd", ".nhdr")
_NIFTI: Final = (".nii", ".nii.gz")
_FARTHEST: Final = 1e9
"""Nothing of a file is farther from its origin, in units of the file."""


@dataclass(frozen=True, slots=True)
class Part:
    """What is taken of a segmentation.

    Attributes:
        segment: The name of a segment.
        label: The number of the voxels, if no segment is named.
        matrix: Which matrix of a NIfTI file counts.
    """

    segment: str | None = None
    label: int | None = None
    matrix: Matrix | None = None


@dataclass(frozen=True, slots=True)
class Mask:
    """The voxels of one part of a segmentation; each is a box about its centre.

    Attributes:
        voxels: Whether a voxel belongs to the part; cut to the part.
        spacing: The edges of a voxel, in units of the file.
        frame: From the file's axes, with the centre of the first voxel as origin, to `space`.
        space: The space of the frame, if the file says it.
        unit_mm: The unit that the file says, in mm.
        said: What the file says of its space, if it is not the name of `space`.
        doubt: Where a voxel is by the file is no farther from where it is by `frame`, whose axes
            are at right angles; in units of the file.
    """

    voxels: NDArray[np.bool_]
    spacing: Vector
    frame: Rigid
    space: Space | None
    unit_mm: float | None
    said: str | None = None
    doubt: float = 0.0


def read_mask(path: str, part: Part) -> Mask:
    """A part of the segmentation in a file.

    Raises:
        ImageError: The file cannot be read, is no segmentation, or has no such part.
    """
    name = path.lower()
    if not name.endswith((*_NRRD, *_NIFTI)):
        raise malformed(
            f"`{path}` is no segmentation that can be read",
            "name a file that ends with .nrrd, .seg.nrrd, .nhdr, .nii or .nii.gz",
        )
    if name.endswith(_NIFTI):
        return _mask(read_nifti(path, part.matrix), part)
    if part.matrix is not None:
        raise ImageError(
            "matrix-ambiguous", f"`{path}` has no {part.matrix}", f"leave out `{part.matrix}`"
        )
    return _mask(read_nrrd(path), part)


def files_of(path: str) -> list[str]:
    """The files that a segmentation is in: the one named, and the one that has its voxels.

    Raises:
        ImageError: The file cannot be read.
    """
    other = data_file_of(path) if path.lower().endswith(_NRRD) else None
    return [path] if other is None else [path, other]


def _mask(volume: Volume, part: Part) -> Mask:
    """The part of a volume, cut to it.

    Raises:
        ImageError: There is no such part, or the axes are no right angles.
    """
    import numpy as np

    rows, origin, path = volume.rows, volume.origin, volume.path
    spacing = np.array([math.hypot(*map(float, row)) for row in rows])
    if not (spacing.min() > 1e-9 and spacing.max() <= _FARTHEST):
        raise ImageError(
            "matrix-degenerate",
            f"the spacing of `{path}` is {', '.join(f'{s:g}' for s in spacing)}",
            "save it with the geometry of its image: each spacing is greater than 0",
        )
    farthest = math.hypot(*map(float, origin)) + float(spacing.max()) * max(volume.sizes)
    if not farthest <= _FARTHEST:
        raise ImageError(
            "matrix-degenerate",
            f"`{path}` has voxels that are {farthest:.3g} units of it away from its origin",
            "save it with the geometry of its image",
        )
    voxels = _voxels(volume, part)
    turn = rows / spacing[:, None]
    if np.linalg.det(turn) < 0.0:
        # The voxels may be counted from the other side: that is no mirror, only another order.
        origin = origin + (voxels.shape[0] - 1) * rows[0]
        rows = np.array([-rows[0], rows[1], rows[2]])
        turn = rows / spacing[:, None]
        voxels = voxels[::-1]
    places = [np.flatnonzero(voxels.any(axis=other)) for other in ((1, 2), (0, 2), (0, 1))]
    first = np.array([int(place[0]) for place in places])
    last = np.array([int(place[-1]) for place in places])
    cut = voxels[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))]
    middle = 0.5 * (last - first)
    half = middle @ rows
    frame = rigid(
        np.concatenate([turn.T, (origin + first @ rows + half)[:, None]], axis=1).tolist(),
        f"the directions of `{path}`",
    )
    # The middle of the part is where the file says; its ends are off by what the angles are.
    axes = np.array(frame.axes)
    ends = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * (last - first)
    off = ends @ rows - (ends * spacing) @ axes
    shift = np.array(frame.shift_mm) - (middle * spacing) @ axes
    return Mask(
        voxels=cut,
        spacing=vector_of(spacing),
        frame=Rigid(frame.axes, vector_of(shift)),
        doubt=float(np.linalg.norm(off, axis=1).max()),
        space=volume.space,
        said=volume.said,
        unit_mm=volume.unit_mm,
    )


def _voxels(volume: Volume, part: Part) -> NDArray[np.bool_]:
    """Which voxels belong to a part; at least one does.

    Raises:
        ImageError: None does, or it is not clear which part is meant.
    """
    if part.segment is not None:
        value, layer = _segment(volume, part.segment)
        voxels, layers = voxels_of(volume, value, layer)
        is_there = layer in layers
    elif part.label is not None:
        voxels, layers = voxels_of(volume, part.label)
        is_there = bool(layers)
        if len(layers) > 1:
            names = [s.name for s in volume.segments if s.value == part.label and s.name]
            raise ImageError(
                "part-missing",
                f"{len(layers)} layers of `{volume.path}` have voxels with the number {part.label}",
                f'name a segment, for example `segment "{names[0]}"`; those with this number are '
                f"{_listed(names)}"
                if names
                else "save its parts with a number each, in one layer",
            )
    else:
        raise _no_part(volume)
    if not is_there:
        raise ImageError(
            "part-missing",
            f"no voxel of `{volume.path}` belongs to this part",
            "look at the file in a viewer, and name a part that is there",
        )
    return voxels


def _segment(volume: Volume, name: str) -> tuple[int, int]:
    """The number and the layer of a segment.

    Raises:
        ImageError: There is no such segment, or the file does not tell it from another.
    """
    path = volume.path
    if not volume.segments:
        has_names = path.lower().endswith(_NRRD)
        raise ImageError(
            "part-missing",
            f"`{path}` has no named segments"
            if has_names
            else f"`{path}` is a NIfTI file, whose parts have numbers, not names",
            "say which voxels by their number: `label 1`",
        )
    found = [segment for segment in volume.segments if segment.name == name]
    if not found:
        names = [segment.name for segment in volume.segments]
        near = difflib.get_close_matches(name, names, n=1)
        hint = f"did you mean `{near[0]}`?" if near else f"it has {_listed(names)}"
        raise ImageError("part-missing", f"`{path}` has no segment `{name}`", hint)
    if len(found) > 1:
        raise ImageError(
            "part-missing",
            f"`{path}` has {len(found)} segments with the name `{name}`",
            "give each another name in the program that made it",
        )
    (segment,) = found
    again = "open it in Slicer, and save the segmentation once more"
    if segment.value is None:
        raise _lacking(path, f"{segment.key}_LabelValue", again)
    if segment.layer is None or not 0 <= segment.layer < volume.layer_count:
        raise _lacking(path, f"{segment.key}_Layer", again)
    same = [
        one.name
        for one in volume.segments
        if (one.value, one.layer) == (segment.value, segment.layer) and one is not segment
    ]
    if same:
        raise ImageError(
            "part-missing",
            f"the segments `{name}` and `{same[0]}` of `{path}` have the same number "
            f"{segment.value} in one layer",
            again,
        )
    return segment.value, segment.layer


def _lacking(path: str, key: str, hint: str) -> ImageError:
    return ImageError("part-missing", f"`{path}` has no number that can be in `{key}`", hint)


def _no_part(volume: Volume) -> ImageError:
    names = [segment.name for segment in volume.segments]
    if names:
        hint = f'write for example `segment "{names[0]}"`; it has {_listed(names)}'
    else:
        hint = "write for example `label 1`"
    return ImageError("part-missing", f"nothing says which part of `{volume.path}` is meant", hint)


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(f"`{name}`" for name in names[:8])
    return shown + (f" and {len(names) - 8} more" if len(names) > 8 else "")
