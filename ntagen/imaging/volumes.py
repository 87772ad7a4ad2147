"""Voxels of a file, and which of them have a number; they are never all in memory.

A file says how large its voxels are when they are unpacked, and may lie. So they are unpacked in
pieces, each piece is compared with the number and let go, and what remains is one byte a voxel.
"""

from __future__ import annotations

import bz2
import gzip
import io
import math
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Final, Literal, cast

from ntagen.imaging.mistakes import ImageError, malformed
from ntagen.imaging.space import Space

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_VOXELS: Final = 2**28
MOST_ALONG: Final = 2**16
_PIECE_BYTES: Final = 2**22
_WORD_BYTES: Final = 2**10
"""A number in text is not longer."""

Encoding = Literal["raw", "gzip", "bzip2", "text"]


@dataclass(frozen=True, slots=True)
class Packed:
    """Where voxels are.

    Attributes:
        data: The bytes of the file.
        start: Where the voxels begin in them, as they are.
        encoding: How they are packed.
        skipped: How many bytes to leave out after unpacking.
        may_end_later: Whether something else may follow the voxels.
    """

    data: bytes
    start: int
    encoding: Encoding
    skipped: int = 0
    may_end_later: bool = False


@dataclass(frozen=True, slots=True)
class Segment:
    """A named part: the voxels of a layer that have a number.

    Attributes:
        name: Its name.
        key: What the keys of the file that are about it begin with.
        value: The number; None if the file does not say it.
        layer: The layer; None if the file does not say it.
    """

    name: str
    key: str
    value: int | None
    layer: int | None


@dataclass(frozen=True, slots=True)
class Volume:
    """A grid of voxels, perhaps in several layers.

    Attributes:
        path: The file.
        sizes: How many voxels there are along each axis of the file; the first changes fastest.
        layers: The axis that counts the layers; None if there is one layer.
        dtype: The type of a number, with its byte order.
        packed: Where the numbers are.
        rows: The steps from voxel to voxel along the axes in space, with the shape (3, 3), in units
            of the file.
        origin: The centre of the first voxel.
        space: The space of `rows` and `origin`, if the file says it.
        said: What the file says of its space, if it is not the name of `space`.
        unit_mm: The unit of `rows` and `origin`, if the file says it.
        segments: The named parts.
        scale: A number ``v`` of the file means ``scale[0] * v + scale[1]``.
    """

    path: str
    sizes: tuple[int, ...]
    layers: int | None
    dtype: np.dtype[np.generic]
    packed: Packed
    rows: NDArray[np.float64]
    origin: NDArray[np.float64]
    space: Space | None
    said: str | None = None
    unit_mm: float | None = None
    segments: tuple[Segment, ...] = ()
    scale: tuple[float, float] = (1.0, 0.0)

    @property
    def layer_count(self) -> int:
        """How many layers there are."""
        return 1 if self.layers is None else self.sizes[self.layers]


def refuse_many(path: str, sizes: tuple[int, ...]) -> None:
    """Refuses sizes that cannot be, and too many voxels.

    Raises:
        ImageError: The sizes are such.
    """
    if min(sizes, default=0) < 1:
        raise malformed(
            f"`{path}` has the sizes {', '.join(map(str, sizes))}: each must be 1 or more"
        )
    along, whole = max(sizes), math.prod(sizes)
    for count, what, most in (
        (along, "voxels along an axis", MOST_ALONG),
        (whole, "voxels", MOST_VOXELS),
    ):
        if count > most:
            raise ImageError(
                "image-too-large",
                f"`{path}` has {count:,} {what}, more than {most:,}",
                "cut away what the needle cannot reach, or make it coarser",
            )


