"""Reads NIfTI files of both versions; nibabel reads their headers.

NIfTI is in RAS by its standard. A file can have two matrices, a qform and an sform. They may mean
different spaces (the scanner's, and that of an atlas), so if both are there and disagree, the
description has to say which one counts.
"""

from __future__ import annotations

import itertools
import math
import zlib
from typing import TYPE_CHECKING, Any, Final, Literal

from ntagen.imaging.mistakes import ImageError, malformed
from ntagen.imaging.reading import bytes_of
from ntagen.imaging.volumes import Encoding, Packed, Volume, refuse_many, unpacking

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_BYTES: Final = 512 * 2**20
Matrix = Literal["qform", "sform"]

_MAGIC: Final = {1: b"n+1\0", 2: b"n+2\0\r\n\x1a\n"}
_HEADER_BYTES: Final = {1: 348, 2: 540}
_UNITS_MM: Final = {0: None, 1: 1000.0, 2: 1.0, 3: 0.001}
_APART_MM: Final = 0.1
"""Matrices agree if they place no voxel farther apart; a qform is stored as a rounded
quaternion."""


def read_nifti(path: str, matrix: Matrix | None) -> Volume:
    """The voxels of a NIfTI file.

    Args:
        path: The file.
        matrix: Which of its matrices counts; None if they agree.

    Raises:
        ImageError: It cannot be read, or does not say where its voxels are.
    """
    data = bytes_of(path, MOST_BYTES)
    try:
        # Who reads no such file does not need it.
        import nibabel
    except ImportError as error:
        raise ImageError(
            "package-missing",
            "NIfTI files are read by the package nibabel, which is not installed",
            "install it with `python -m pip install 'ntagen[imaging]'`",
        ) from error
    encoding: Encoding = "gzip" if data[:2] == b"\x1f\x8b" else "raw"
    header = _header(path, nibabel, data, encoding)
    try:
        dtype: np.dtype[np.generic] = header.get_data_dtype()
    except Exception:  # nibabel raises errors of several kinds.
        raise _wrong(path, "datatype", int(header["datatype"]), "which is none") from None
    if dtype.kind not in "iuf" or dtype.itemsize > 8:
        raise _wrong(path, "datatype", int(header["datatype"]), f"{dtype}, which has no parts")
    dim = [int(size) for size in header["dim"]]
    if not 1 <= dim[0] <= 7:
        raise _wrong(path, "dim", dim[0], "where the number of axes must be")
    sizes = tuple(dim[1 : dim[0] + 1])
    refuse_many(path, sizes)
    if len(sizes) < 3 or math.prod(sizes[3:]) != 1:
        shown = len([size for size in sizes if size > 1])
        raise malformed(f"`{path}` has {shown} dimensions, not 3", "save one volume")
    offset = float(header["vox_offset"])
    if not int(header["sizeof_hdr"]) <= offset < 2**31 or offset % 1.0:
        raise _wrong(path, "vox_offset", offset, "where no voxels can begin")
    unit = int(header["xyzt_units"]) & 7
    if unit not in _UNITS_MM:
        raise ImageError(
            "unit-unknown",
            f"`xyzt_units` in `{path}` is {unit}, which is no unit of length",
            "save it in mm",
        )
    affine = _affine(path, header, sizes[:3], matrix)
    start, skipped = (0, int(offset)) if encoding == "gzip" else (int(offset), 0)
    return Volume(
        path=path,
        sizes=sizes[:3],
        layers=None,
        dtype=dtype,
        packed=Packed(data, start, encoding, skipped, may_end_later=True),
        rows=affine[:3, :3].T,
        origin=affine[:3, 3],
        space="RAS",
        unit_mm=_UNITS_MM[unit],
        scale=_scale(path, header),
    )


