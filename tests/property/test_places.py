"""Where the readers of anatomy put voxels and points, on random files of each format.

The truth is computed from the numbers that the files were made of (`tests/random_anatomy.py`).
``NTAGEN_HEADERS=1000 NTAGEN_SEED=1`` makes a large run.
"""

from __future__ import annotations

import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from ntagen.imaging.meshes import read_mesh
from ntagen.imaging.mistakes import ImageError
from ntagen.imaging.nifti import Matrix
from ntagen.imaging.segmentations import Part, read_mask
from ntagen.imaging.space import Space, between
from tests.random_anatomy import TO_LPS, UNITS, Sample, random_mesh, random_nifti, random_nrrd

HEADERS = int(os.environ.get("NTAGEN_HEADERS", "100"))
SEED = int(os.environ.get("NTAGEN_SEED", "0"))
UNITS_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
Make = Callable[[random.Random], Sample]


def places_mm(sample: Sample, path: Path) -> np.ndarray:
    """Where the product puts the voxels or the points of a file, in mm in LPS."""
    words = sample.words.split()
    (written,) = [word for word in words if word in ("LPS", "RAS")] or [None]
    units = [UNITS_MM[word] for word in words if word in UNITS_MM]
    if sample.part is None:
        mesh = read_mesh(str(path))
        moved = between(cast("Space", written), "LPS")
        return moved.points(mesh.corners.reshape(-1, 3) * units[0])
    (matrix,) = [word for word in words if word.endswith("form")] or [None]
    named = {"segment" if isinstance(sample.part, str) else "label": sample.part}
    mask = read_mask(str(path), Part(**named, matrix=cast("Matrix | None", matrix)))  # type: ignore[arg-type]
    unit_mm = mask.unit_mm or units[0]
    assert mask.doubt * unit_mm <= sample.exact_mm
    own = np.argwhere(mask.voxels) * mask.spacing
    space = cast("Space", mask.space or written)
    return between(space, "LPS").points(mask.frame.points(own) * unit_mm)


def in_order(places: np.ndarray) -> np.ndarray:
    """Places in an order that rounding does not change."""
    aside = np.array([0.5477, 0.6113, 0.5711])
    return places[np.argsort(places @ aside)]


def check_sample(sample: Sample, folder: Path) -> None:
    """The places of a file are right, or it is refused by a message that names what is wrong."""
    path = sample.write(folder)
    if sample.refused:
        with pytest.raises(ImageError) as caught:
            places_mm(sample, path)
        assert sample.refused in caught.value.message
        return
    found = places_mm(sample, path)
    assert found.shape == sample.places_mm.shape
    apart = np.abs(in_order(found) - in_order(sample.places_mm)).max()
    assert apart <= sample.exact_mm


@pytest.mark.parametrize("make", [random_nrrd, random_nifti, random_mesh])
def test_voxels_and_points_are_where_the_file_says(make: Make, tmp_path: Path) -> None:
    for number in range(SEED, SEED + HEADERS):
        sample = make(random.Random(number))
        try:
            check_sample(sample, tmp_path)
        except BaseException as error:
            error.add_note(f"{make.__name__}: NTAGEN_SEED={number} NTAGEN_HEADERS=1")
            raise


def other_places_mm(sample: Sample, path: Path) -> np.ndarray:
    """Where pynrrd, nibabel or trimesh puts the voxels or the points of a file."""
    words = sample.words.split()
    if sample.part is None:
        mesh = pytest.importorskip("trimesh").load(path, force="mesh", process=False)
        return mesh.vertices * TO_LPS[words[0]] * UNITS_MM[words[1]]
    if ".nii" in path.name.lower():
        image = pytest.importorskip("nibabel").load(path)
        affine = image.get_qform() if "qform" in words else image.affine
        unit_mm = {"meter": 1000.0, "micron": 0.001}.get(image.header.get_xyzt_units()[0], 1.0)
        places = np.argwhere(image.get_fdata().reshape(image.shape[:3]) == sample.part)
        return (places @ affine[:3, :3].T + affine[:3, 3]) * TO_LPS["RAS"] * unit_mm
    data, header = pytest.importorskip("nrrd").read(str(path))
    space = header.get("space", "").lower()
    name = "".join(word[0] for word in space.split("-")[:3]) if "-" in space else space[:3]
    sides = TO_LPS[sample.words or name.upper()]
    unit_mm = UNITS.get(header.get("space units", ["mm"])[0], 1.0)
    rows = np.nan_to_num(np.asarray(header["space directions"], dtype=float))[:, :3]
    places = np.argwhere(data == 3)
    if isinstance(sample.part, str) and (~rows.any(axis=1)).any():
        layers = [i for i, row in enumerate(rows) if not row.any() and data.shape[i] > 1]
        if layers:
            places = places[places[:, layers[0]] == int(sample.part.split()[1])]
    return (places @ rows + header["space origin"][:3]) * sides * unit_mm


# pynrrd leaves files open after an error.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("make", [random_nrrd, random_nifti, random_mesh])
def test_other_readers_agree(make: Make, tmp_path: Path) -> None:
    """Where another package can read a file; none reads all of them."""
    compared = 0
    for number in range(SEED, SEED + HEADERS):
        sample = make(random.Random(number))
        path = sample.write(tmp_path)
        if sample.refused:
            continue
        try:
            found = other_places_mm(sample, path)
        except Exception:  # They raise errors of any kind.
            continue
        expected = np.unique(sample.places_mm.round(6), axis=0)
        found = np.unique(found.round(6), axis=0)
        assert found.shape == expected.shape, number
        apart = np.abs(in_order(found) - in_order(expected)).max()
        assert apart <= 3e-6 * max(1.0, float(np.abs(expected).max()) / 300.0), number
        compared += 1
    assert compared > HEADERS // 4
