"""Parts of segmentations from files: NRRD with named segments by pynrrd, NIfTI by nibabel."""

from __future__ import annotations

import contextlib
import difflib
import gzip
import io
import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from ntagen.imaging.mistakes import ImageError
from ntagen.imaging.optional import package
from ntagen.imaging.reading import bytes_of
from ntagen.imaging.space import Rigid, Space, rigid
from ntagen.shapes import Vector

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_BYTES: Final = 512 * 2**20
MOST_VOXELS: Final = 2**28
_SPACES: Final[dict[str, Space]] = {
    "left-posterior-superior": "LPS",
    "lps": "LPS",
    "right-anterior-superior": "RAS",
    "ras": "RAS",
}
_UNITS_MM: Final = {
    **{"mm": 1.0, "millimeter": 1.0, "cm": 10.0, "m": 1000.0, "meter": 1000.0},
    **{"um": 0.001, "micron": 0.001, "µm": 0.001},
}


@dataclass(frozen=True, slots=True)
class Part:
    """What is taken of a segmentation: a segment by its name, or the voxels with a number."""

    segment: str | None = None
    label: int | None = None


@dataclass(frozen=True, slots=True)
class Mask:
    """The voxels of one part of a segmentation; each is a box about its centre.

    Attributes:
        voxels: Whether a voxel belongs to the part; cut to the part.
        spacing: The edges of a voxel, in units of the file.
        frame: From the file's axes, with the centre of the first voxel as origin, to its space.
        space: The space that the file says.
        unit_mm: The unit that the file says, in mm.
    """

    voxels: NDArray[np.bool_]
    spacing: Vector
    frame: Rigid
    space: Space | None
    unit_mm: float | None


def read_mask(path: str, part: Part) -> Mask:
    """A part of the segmentation in a file.

    Raises:
        ImageError: The file cannot be read, is no segmentation, or has no such part.
    """
    name = path.lower()
    if name.endswith(".nrrd"):
        return _from_nrrd(path, part)
    if name.endswith((".nii", ".nii.gz")):
        return _from_nifti(path, part)
    raise ImageError(
        "image-malformed",
        f"`{path}` is no segmentation that can be read",
        "name a file that ends with .nrrd, .seg.nrrd, .nii or .nii.gz",
    )


def _from_nrrd(path: str, part: Part) -> Mask:
    """A part of a NRRD file; `Segment0_Name` and so on are the names of Slicer."""
    import numpy as np

    data = bytes_of(path, MOST_BYTES)
    nrrd = package("nrrd", "NRRD files")
    file = io.BytesIO(data)
    try:
        header: Mapping[str, Any] = nrrd.read_header(file)
    except Exception as error:  # pynrrd raises errors of several kinds.
        raise _malformed(path, "NRRD", error) from None
    if "data file" in header or "datafile" in header:
        raise ImageError(
            "image-malformed",
            f"`{path}` has its voxels in another file",
            "save it as one file (.nrrd with the data attached)",
        )
    try:
        _refuse_many(path, [int(size) for size in header["sizes"]])
        voxels = nrrd.read_data(header, file, None)
    except ImageError:
        raise
    except Exception as error:
        raise _malformed(path, "NRRD", error) from None
    rows = np.asarray(header.get("space directions", np.full((3, 3), np.nan)), dtype=float)
    rows = rows[~np.isnan(rows).all(axis=1)] if rows.ndim == 2 else rows
    origin = np.asarray(header.get("space origin", np.full(3, np.nan)), dtype=float)
    if rows.shape != (3, 3) or origin.shape != (3,):
        raise ImageError(
            "matrix-degenerate",
            f"`{path}` does not say where its voxels are: it needs three space directions and a"
            " space origin",
            "save it with the geometry of its image, as Slicer does",
        )
    label, layer = _number_of(path, header, part)
    if voxels.ndim == 4 and layer < len(voxels):
        voxels = voxels[layer]
    if voxels.ndim != 3:
        raise ImageError(
            "image-malformed", f"`{path}` has {voxels.ndim} dimensions, not 3", "save one volume"
        )
    space = _SPACES.get(str(header.get("space", "")).lower())
    units = {str(unit).strip('" ').lower() for unit in header.get("space units", ["mm"])}

    unit_mm = _UNITS_MM.get(units.pop()) if len(units) == 1 else None
    return _mask(path, voxels == label, rows, origin, space, unit_mm)


def _number_of(path: str, header: Mapping[str, Any], part: Part) -> tuple[int, int]:
    """The number of a segment in the voxels, and the layer that it is in.

    Raises:
        ImageError: There is no such segment, or none is named.
    """
    names: dict[str, tuple[int, int]] = {}
    number = 0
    while f"Segment{number}_LabelValue" in header or f"Segment{number}_Name" in header:
        name = str(header.get(f"Segment{number}_Name", header.get(f"Segment{number}_ID", number)))
        value = int(header.get(f"Segment{number}_LabelValue", number + 1))
        names.setdefault(name, (value, int(header.get(f"Segment{number}_Layer", 0))))
        number += 1
    if part.segment is None:
        if part.label is None:
            raise _no_part(path, list(names))
        return part.label, 0
    if part.segment not in names:
        if not names:
            raise ImageError(
                "part-missing",
                f"`{path}` has no named segments",
                "say which voxels by their number: `label 1`",
            )
        near = difflib.get_close_matches(part.segment, names, n=1)
        hint = f"did you mean `{near[0]}`?" if near else f"it has {_listed(list(names))}"
        raise ImageError("part-missing", f"`{path}` has no segment `{part.segment}`", hint)
    return names[part.segment]


