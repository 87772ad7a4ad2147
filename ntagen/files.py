"""Files that the user names: written whole or not at all, read without surprises.

Everything that the program writes goes through `write_files`, but for the log of a run, which grows
(`GrowingFile`), and strategies that queries save, which the engine writes by the same rules.

Writing:

* A file is written beside its place under a temporary name, brought to the disk, and then renamed.
  An error (a full disk, say) or an interruption leaves the old file, and nothing else.
* What is no plain file is written through and never replaced: a pipe, a device, ``/dev/stdout``.
* A symbolic link stays one: the file that it leads to is written.
* An existing file keeps its mode, and its owner where that is allowed; new files obey the umask.

Reading: folders, devices, pipes without a writer and files that are too large are refused at once.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import io
import os
import re
import secrets
import stat
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO, BinaryIO, Final, Literal

from ntagen.errors import InputError

MODEL_BYTES: Final = 256 * 2**20
"""The largest model or file of queries, as in the engine."""

EVIDENCE_BYTES: Final = 2 * 2**30
"""The largest trace, certificate or strategy."""

_LINKS_FOLLOWED: Final = 40
_PIECE_BYTES: Final = 2**20
_OWN_DESCRIPTORS: Final = re.compile(r"/dev/fd|/proc/(\d+)(/task/\d+)?/fd")


def write_files(contents: Mapping[Path, str | bytes]) -> None:
    """Writes files, each of them completely or not at all; folders are made if need be.

    Nothing is renamed before everything is written, so that an error leaves all files as they were.

    Args:
        contents: What to write, by path; texts are written in UTF-8. Existing files are replaced.

    Raises:
        InputError: A file cannot be written there.
    """
    targets: list[_Target] = []
    made: list[Path] = []
    done = False
    try:
        for path, content in contents.items():
            with _naming(path):
                target = _target(path)
                targets.append(target)
                if target.part is not None:
                    _make_folders(target.final.parent, made)
                    _write_part(target, target.part, content)
        for target in targets:
            if target.part is None:
                with _naming(target.path):
                    _write_through(target, contents[target.path])
        for target in targets:
            if target.part is not None:
                with _naming(target.path):
                    target.part.replace(target.final)
        done = True
    finally:
        for target in targets:
            if target.part is not None:
                with contextlib.suppress(OSError):
                    target.part.unlink(missing_ok=True)
        if not done:
            for folder in reversed(made):
                with contextlib.suppress(OSError):
                    folder.rmdir()


def require_apart(outputs: Mapping[str, str | Path | None], inputs: Mapping[str, Path]) -> None:
    """Refuses an output that would replace an input, or another output.

    Args:
        outputs: By the option that names it: a file to be written, if any; ``-`` is none.
        inputs: By what it is: a file that is read.

    Raises:
        InputError: Two of them are the same plain file.
    """
    taken = {_identity(path): f"the {what} {path}" for what, path in inputs.items()}
    for option, path in outputs.items():
        if path is None or str(path) == "-" or _is_special(Path(path)):
            continue
        other = taken.setdefault(_identity(Path(path)), f"the output of {option}")
        if other != f"the output of {option}":
            raise InputError(
                f"{option} {path} would replace {other}\nhint: choose another file for {option}"
            )


class GrowingFile:
    """A file that grows while something happens; an existing one is emptied.

    What is written is kept back until it is acknowledged, and an error takes back what was written
    in part: the file always ends with something whole. It is locked until it is closed or this
    process ends, however it ends. What is no plain file is not locked, and nothing is taken back.

    Args:
        path: Where it is.

    Raises:
        InputError: The file cannot be written, or somebody else is writing it.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._waiting = bytearray()
        self._length = 0
        self._is_ours = False
        with _naming(path):
            target = _target(path)
            self._is_plain = target.part is not None
            if self._is_plain:
                _make_folders(target.final.parent, [])
                flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC
                self._descriptor = os.open(target.final, flags, 0o666)
            else:
                self._descriptor = _descriptor(target)
        self.closed = False
        try:
            if self._is_plain:
                _lock(self._descriptor, path)
                self._is_ours = True
                with _naming(path):
                    os.ftruncate(self._descriptor, 0)
        except BaseException:
            self.close()
            raise

    def write(self, data: bytes) -> int:
        """Takes bytes, which `acknowledge` writes."""
        self._waiting += data
        return len(data)

    def flush(self) -> None:
        """Nothing: only what is whole is written, by `acknowledge`."""

    def tell(self) -> int:
        """How many bytes were taken."""
        return self._length + len(self._waiting)

    def acknowledge(self, *, to_disk: bool) -> None:
        """Hands all that was taken to the system: the death of this process cannot lose it.

        Args:
            to_disk: Whether also the loss of power must not lose it.

        Raises:
            InputError: It cannot be written; then the file is closed.
        """
        try:
            with _naming(self._path):
                rest = memoryview(bytes(self._waiting))
                while rest:
                    rest = rest[os.write(self._descriptor, rest) :]
                if to_disk and self._is_plain:
                    os.fsync(self._descriptor)
        except BaseException:
            self.close()
            raise
        self._length += len(self._waiting)
        self._waiting.clear()

    def close(self) -> None:
        """Closes the file as it was when something was last acknowledged."""
        if self.closed:
            return
        self.closed = True
        with contextlib.suppress(OSError):
            if self._is_ours:
                os.ftruncate(self._descriptor, self._length)
        os.close(self._descriptor)