def voxels_of(
    volume: Volume, value: int, layer: int | None = None
) -> tuple[NDArray[np.bool_], tuple[int, ...]]:
    """Which voxels have a number, and the layers that have such voxels.

    Args:
        volume: The voxels.
        value: The number.
        layer: The only layer to look at.

    Raises:
        ImageError: The voxels cannot be unpacked, or are more or fewer than their sizes say.
    """
    import numpy as np

    count = volume.layer_count
    axis = len(volume.sizes) if volume.layers is None else volume.layers
    inner = math.prod(volume.sizes[:axis])
    sizes = volume.sizes[:axis] + volume.sizes[axis + 1 :]
    found = np.zeros(math.prod(sizes), dtype=np.bool_)
    hits = np.zeros(count, dtype=np.int64)
    start = 0
    for numbers in _numbers(volume):
        is_part = _meaning(numbers, volume) == value
        if count == 1:
            found[start : start + len(numbers)] = is_part
            hits[0] += np.count_nonzero(is_part)
        else:
            at = start + np.flatnonzero(is_part)
            layers = at // inner % count
            hits += np.bincount(layers, minlength=count)
            if layer is not None:
                at = at[layers == layer]
            found[at % inner + at // (inner * count) * inner] = True
        start += len(numbers)
    return found.reshape(sizes, order="F"), tuple(map(int, np.flatnonzero(hits)))


def _meaning(numbers: NDArray[np.generic], volume: Volume) -> NDArray[np.generic]:
    if volume.scale == (1.0, 0.0):
        return numbers
    import numpy as np

    with np.errstate(all="ignore"):  # A number that is too large is no label.
        meaning = numbers.astype(float) * volume.scale[0] + volume.scale[1]
    return cast("NDArray[np.generic]", meaning)


def _numbers(volume: Volume) -> Iterator[NDArray[np.generic]]:
    """The numbers of a volume in pieces, exactly as many as its sizes say."""
    whole, had = math.prod(volume.sizes), 0
    for piece in (_text if volume.packed.encoding == "text" else _binary)(volume):
        # Of one more than needed, it is known that there are too many.
        had += len(piece)
        if had > whole:
            if not volume.packed.may_end_later:
                raise _wrong_length(volume, "more")
            yield piece[: len(piece) - (had - whole)]
            return
        yield piece
    if had < whole:
        raise _wrong_length(volume, "fewer")


def _wrong_length(volume: Volume, than: Literal["more", "fewer"]) -> ImageError:
    sizes = " x ".join(map(str, volume.sizes))
    hint = "was the file cut off? save it once more" if than == "fewer" else "save it once more"
    return malformed(f"`{volume.path}` has {than} voxels than its sizes say ({sizes})", hint)


def _binary(volume: Volume) -> Iterator[NDArray[np.generic]]:
    """The numbers of bytes in pieces."""
    import numpy as np

    width, rest = volume.dtype.itemsize, b""
    for piece in _unpacked(volume):
        whole = rest + piece
        count = len(whole) // width
        yield np.frombuffer(whole, dtype=volume.dtype, count=count)
        rest = whole[count * width :]


def _unpacked(volume: Volume) -> Iterator[bytes]:
    """The bytes of a volume in pieces."""
    packed = volume.packed
    try:
        file = unpacking(packed.data, packed.encoding, packed.start)
        left = packed.skipped
        while left and (piece := file.read(min(left, _PIECE_BYTES))):
            left -= len(piece)
        while piece := file.read(_PIECE_BYTES):
            yield piece
    except (OSError, EOFError, zlib.error, ValueError) as error:
        raise malformed(
            f"the voxels of `{volume.path}` cannot be unpacked: {str(error)[:100]}",
            "was the file cut off? save it once more",
        ) from None


def unpacking(data: bytes, encoding: Encoding, start: int = 0) -> IO[bytes]:
    """A file whose content is unpacked while it is read."""
    file = io.BytesIO(data)
    file.seek(start)
    if encoding == "gzip":
        return cast("IO[bytes]", gzip.GzipFile(fileobj=file))
    if encoding == "bzip2":
        return cast("IO[bytes]", bz2.BZ2File(file))
    return file


def _text(volume: Volume) -> Iterator[NDArray[np.float64]]:
    """The numbers of a text in pieces."""
    import numpy as np

    file = io.BytesIO(volume.packed.data)
    file.seek(volume.packed.start + volume.packed.skipped)
    rest = b""
    while True:
        piece = file.read(_PIECE_BYTES // 8)
        words = (rest + piece).split()
        rest = b""
        if piece and words and not piece[-1:].isspace():
            rest = words.pop()
        try:
            if len(rest) > _WORD_BYTES:
                raise ValueError(rest[:10])
            yield np.array(list(map(float, words)))
        except ValueError:
            raise malformed(
                f"the voxels of `{volume.path}` are no numbers in text",
                "save it once more, with `encoding: gzip`",
            ) from None
        if not piece:
            return
