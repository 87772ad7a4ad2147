"""Reading and writing of the files that the user names: a file is written whole or not at all.

The program writes everything with `write_files`, with two exceptions: the log of a run grows
(`GrowingFile`), and the engine writes strategies that queries save, by the same rules.

Writing:

* A file is written under a temporary name in the same folder, flushed to the disk, and renamed.
  After an error (for example a full disk) or an interruption, only the old file is there.
* A pipe, a device and ``/dev/stdout`` are written directly and never replaced.
* A symbolic link stays a link: the file that it leads to is written.
* An existing file keeps its mode, and its owner where that is allowed; new files obey the umask.

Reading: folders, devices, pipes without a writer and files that are too large are refused at once.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import re
import stat
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, BinaryIO, Final, Literal

from ntagen import system
from ntagen.errors import InputError
from ntagen.values import dataclass

MODEL_BYTES: Final = 256 * 2**20
"""The largest model or file of queries, as in the engine."""

EVIDENCE_BYTES: Final = 2 * 2**30
"""The largest trace, certificate or strategy."""

MOST_VALUES: Final = 1_000_000
"""The most values in a text in JSON; a scene of a thousand regions has 20,000."""

_LINKS_FOLLOWED: Final = 40
_PIECE_BYTES: Final = 2**20
_READING: Final = os.O_RDONLY | system.AT_ONCE | system.OWN_TERMINAL | system.BINARY
_OWN_DESCRIPTORS: Final = re.compile(r"/dev/fd|/proc/(\d+)(/task/\d+)?/fd")


Content = str | bytes | Iterable[str]
"""What to write: a text, bytes, or a text in pieces, which need never be in memory together."""


def write_files(contents: Mapping[Path, Content]) -> None:
    """Writes files, each of them completely or not at all; missing folders are made.

    Files are renamed only when all are written, so that an error leaves all files unchanged.

    Args:
        contents: What to write, by path; texts are written in UTF-8. Existing files are replaced.
            If making the pieces of a text fails, nothing is written.

    Raises:
        InputError: A file cannot be written there.
    """
    targets: list[_Target] = []
    made: list[Path] = []
    done = False
    _half_written[id(targets)] = lambda: _remove(targets, made)
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
        _remove(targets, [] if done else made)
        del _half_written[id(targets)]


def _remove(targets: Sequence[_Target], folders: Sequence[Path]) -> None:
    """Removes temporary files, and folders that were made for them if they are empty."""
    for target in targets:
        if target.part is not None:
            with contextlib.suppress(OSError):
                target.part.unlink(missing_ok=True)
    for folder in reversed(folders):
        with contextlib.suppress(OSError):
            folder.rmdir()


_half_written: Final[dict[int, Callable[[], None]]] = {}
"""What undoes what is half written now."""


def abandon() -> None:
    """Undoes what is half written: for a program that ends at once."""
    for undo in list(_half_written.values()):
        undo()


def require_apart(outputs: Mapping[str, str | Path | None], inputs: Mapping[str, Path]) -> None:
    """Refuses an output that would replace an input, or another output.

    Args:
        outputs: The files that are written, by the option that names them; ``-`` is not a file.
        inputs: The files that are read, by what they contain.

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
    """A file that grows during a run; an existing file is emptied.

    Data stays in memory until it is acknowledged, and an error removes data that was written in
    part: the file always ends with a whole entry. The file is locked until it is closed or this
    process ends. A pipe or device is not locked, and data in it cannot be removed.

    Args:
        path: The file.

    Raises:
        InputError: The file cannot be written, or another process is writing to it.
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
                flags = os.O_RDWR | os.O_CREAT | system.BINARY
                self._descriptor = os.open(target.final, flags, 0o666)
            else:
                self._descriptor = _descriptor(target)
        self.closed = False
        _half_written[id(self)] = self.close
        try:
            if self._is_plain:
                lock(
                    self._descriptor,
                    f"cannot write {path}: another run is writing to it\n"
                    "hint: wait until that run has ended, or choose another file",
                )
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
        """Does nothing: `acknowledge` writes, when an entry is whole."""

    def tell(self) -> int:
        """How many bytes were taken."""
        return self._length + len(self._waiting)

    def acknowledge(self, *, to_disk: bool) -> None:
        """Gives all data to the operating system: if this process dies, the data is not lost.

        Args:
            to_disk: Whether the data must also survive a loss of power.

        Raises:
            InputError: The data cannot be written; then the file is closed.
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
        """Closes the file as it was at the last acknowledgement."""
        if self.closed:
            return
        self.closed = True
        _half_written.pop(id(self), None)
        with contextlib.suppress(OSError):
            if self._is_ours:
                os.ftruncate(self._descriptor, self._length)
        os.close(self._descriptor)


