"""Workers of a Dask cluster: other machines, which share the folder of the experiment.

A worker writes each run into the folder before it tells of it, so nothing is lost with a worker,
the scheduler or this process. Dask gives the block of a lost worker to another one, which makes the
runs that are missing. The workers need the same version of ntagen, and see scenes and folder under
the same paths.
"""

from __future__ import annotations

import contextlib
import importlib
import itertools
import re
from typing import Any, Final

from ntagen.errors import InputError, NtagenError
from ntagen.experiment import making
from ntagen.experiment.crew import Done
from ntagen.experiment.identity import identity
from ntagen.experiment.making import Block

_CONNECT_S: Final = 10.0

_ADDRESS: Final = re.compile(r"([a-z]+://)?[^\s/]+:[0-9]{1,5}")

_BLOCKS_AHEAD: Final = 2
"""So many blocks for each worker are handed over, so that none waits for this process."""


class DaskCrew:
    """The workers of a scheduler.

    Args:
        address: The address of the scheduler, as ``tcp://host:8786``.

    Raises:
        InputError: Dask is not installed, the scheduler cannot be reached, or a worker has another
            version of ntagen.
    """

    def __init__(self, address: str) -> None:
        self._dask: Any = _distributed()
        if not _ADDRESS.fullmatch(address):
            raise InputError(
                f"'{address}' is no address of a Dask scheduler\n"
                "hint: write it as tcp://host:8786, as `dask scheduler` prints it"
            )
        try:
            self._client = self._dask.Client(address, timeout=_CONNECT_S, set_as_default=False)
        except (OSError, ValueError, ImportError) as error:
            said = " ".join(str(error).split())
            raise InputError(
                f"there is no Dask scheduler at {address}: {said}\n"
                "hint: start one with `dask scheduler`, and workers with `dask worker ADDRESS "
                "--nthreads 1`"
            ) from error
        self._busy: dict[Any, Block] = {}
        self._numbers = itertools.count()
        try:
            self._require_same_version()
        except BaseException:
            self.close()
            raise

    @property
    def size(self) -> int:
        """The number of workers that are there now; 1 if they are still to come."""
        threads: dict[str, int] = self._client.nthreads()
        return max(1, sum(threads.values()))

    @property
    def has_room(self) -> bool:
        """Whether fewer blocks are handed over than the workers can take at once, and some more."""
        return len(self._busy) < _BLOCKS_AHEAD * self.size

    def start(self, block: Block) -> None:
        """Hands a block to the scheduler."""
        key = f"ntagen-{block.name}-{block.row.digest[:12]}-{next(self._numbers)}"
        future = self._client.submit(making.make_block, block, key=key, pure=False)
        self._busy[future] = block

    def wait(self) -> list[Done]:
        """Waits until a block is over; one whose workers died again and again has no runs."""
        if not self._busy:
            return []
        with _as_messages(), self._client.as_current():
            ready = self._dask.wait(list(self._busy), return_when="FIRST_COMPLETED").done
        done = []
        for future in ready:
            block = self._busy.pop(future)
            try:
                with _as_messages():
                    done.append(Done(block, future.result()))
            except self._dask.KilledWorker:
                done.append(Done(block, None))
        return done

    def close(self) -> None:
        """Takes back all blocks that no worker has begun; the others are made, and do no harm."""
        with contextlib.suppress(Exception):
            self._client.cancel(list(self._busy), force=True)
        with contextlib.suppress(Exception):
            self._client.close(timeout=_CONNECT_S)
        self._busy = {}

    def _require_same_version(self) -> None:
        """Refuses workers that would make other runs; each block checks it again."""
        try:
            found: dict[str, str] = self._client.run(identity)
        except Exception as error:  # whatever an old ntagen, or none, raises there
            raise InputError(
                f"a worker cannot run ntagen {identity()}: {' '.join(str(error).split())}\n"
                "hint: install the same version on all machines, and start the workers again"
            ) from error
        for place, version in found.items():
            if version != identity():
                raise InputError(
                    f"the worker at {place} has another version of ntagen: {version}, and this is "
                    f"{identity()}\nhint: install the same version on all machines, and start the "
                    "workers again"
                )


@contextlib.contextmanager
def _as_messages() -> Any:  # noqa: ANN401  a generator
    """Turns the end of a scheduler or of a worker's Python into a message."""
    dask = _distributed()
    try:
        yield
    except (NtagenError, dask.KilledWorker):
        raise
    except Exception as error:
        said = " ".join(f"{type(error).__name__}: {error}".split())
        raise NtagenError(
            f"the Dask cluster failed: {said}\n"
            "hint: finished runs are kept; start the cluster again, and go on with --resume"
        ) from error


def _distributed() -> Any:  # noqa: ANN401  an optional package
    try:
        return importlib.import_module("distributed")
    except ImportError as error:
        raise InputError(
            "--dask needs the packages dask and distributed, which are not installed\n"
            "hint: pip install 'ntagen[cluster]'"
        ) from error
