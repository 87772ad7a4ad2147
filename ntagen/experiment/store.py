"""The folder of an experiment: who may write to it, what it holds, what is finished in it.

::

    experiment.json      which experiment this is, and which ntagen made it
    results/*.jsonl      the finished runs, a line each; a file for each try of a block
    runs/ROW-SEED.mcap   the logs
    table.*, report.html the results, written at the end

A worker writes the log of a run under another name, renames it when it is whole and on the disk,
and then adds the line of the run, which is on the disk before anybody is told. A torn line at the
end of a file is that of a run that nobody was told of. No two processes write the same file, so
that workers on other machines need no locks; a run that was made twice is counted once.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import uuid
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final, Protocol

from ntagen import system
from ntagen.cluster.identity import identity
from ntagen.errors import InputError
from ntagen.experiment.description import Experiment
from ntagen.experiment.record import Run, run_of
from ntagen.files import lock, write_files

FORMAT_VERSION: Final = 1
HEADER: Final = "experiment.json"
RESULTS: Final = "results"
LOGS: Final = "runs"
_LOCK: Final = ".lock"
_PART: Final = ".part"


@contextlib.contextmanager
def taken(folder: Path, experiment: Owner, *, resume: bool) -> Iterator[None]:
    """Takes a folder for an experiment: nobody else may until the context ends.

    Args:
        folder: The folder; it is made if it is missing.
        experiment: What is put into it.
        resume: Whether the folder may hold runs of this experiment.

    Raises:
        InputError: The folder holds another experiment, another version made it, somebody else
            works in it, or it cannot be written.
    """
    with naming(folder):
        for part in (RESULTS, LOGS):
            Path(folder, part).mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT | system.BINARY, 0o666)
    try:
        # Where there are no locks, two experiments still write other files.
        lock(
            descriptor,
            f"another experiment is running in {folder}\n"
            "hint: wait until it has ended, or choose another folder with -o",
        )
        _claim(folder, experiment, resume=resume)
        _sweep(folder)
        try:
            yield
        finally:
            _sweep(folder)
    finally:
        os.close(descriptor)


class Named(Protocol):
    """A row of what a folder is for."""

    @property
    def id(self) -> str:
        """Its name."""

    @property
    def digest(self) -> str:
        """Rows with the same digest give the same results."""


class Owner(Protocol):
    """What a folder is for."""

    @property
    def name(self) -> str:
        """Its name, for people."""

    @property
    def digest(self) -> str:
        """Of all rows."""

    @property
    def rows(self) -> Sequence[Named]:
        """Its rows."""


def finished(folder: Path, experiment: Experiment) -> dict[tuple[str, int], Run]:
    """The finished runs of an experiment that its folder holds."""
    wanted = {(row.id, seed) for row in experiment.rows for seed in row.seeds}
    found = {run.key: run for run in _runs_in(lines_in(folder))}
    return {
        key: run
        for key, run in found.items()
        if key in wanted and (not run.log or Path(folder, run.log).is_file())
    }


def finished_in(folder: Path, block: str) -> dict[int, Run]:
    """The finished runs of a block, by seed: those of all tries."""
    return {run.seed: run for run in _runs_in(lines_in(folder, f"{block}.*.jsonl"))}


class Results:
    """A file for the runs of one try of a block; use it as a context manager.

    Args:
        folder: The folder of the experiment.
        block: The name of the block.
    """

    def __init__(self, folder: Path, block: str) -> None:
        self._path = Path(folder, RESULTS, f"{block}.{uuid.uuid4().hex[:12]}.jsonl")
        self._descriptor: int | None = None

    def __enter__(self) -> Results:
        return self

    def __exit__(self, *_: object) -> None:
        if self._descriptor is not None:
            os.close(self._descriptor)

    def add(self, line: bytes) -> None:
        """Adds the line of what was made; when this returns, it is on the disk.

        Raises:
            InputError: It cannot be written.
        """
        with naming(self._path):
            if self._descriptor is None:
                flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | system.BINARY
                self._descriptor = os.open(self._path, flags, 0o666)
            rest = memoryview(line)
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
            os.fsync(self._descriptor)


@contextlib.contextmanager
def new_log(folder: Path, row: str, seed: int) -> Iterator[tuple[Path, str]]:
    """Gives the path to write a log to; it gets its name when the context ends without an error.

    Yields:
        The path, and the name that it will have, relative to the folder.
    """
    name = f"{LOGS}/{row}-{seed}.mcap"
    part = Path(folder, LOGS, f".{row}-{seed}.{uuid.uuid4().hex[:12]}{_PART}")
    try:
        yield part, name
        with naming(part):
            part.replace(Path(folder, name))
    finally:
        part.unlink(missing_ok=True)


@contextlib.contextmanager
def naming(path: Path) -> Iterator[None]:
    """Turns an error of the operating system into a message that says how to go on.

    Raises:
        InputError: There was one.
    """
    try:
        yield
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        hint = "make room, and go on with --resume" if full else "choose another folder with -o"
        raise InputError(f"cannot write {path}: {reason}\nhint: {hint}") from error


def lines_in(folder: Path, name: str = "*.jsonl") -> Iterator[bytes]:
    """The lines of the result files with such a name; the last one of a file may be torn."""
    for path in sorted(Path(folder, RESULTS).glob(name)):
        yield from path.read_bytes().splitlines()


def _runs_in(lines: Iterable[bytes]) -> Iterator[Run]:
    for line in lines:
        run = run_of(line)
        if run is not None:
            yield run


def _sweep(folder: Path) -> None:
    """Removes the logs of runs whose workers died."""
    for part in Path(folder, LOGS).glob(f".*{_PART}"):
        part.unlink(missing_ok=True)


def _claim(folder: Path, experiment: Owner, *, resume: bool) -> None:
    """Writes whose folder this is, or checks that it is that of this experiment."""
    path = folder / HEADER
    # What ended before its first run was finished has left nothing that could be lost.
    if not path.exists() or not any(Path(folder, RESULTS).glob("*.jsonl")):
        header = {
            "format": FORMAT_VERSION,
            "ntagen": identity(),
            "name": experiment.name,
            "digest": experiment.digest,
            "rows": {row.id: row.digest for row in experiment.rows},
        }
        write_files({path: json.dumps(header, indent=1) + "\n"})
        return
    if not resume:
        raise InputError(
            f"{folder} holds an experiment already\n"
            "hint: go on with it by --resume, or choose another folder with -o"
        )
    try:
        header = json.loads(path.read_bytes())
        version, digest, rows = header["ntagen"], header["digest"], dict(header["rows"])
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path} cannot be read\nhint: choose another folder with -o") from error
    if digest != experiment.digest:
        raise InputError(
            f"{folder} holds another experiment: {_difference(rows, experiment)}\n"
            "hint: choose another folder with -o, or restore the file and its scenes"
        )
    if header.get("format") != FORMAT_VERSION or version != identity():
        raise InputError(
            f"{folder} was made by another version of ntagen: {version}, and this is "
            f"{identity()}\nhint: go on with that version, or choose another folder with -o"
        )


def _difference(rows: dict[str, str], experiment: Owner) -> str:
    """In which row an experiment differs from that of its folder."""
    for row in experiment.rows:
        if row.id not in rows:
            return f"row {row.id} is not in it"
        if rows[row.id] != row.digest:
            return f"row {row.id} or its scene has changed"
    missing = set(rows) - {row.id for row in experiment.rows}
    return f"row {min(missing)} is missing here" if missing else "its rows have another order"