def _header(path: str, nibabel: Any, data: bytes, encoding: Encoding) -> Any:  # noqa: ANN401
    """The header as nibabel reads it; nothing in it is checked.

    Raises:
        ImageError: This is none.
    """
    try:
        start = unpacking(data, encoding).read(_HEADER_BYTES[2])
        version = 2 if start[:4] in (b"\x1c\x02\0\0", b"\0\0\x02\x1c") else 1
        kind = nibabel.Nifti1Header if version == 1 else nibabel.Nifti2Header
        header = kind(start[: _HEADER_BYTES[version]], check=False)
        magic = start[344:348] if version == 1 else start[4:12]
    except (OSError, EOFError, zlib.error) as error:
        raise _no_nifti(path, f"it cannot be unpacked: {error}") from None
    except Exception as error:  # nibabel raises errors of several kinds.
        raise _no_nifti(path, str(error).partition("\n")[0]) from None
    if int(header["sizeof_hdr"]) != _HEADER_BYTES[version]:
        raise _no_nifti(path, f"`sizeof_hdr` is {int(header['sizeof_hdr'])}, not 348 or 540")
    if magic.startswith(b"ni"):
        raise _no_nifti(path, "it is the header of a pair, whose voxels are in another file")
    if magic != _MAGIC[version]:
        raise _no_nifti(path, f"`magic` is {magic!r}")
    return header


def _scale(path: str, header: Any) -> tuple[float, float]:  # noqa: ANN401  of nibabel
    """What a number means; a slope of 0 says that it means itself."""
    slope, intercept = float(header["scl_slope"]), float(header["scl_inter"])
    if slope == 0.0 or not math.isfinite(slope):
        return 1.0, 0.0
    if not math.isfinite(intercept):
        raise _wrong(path, "scl_inter", intercept, "which is no number")
    return slope, intercept


def _affine(
    path: str,
    header: Any,  # noqa: ANN401  of nibabel
    sizes: tuple[int, ...],
    matrix: Matrix | None,
) -> NDArray[np.float64]:
    """The matrix that counts, with the shape (4, 4).

    Raises:
        ImageError: There is none, or two that disagree and none is named, or not the one named.
    """
    import numpy as np

    found: dict[Matrix, NDArray[np.float64]] = {}
    forms: tuple[Matrix, Matrix] = ("qform", "sform")
    for form in forms:
        code = int(header[f"{form}_code"])
        if code == 0 or (matrix is not None and matrix != form):
            continue
        if not 1 <= code <= 5:
            raise _wrong(path, f"{form}_code", code, "which is no space of NIfTI")
        try:
            with np.errstate(all="ignore"):  # Numbers that are not finite are refused later.
                made = header.get_qform() if form == "qform" else header.get_sform()
            found[form] = np.asarray(made, dtype=float)
        except Exception as error:  # nibabel raises errors of several kinds.
            raise ImageError(
                "matrix-degenerate",
                f"the {form} of `{path}` is none: {str(error).partition(chr(10))[0][:80]}",
                "save it with the geometry of its image",
            ) from None
    if not found:
        has = "no " + matrix if matrix is not None else "neither an sform nor a qform"
        raise ImageError(
            "matrix-degenerate",
            f"`{path}` does not say where its voxels are: it has {has}",
            "save it with the geometry of its image",
        )
    if len(found) == 2:
        ends = np.array(list(itertools.product(*((0, size - 1) for size in sizes), [1])))
        with np.errstate(all="ignore"):
            apart = float(np.abs(ends @ (found["qform"] - found["sform"]).T).max())
        unit_mm = _UNITS_MM[int(header["xyzt_units"]) & 7]
        # A matrix that is not finite disagrees with all.
        if not apart * (unit_mm or 1.0) <= _APART_MM:
            shown = f"{apart:.4g} units" if unit_mm is None else f"{apart * unit_mm:.4g} mm"
            raise ImageError(
                "matrix-ambiguous",
                f"qform and sform of `{path}` place the same voxel up to {shown} apart",
                "look up which one is meant where the file was made, and write `in qform` or "
                "`in sform`",
            )
    return found["sform"] if "sform" in found else found["qform"]


def _wrong(path: str, field: str, value: float, why: str) -> ImageError:
    return malformed(f"`{field}` in `{path}` is {value:g}, {why}")


def _no_nifti(path: str, why: str) -> ImageError:
    return malformed(f"`{path}` is no NIfTI file: {why[:120]}")
