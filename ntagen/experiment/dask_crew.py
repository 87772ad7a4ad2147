"""Workers of a Dask cluster: other machines, which share the folder of the experiment.

A worker writes each run into the folder before it tells of it, so nothing is lost with a worker,
the scheduler or this process. Dask gives the block of a lost worker to another one, which makes the
runs that are missing. The workers need the same version of ntagen, and see scenes and folder under
the same paths.
"""

from __future__ import annotations

import contextlib
import itertools
from typing import Any, Final

from ntagen.cluster.workers import Workers, as_messages, distributed
from ntagen.experiment import making
from ntagen.experiment.crew import Done
from ntagen.experiment.making import Block

_BLOCKS_AHEAD: Final = 2
"""So many blocks for each worker are handed over, so that none waits for this process."""

_ADVICE: Final = "finished runs are kept; start the cluster again, and go on with --resume"


class DaskCrew:
    """The workers of a scheduler.

    Args:
        address: The address of the scheduler, as ``tcp://host:8786``.

    Raises:
        InputError: Dask is not installed, the scheduler cannot be reached, or a worker has another
            version of ntagen.
    """

    def __init__(self, address: str) -> None:
        self._dask: Any = distributed()
        self._workers = Workers(address)
        self._client = self._workers.client
        self._busy: dict[Any, Block] = {}
        self._numbers = itertools.count()

    @property
    def size(self) -> int:
        """The number of workers that are there now; 1 if they are still to come."""
        return self._workers.size

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
        with as_messages(_ADVICE), self._client.as_current():
            ready = self._dask.wait(list(self._busy), return_when="FIRST_COMPLETED").done
        done = []
        for future in ready:
            block = self._busy.pop(future)
            try:
                with as_messages(_ADVICE):
                    done.append(Done(block, future.result()))
            except self._dask.KilledWorker:
                done.append(Done(block, None))
        return done

    def close(self) -> None:
        """Takes back all blocks that no worker has begun; the others are made, and do no harm."""
        with contextlib.suppress(Exception):
            self._client.cancel(list(self._busy), force=True)
        self._workers.close()
        self._busy = {}