def read_file(path: str | Path, limit_bytes: int) -> bytes:
    """The bytes of a file.

    Raises:
        OSError: It cannot be read, or is larger; `errno.EFBIG` says the latter.
    """
    with open_file(path, limit_bytes) as file:
        return _read_all(file, path, limit_bytes)


def open_file(path: str | Path, limit_bytes: int) -> BinaryIO:
    """Opens a file for reading: a plain file, or what a pipe or a terminal gives, which is read.

    Raises:
        OSError: It is something else, cannot be read, or is larger; `errno.EFBIG` says the latter.
    """
    # To open a pipe in the usual way waits for a writer, perhaps for ever.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
    try:
        kind = _readable_kind(descriptor, path, limit_bytes)
        file = os.fdopen(descriptor, "rb", buffering=0)
    except BaseException:
        os.close(descriptor)
        raise
    if kind == "file":
        return io.BufferedReader(file)
    with file:
        first = file.read(_PIECE_BYTES)
        if first == b"" and kind == "pipe":
            raise OSError(errno.ENXIO, "it is a pipe, and nobody writes to it", str(path))
        os.set_blocking(descriptor, True)
        return io.BytesIO(_read_all(file, path, limit_bytes, first or b""))


def _readable_kind(
    descriptor: int, path: str | Path, limit_bytes: int
) -> Literal["file", "pipe", "terminal"]:
    """What is open.

    Raises:
        OSError: Something that is not read, or a file that is too large.
    """
    found = os.fstat(descriptor)
    if stat.S_ISREG(found.st_mode):
        if found.st_size > limit_bytes:
            raise _too_large(path, limit_bytes)
        return "file"
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder", str(path))
    if stat.S_ISFIFO(found.st_mode):
        return "pipe"
    if os.isatty(descriptor):
        return "terminal"
    raise OSError(errno.EINVAL, "it is a device, not a file", str(path))


def _read_all(file: IO[bytes], path: str | Path, limit_bytes: int, first: bytes = b"") -> bytes:
    """What has been read and the rest, in pieces: how long a pipe is nobody knows."""
    pieces, length = [first], len(first)
    while length <= limit_bytes and (piece := file.read(_PIECE_BYTES)):
        pieces.append(piece)
        length += len(piece)
    if length > limit_bytes:
        raise _too_large(path, limit_bytes)
    return b"".join(pieces)


def _too_large(path: str | Path, limit_bytes: int) -> OSError:
    return OSError(errno.EFBIG, f"it has more than {limit_bytes // 2**20:,} MiB", str(path))


@dataclass(frozen=True, slots=True)
class _Target:
    """Where a file goes.

    Attributes:
        path: What the user named.
        final: The file that is meant, links followed.
        part: The temporary file; `None` for what is written through.
        found: What is there now.
        descriptor: What is meant is open in this process already, as ``/dev/stdout`` is.
    """

    path: Path
    final: Path
    part: Path | None
    found: os.stat_result | None = None
    descriptor: int | None = None


