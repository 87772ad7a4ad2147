"""Workers of a Dask cluster: other machines, which share the folder of the experiment.

A worker writes each run into the folder before it tells of it, so nothing is lost with a worker,
the scheduler or this process. Dask gives the block of a lost worker to another one, which makes the
runs that are missing. The workers need the same version of ntagen, and see scenes and folder under
the same paths.
"""

from __future__ import annotations

import contextlib
import itertools
import uuid
from typing import Any, Final, Generic

from ntagen.cluster.workers import Workers, as_messages, distributed
from ntagen.experiment.crew import Done, J, made_by

_JOBS_AHEAD: Final = 2
"""So many jobs for each worker are handed over, so that none waits for this process."""

_ADVICE: Final = "finished runs are kept; start the cluster again, and go on with --resume"


class DaskCrew(Generic[J]):
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
        self._busy: dict[Any, J] = {}
        self._numbers = itertools.count()
        # Two campaigns at one scheduler must not share results.
        self._own = uuid.uuid4().hex[:12]

    @property
    def size(self) -> int:
        """The number of workers that are there now; 1 if they are still to come."""
        return self._workers.size

    @property
    def has_room(self) -> bool:
        """Whether fewer jobs are handed over than the workers can take at once, and some more."""
        return len(self._busy) < _JOBS_AHEAD * self.size

    def start(self, job: J) -> None:
        """Hands a job to the scheduler."""
        key = f"ntagen-{job.name}-{self._own}-{next(self._numbers)}"
        future = self._client.submit(made_by, job, key=key, pure=False)
        self._busy[future] = job

    def wait(self) -> list[Done[J]]:
        """Waits until a job is over; one whose workers died again and again has no results."""
        if not self._busy:
            return []
        with as_messages(_ADVICE), self._client.as_current():
            ready = self._dask.wait(list(self._busy), return_when="FIRST_COMPLETED").done
        done = []
        for future in ready:
            job = self._busy.pop(future)
            try:
                with as_messages(_ADVICE):
                    done.append(Done(job, future.result()))
            except self._dask.KilledWorker:
                done.append(Done(job, None))
        return done

    def close(self) -> None:
        """Takes back all jobs that no worker has begun; the others are made, and do no harm."""
        with contextlib.suppress(Exception):
            self._client.cancel(list(self._busy), force=True)
        self._workers.close()
        self._busy = {}
