"""The bytes of a file of anatomy."""

from __future__ import annotations

import errno

from ntagen.files import read_file
from ntagen.imaging.mistakes import ImageError


def bytes_of(path: str, limit_bytes: int) -> bytes:
    """The bytes of a file.

    Raises:
        ImageError: It cannot be read, is empty, or has more than so many bytes; of such a file
            nothing is read.
    """
    try:
        data = read_file(path, limit_bytes)
    except FileNotFoundError:
        raise ImageError(
            "file-missing",
            f"there is no file `{path}`",
            "the path begins at the folder of the environment file",
        ) from None
    except (OSError, ValueError) as error:
        if isinstance(error, OSError) and error.errno == errno.EFBIG:
            raise ImageError(
                "file-too-large",
                f"`{path}` has more than {limit_bytes // 2**20} MiB",
                "cut away what the needle cannot reach, or make it coarser",
            ) from None
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ImageError(
            "file-unreadable", f"cannot read `{path}`: {reason.lower()}", "name a file"
        ) from None
    if not data:
        raise ImageError("file-empty", f"`{path}` is empty", "export it once more")
    return data
