"""Rigid matrices from text files: those of ITK (.tfm, .txt), and plain rows of numbers.

The file of ITK names its transform, then has the nine entries of a matrix ``A`` row by row, a
translation ``t``, and a centre ``c``. A point ``x`` becomes ``A (x - c) + c + t``. Its coordinates
are in LPS, as all of ITK's.
"""

from __future__ import annotations

import re
from typing import Final

from ntagen.imaging.mistakes import ImageError, malformed
from ntagen.imaging.reading import bytes_of
from ntagen.imaging.space import Rigid, Space, rigid

_MOST_BYTES: Final = 2**20
_MATRICES: Final = ("AffineTransform", "MatrixOffsetTransformBase")
_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf)\b", re.I)


def read_transform(path: str) -> tuple[Rigid, Space | None]:
    """The motion of a file, and the space of its coordinates, if the file says it.

    Raises:
        ImageError: The file has no such matrix, or one that is not rigid.
    """
    data = bytes_of(path, _MOST_BYTES)
    if data.startswith(b"\x89HDF"):
        raise _malformed(path, "it is an HDF5 file")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise _malformed(path, "it is no text") from None
    what = f"the matrix in `{path}`"
    if text.startswith("#Insight Transform File"):
        return rigid(_itk_rows(text, path), what), "LPS"
    lines = [line.partition("#")[0] for line in text.splitlines()]
    numbers = [float(number) for line in lines for number in _NUMBER.findall(line)]
    rest = _NUMBER.sub("", "".join(lines)).strip(" \t\r,;[]()")
    if len(numbers) not in (12, 16) or rest.strip(" \t\r,;[]()"):
        raise _malformed(path, f"it has {len(numbers)} numbers, not 12 or 16")
    return rigid([numbers[i : i + 4] for i in range(0, len(numbers), 4)], what), None


def _itk_rows(text: str, path: str) -> list[list[float]]:
    """The rows of the matrix in a file of ITK."""
    kinds = re.findall(r"^Transform:\s*(\w+?)(?:_\w+)?\s*$", text, re.MULTILINE)
    if len(kinds) != 1 or kinds[0] not in _MATRICES:
        raise _malformed(path, f"it has {', '.join(kinds) or 'no transform'}, not one matrix")
    numbers = _after("Parameters", text)
    center = _after("FixedParameters", text)
    if len(numbers) != 12 or len(center) != 3:
        raise _malformed(path, "a matrix has 12 parameters, and 3 fixed ones")
    rows = []
    for i in range(3):
        turn = numbers[3 * i : 3 * i + 3]
        moved = sum(a * c for a, c in zip(turn, center, strict=True))
        rows.append([*turn, numbers[9 + i] + center[i] - moved])
    return rows


def _after(word: str, text: str) -> list[float]:
    found = re.search(rf"^{word}:(.*)$", text, re.MULTILINE)
    return [float(number) for number in _NUMBER.findall(found[1])] if found else []


def _malformed(path: str, why: str) -> ImageError:
    return malformed(
        f"`{path}` has no transform that can be read: {why}",
        "save a linear transform as text (.tfm), or as four rows of four numbers",
    )
