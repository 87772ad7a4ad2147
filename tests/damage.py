"""Damaged files: what is done to them, and what must come of reading them."""

from __future__ import annotations

import os
import random
import re
import shutil
from collections.abc import Callable
from pathlib import Path

from ntagen.errors import InputError

Read = Callable[[Path], object]

SEED = int(os.environ.get("NTAGEN_SEED", "0"))
MOST_BYTES = 512 * 2**20
"""No file may make a reader take more memory than this beyond the file's size."""

NUMBERS = (
    *(b"0", b"-1", b"1", b"2", b"3", b"7", b"1e308", b"1e999", b"-1e-320", b"1e12", b"nan", b"inf"),
    *(b"", b"1,5", b"1_0", b"0x10", b"+.5", b"1e", b"null", b"[]", b"{}", b'"a"', b"true", b"-"),
    *(b"NaN", b"MISSING", b"1.2.3"),
    *(b"255", b"65536", b"1000000000000", b"9" * 19, b"1" * 400, b"1" * 5000, b"\xd9\xa3"),
)
SIGNS = (
    b",",
    b";",
    b":",
    b"=",
    b"\n",
    b"\r",
    b'"',
    b"#",
    b"\0",
    b"\xff",
    b"\xe2\x80\xa8",
    b"[",
    b"{",
)
SIZES = (0, 1, 2**15, 2**16, 2**31 - 1, 2**32 - 1, 10**12, 2**63, 2**64 - 1)


def damaged(data: bytes, draw: random.Random) -> bytes:
    """A file with a few changes: cut, doubled, flipped, with other numbers, signs and sizes."""
    for _ in range(draw.choice((1, 1, 2, 4, 12))):
        start = draw.randrange(len(data) + 1)
        end = min(len(data), start + draw.choice((1, 4, 30, 400)))
        kind = draw.randrange(9)
        if kind == 0 and draw.random() < 0.3:
            data = data[:start]
        elif kind == 1:
            data = data[:start] + data[end:]
        elif kind == 2:
            data = data[:start] + data[start:end] * draw.choice((2, 2, 50)) + data[end:]
        elif kind == 3:
            data = data[:start] + draw.randbytes(end - start) + data[end:]
        elif kind == 4 and start < len(data):
            data = data[:start] + bytes([data[start] ^ 1 << draw.randrange(8)]) + data[start + 1 :]
        elif kind == 5:
            data = data[:start] + draw.choice(SIGNS) + data[draw.choice((start, start + 1)) :]
        elif kind == 6:
            width, order = draw.choice((2, 4, 8)), draw.choice(("little", "big"))
            size = (draw.choice(SIZES) & 256**width - 1).to_bytes(width, order)
            data = data[:start] + size + data[start + width :]
        else:
            data = with_number(data, draw)
    return data


def with_number(data: bytes, draw: random.Random) -> bytes:
    """One of the numbers in a text is another one; most are in the first two thousand bytes."""
    window = draw.choice((0, draw.randrange(max(1, len(data)))))
    places = list(re.finditer(rb"-?[0-9]+(\.[0-9]+)?", data[window : window + 2000]))
    if not places:
        return data
    place = draw.choice(places)
    start, end = window + place.start(), window + place.end()
    return data[:start] + draw.choice(NUMBERS) + data[end:]


def check_files(folder: Path, name: str, seeds: list[bytes], read: Read, files: int) -> int:
    """All damaged files are read, or refused by an error that begins with their names.

    Returns:
        How many were read.
    """
    path = folder / name
    read_well, before = 0, peak_bytes()
    for number in range(SEED, SEED + files):
        draw = random.Random(f"{name} {number}")
        path.write_bytes(damaged(draw.choice(seeds), draw))
        read_well += is_read(path, read, number)
    assert peak_bytes() - before < MOST_BYTES
    return read_well


def is_read(path: Path, read: Read, number: int) -> bool:
    """Whether a file is read; if not, the first line of the error has its name, with exit code 2.

    ``NTAGEN_FOUND=FOLDER`` keeps the files that are wrong.
    """
    try:
        read(path)
    except InputError as error:
        if error.exit_code != 2 or str(path) not in str(error).partition("\n")[0]:
            raise AssertionError(f"file {number}: {error}") from error
        return False
    except BaseException as error:
        error.add_note(f"file {number}")
        if "NTAGEN_FOUND" in os.environ:
            shutil.copy(path, Path(os.environ["NTAGEN_FOUND"]) / f"{number}-{path.name}")
        raise
    return True


def peak_bytes() -> int:
    """The greatest size that this process had; 0 where nobody counts it."""
    status = Path("/proc/self/status")
    found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text()) if status.exists() else None
    return int(found[1]) * 1024 if found else 0