def _target(path: Path) -> _Target:
    """Looks at what a path leads to.

    Raises:
        OSError: It cannot be looked at, or must not be written.
        InputError: It is a folder.
    """
    final, descriptor = _followed(path)
    if descriptor is not None:
        return _Target(path, final, None, descriptor=descriptor)
    try:
        found = final.stat()
    except FileNotFoundError:
        found = None
    if found is None or stat.S_ISREG(found.st_mode):
        if found is not None and not os.access(final, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
        return _Target(path, final, final.with_name(f".ntagen-{secrets.token_hex(8)}.part"), found)
    if stat.S_ISDIR(found.st_mode):
        raise InputError(f"cannot write {path}: it is a folder")
    return _Target(path, final, None, found)


def _followed(path: Path) -> tuple[Path, int | None]:
    """The file that a path leads to, and its descriptor if it is one of this process.

    ``/dev/stdout`` is a link to such a one. To open it once more would begin at the start of the
    file that the output was sent to.
    """
    for _ in range(_LINKS_FOLLOWED):
        folder = Path(os.path.realpath(path.parent))
        path = folder / path.name
        own = _OWN_DESCRIPTORS.fullmatch(str(folder))
        if own and own[1] in (None, str(os.getpid())) and path.name.isdecimal():
            return path, int(path.name)
        if not path.is_symlink():
            return path, None
        path = folder / path.readlink()
    raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))


def _write_part(target: _Target, part: Path, content: str | bytes) -> None:
    """Writes the temporary file, with the mode that the file has or gets."""
    found = target.found
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
    descriptor = os.open(part, flags, 0o666 if found is None else 0o600)
    with os.fdopen(descriptor, "wb") as file:
        if found is not None:
            if (found.st_uid, found.st_gid) != (os.geteuid(), os.getegid()):
                with contextlib.suppress(OSError):
                    os.fchown(descriptor, found.st_uid, found.st_gid)
            os.fchmod(descriptor, stat.S_IMODE(found.st_mode))
        _write(file, content)
        file.flush()
        os.fsync(descriptor)


def _write_through(target: _Target, content: str | bytes) -> None:
    """Writes to what is no plain file."""
    with os.fdopen(_descriptor(target), "wb") as file:
        _write(file, content)


def _descriptor(target: _Target) -> int:
    """A descriptor of its own for what is no plain file."""
    if target.descriptor is not None:
        return os.dup(target.descriptor)
    return os.open(target.final, os.O_WRONLY | os.O_CLOEXEC | os.O_NOCTTY)


def _write(file: BinaryIO, content: str | bytes) -> None:
    """Writes in pieces, so that a long text is not held twice."""
    for start in range(0, len(content), _PIECE_BYTES):
        piece = content[start : start + _PIECE_BYTES]
        # The name of a file may hold bytes that are no text, and stand in one.
        file.write(piece.encode(errors="backslashreplace") if isinstance(piece, str) else piece)


def _make_folders(folder: Path, made: list[Path]) -> None:
    """Makes a folder and those that it lies in, and adds them to those that were made."""
    missing = []
    while not folder.exists():
        missing.append(folder)
        folder = folder.parent
    for one in reversed(missing):
        one.mkdir(exist_ok=True)
        made.append(one)


def _lock(descriptor: int, path: Path) -> None:
    """Locks an open file for as long as it is open.

    Raises:
        InputError: It is locked by somebody else.
    """
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(
            f"cannot write {path}: another run is being written into it\n"
            "hint: wait until it has ended, or choose another file"
        ) from None
    except OSError:
        # Some network file systems know no locks; without one the user has to take care.
        return


def _is_special(path: Path) -> bool:
    """Whether something is written through."""
    try:
        return _target(path).part is None
    except (OSError, InputError):
        return False


def _identity(path: Path) -> object:
    """What is equal for two paths of one file."""
    with contextlib.suppress(OSError):
        found = path.stat()
        return found.st_dev, found.st_ino
    return os.path.realpath(path)


@contextlib.contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Turns an error of the operating system into one that names the file that was wanted."""
    try:
        yield
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(
            f"cannot write {path}: {reason}\nhint: choose another place for it"
        ) from error