def read_file(path: str | Path, limit_bytes: int) -> bytes:
    """The bytes of a file.

    Raises:
        OSError: The file cannot be read, or is too large (`errno.EFBIG`).
    """
    # Pieces in a list would be in memory twice when they are joined.
    whole = io.BytesIO()
    for piece in read_pieces(path, limit_bytes):
        whole.write(piece)
    return whole.getvalue()


def json_of(text: str | bytes, most_values: int = MOST_VALUES) -> Any:  # noqa: ANN401  any document
    """The value of a text in JSON that anybody may have written.

    Seven bytes of JSON can take 240 bytes of memory, so the number of values is limited.

    Raises:
        ValueError: It is no JSON, or has more values.
        RecursionError: It is nested too deeply.
    """
    import json

    if isinstance(text, str):
        count = text.count(",") + text.count("[") + text.count("{")
    else:
        count = text.count(b",") + text.count(b"[") + text.count(b"{")
    if count > most_values:
        raise ValueError(f"it has more than {most_values:,} values")
    return json.loads(text)


def read_pieces(path: str | Path, limit_bytes: int) -> Iterator[bytes]:
    """The bytes of a file in pieces, for a reader that keeps them: so they are in memory once.

    Raises:
        OSError: The file cannot be read, or is too large (`errno.EFBIG`).
    """
    with open_file(path, limit_bytes) as file:
        yield from _pieces(file, path, limit_bytes)


def open_file(path: str | Path, limit_bytes: int) -> BinaryIO:
    """Opens a plain file, a pipe or a terminal for reading; the last two are read to the end.

    Raises:
        OSError: It is something else, cannot be read, or is too large (`errno.EFBIG`).
    """
    # Opening a pipe in the usual way waits for a writer, perhaps for ever.
    try:
        descriptor = os.open(path, _READING)
    except PermissionError:
        # Windows opens no folders.
        if Path(path).is_dir():
            raise _is_folder(path) from None
        raise
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
        system.wait_for_data(descriptor)
        rest = _pieces(file, path, limit_bytes, first or b"")
        return io.BytesIO(b"".join(rest))


def _readable_kind(
    descriptor: int, path: str | Path, limit_bytes: int
) -> Literal["file", "pipe", "terminal"]:
    """The kind of an open file: ``file``, ``pipe`` or ``terminal``.

    Raises:
        OSError: It is a folder or a device, or a file that is too large.
    """
    found = os.fstat(descriptor)
    if stat.S_ISREG(found.st_mode):
        if found.st_size > limit_bytes:
            raise _too_large(path, limit_bytes)
        return "file"
    if stat.S_ISDIR(found.st_mode):
        raise _is_folder(path)
    if stat.S_ISFIFO(found.st_mode):
        return "pipe"
    if os.isatty(descriptor):
        return "terminal"
    raise OSError(errno.EINVAL, "it is a device, not a file", str(path))


def _pieces(
    file: IO[bytes], path: str | Path, limit_bytes: int, first: bytes = b""
) -> Iterator[bytes]:
    """The bytes in `first` and all that follow, read in pieces: a pipe does not tell its length."""
    length = len(first)
    yield first
    while length <= limit_bytes and (piece := file.read(_PIECE_BYTES)):
        length += len(piece)
        yield piece
    if length > limit_bytes:
        raise _too_large(path, limit_bytes)


def _is_folder(path: str | Path) -> OSError:
    return IsADirectoryError(errno.EISDIR, "it is a folder, not a file", str(path))


def _too_large(path: str | Path, limit_bytes: int) -> OSError:
    return OSError(errno.EFBIG, f"it has more than {limit_bytes // 2**20:,} MiB", str(path))