def _from_nifti(path: str, part: Part) -> Mask:
    """A part of a NIfTI file, which is in RAS by its standard."""
    import numpy as np

    data = bytes_of(path, MOST_BYTES)
    nibabel = package("nibabel", "NIfTI files")
    if data[:2] == b"\x1f\x8b":
        try:
            with gzip.GzipFile(fileobj=io.BytesIO(data)) as file:
                data = file.read(8 * MOST_VOXELS)
        except (OSError, EOFError, zlib.error) as error:
            raise _malformed(path, "NIfTI", error) from None
    try:
        image = nibabel.Nifti1Image.from_bytes(data)
        sizes = [int(size) for size in image.shape]
        _refuse_many(path, sizes)
        voxels = np.squeeze(np.asanyarray(image.dataobj))
    except ImageError:
        raise
    except Exception as error:  # nibabel raises errors of several kinds.
        raise _malformed(path, "NIfTI", error) from None
    if part.segment is not None:
        raise ImageError(
            "part-missing",
            f"`{path}` is a NIfTI file, whose parts have numbers, not names",
            "write for example `label 1`",
        )
    if part.label is None:
        raise _no_part(path, [])
    if voxels.ndim != 3:
        raise ImageError(
            "image-malformed", f"`{path}` has {voxels.ndim} dimensions, not 3", "save one volume"
        )
    header = image.header
    if int(header["sform_code"]) == 0 and int(header["qform_code"]) == 0:
        raise ImageError(
            "matrix-degenerate",
            f"`{path}` does not say where its voxels are: it has neither an sform nor a qform",
            "save it with the geometry of its image",
        )

    unit_mm = _UNITS_MM.get(str(header.get_xyzt_units()[0]))
    affine = np.asarray(image.affine, dtype=float)
    return _mask(path, voxels == part.label, affine[:3, :3].T, affine[:3, 3], "RAS", unit_mm)


def _mask(
    path: str,
    voxels: NDArray[np.bool_],
    rows: NDArray[np.float64],
    origin: NDArray[np.float64],
    space: Space | None,
    unit_mm: float | None,
) -> Mask:
    """A mask cut to its part; `rows` are the steps from voxel to voxel along each axis.

    Raises:
        ImageError: The axes are no right angles, or no voxel belongs to the part.
    """
    import numpy as np

    spacing = np.linalg.norm(rows, axis=1)
    what = f"the directions of `{path}`"
    if not np.isfinite(rows).all() or not np.isfinite(origin).all() or spacing.min() <= 1e-9:
        raise ImageError(
            "matrix-degenerate",
            f"the spacing of `{path}` is {', '.join(f'{s:g}' for s in spacing)}",
            "save it with the geometry of its image: each spacing is greater than 0",
        )
    if not voxels.any():
        raise ImageError(
            "part-missing",
            f"no voxel of `{path}` belongs to this part",
            "look at the file in a viewer, and name a part that is there",
        )
    turn = rows / spacing[:, None]
    if np.linalg.det(turn) < 0.0:
        # The voxels may be counted from the other side: that is no mirror, only another order.
        origin = origin + (voxels.shape[0] - 1) * rows[0]
        turn = np.array([-turn[0], turn[1], turn[2]])
        voxels = voxels[::-1]
    places = [np.flatnonzero(voxels.any(axis=other)) for other in ((1, 2), (0, 2), (0, 1))]
    first = np.array([int(place[0]) for place in places])
    last = [int(place[-1]) for place in places]
    cut = voxels[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))]
    corner = origin + (first * spacing) @ turn
    columns = np.concatenate([turn.T, corner[:, None]], axis=1)
    x, y, z = map(float, spacing)
    frame = rigid(columns.tolist(), what)
    return Mask(np.ascontiguousarray(cut), (x, y, z), frame, space, unit_mm)


def _no_part(path: str, names: Sequence[str]) -> ImageError:
    if names:
        hint = f'write for example `segment "{names[0]}"`; it has {_listed(names)}'
    else:
        hint = "write for example `label 1`"
    return ImageError("part-missing", f"nothing says which part of `{path}` is meant", hint)


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(f"`{name}`" for name in names[:8])
    return shown + (f" and {len(names) - 8} more" if len(names) > 8 else "")


def _refuse_many(path: str, sizes: Sequence[int]) -> None:
    if math.prod(sizes) > MOST_VOXELS:
        raise ImageError(
            "image-too-large",
            f"`{path}` has {math.prod(sizes):,} voxels, more than {MOST_VOXELS:,}",
            "cut away what the needle cannot reach, or make it coarser",
        )


def _malformed(path: str, kind: str, error: Exception) -> ImageError:
    text = str(error)
    with contextlib.suppress(IndexError):
        text = text.splitlines()[0]
    return ImageError(
        "image-malformed",
        f"`{path}` is no {kind} file: {(text or type(error).__name__)[:120]}",
        "save it once more",
    )