@dataclass(frozen=True, slots=True)
class _Target:
    """The place that a file is written to.

    Attributes:
        path: The path as the user wrote it.
        final: The file itself, with links followed.
        part: The temporary file; `None` if `final` is written directly.
        found: What is there now.
        descriptor: The descriptor, if this process has the file open, such as ``/dev/stdout``.
    """

    path: Path
    final: Path
    part: Path | None
    found: os.stat_result | None = None
    descriptor: int | None = None


def _target(path: Path) -> _Target:
    """Finds out what a path leads to.

    Raises:
        OSError: That cannot be found out, or the file must not be written.
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
        return _Target(path, final, final.with_name(f".ntagen-{os.urandom(8).hex()}.part"), found)
    if stat.S_ISDIR(found.st_mode):
        raise InputError(f"cannot write {path}: it is a folder\nhint: add a file name to the path")
    return _Target(path, final, None, found)


def _followed(path: Path) -> tuple[Path, int | None]:
    """The file that a path leads to, and its descriptor if this process has it open.

    ``/dev/stdout`` is a link to such a file. Opening it once more would write from the start of the
    file to which the output is redirected.
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


def _write_part(target: _Target, part: Path, content: Content) -> None:
    """Writes the temporary file, with the mode that the file has or gets."""
    found = target.found
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | system.BINARY
    descriptor = os.open(part, flags, 0o666 if found is None else 0o600)
    with os.fdopen(descriptor, "wb") as file:
        if found is not None:
            system.keep_access(descriptor, found)
        _write(file, content)
        file.flush()
        os.fsync(descriptor)


def _write_through(target: _Target, content: Content) -> None:
    """Writes to a pipe or device."""
    with os.fdopen(_descriptor(target), "wb") as file:
        _write(file, content)


def _descriptor(target: _Target) -> int:
    """A new descriptor for a pipe or device."""
    if target.descriptor is not None:
        return os.dup(target.descriptor)
    # Opening for writing does wait: for the reader of a pipe.
    return os.open(target.final, os.O_WRONLY | system.OWN_TERMINAL | system.BINARY)


def _write(file: BinaryIO, content: Content) -> None:
    """Writes in pieces, so that a long text is not in memory twice."""
    if not isinstance(content, str | bytes):
        for text in content:
            file.write(text.encode(errors="backslashreplace"))
        return
    for start in range(0, len(content), _PIECE_BYTES):
        piece = content[start : start + _PIECE_BYTES]
        # The text may contain a file name with bytes that are not UTF-8.
        file.write(piece.encode(errors="backslashreplace") if isinstance(piece, str) else piece)


def _make_folders(folder: Path, made: list[Path]) -> None:
    """Makes a folder and its parents, and adds those that are new to `made`."""
    missing = []
    while not folder.exists():
        missing.append(folder)
        folder = folder.parent
    for one in reversed(missing):
        one.mkdir(exist_ok=True)
        made.append(one)


def lock(descriptor: int, refusal: str) -> None:
    """Locks an open file for as long as it is open.

    Args:
        descriptor: The file.
        refusal: What to say if another process has locked it.

    Raises:
        InputError: Another process has locked it.
    """
    try:
        system.take_lock(descriptor)
    except BlockingIOError:
        raise InputError(refusal) from None
    except OSError:
        # Some network file systems have no locks; then nothing prevents two writers.
        return


def require_unlocked(path: Path, refusal: str) -> None:
    """Refuses a file to which a process is writing.

    Args:
        path: The file; one that cannot be opened is left to whoever reads it.
        refusal: What to say.

    Raises:
        InputError: A process is writing to it.
    """
    try:
        descriptor = os.open(path, _READING)
    except OSError:
        return
    try:
        lock(descriptor, refusal)
    finally:
        os.close(descriptor)


def _is_special(path: Path) -> bool:
    """Whether this is a pipe or device, which is written directly."""
    try:
        return _target(path).part is None
    except (OSError, InputError):
        return False


def _identity(path: Path) -> object:
    """A value that is equal for two paths to the same file."""
    with contextlib.suppress(OSError):
        found = path.stat()
        return found.st_dev, found.st_ino
    return os.path.realpath(path)


@contextlib.contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Turns an error of the operating system into one that names the user's file."""
    try:
        yield
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(
            f"cannot write {path}: {reason}\nhint: choose another place for the file"
        ) from error
