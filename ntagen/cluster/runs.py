"""Random runs of statistical queries that the workers of a Dask cluster make.

Run k of a seed is the same wherever it is made, and results count in the order of run numbers. So
an answer is the same as that of one machine, but for its times. Runs are made in blocks, some ahead
of those that are counted; when the answer stands, what is ahead is given up. Dask gives the block
of a lost worker to another one.
"""

from __future__ import annotations

import contextlib
import itertools
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from ntagen.checker import Options, form_of, load
from ntagen.cluster.identity import identity
from ntagen.cluster.workers import Workers, as_messages, distributed, require_same_version
from ntagen.errors import InputError, NtagenError

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model, OverflowRule
    from ntagen.checker.queries import Query

_BLOCKS_AHEAD: Final = 2
"""So many blocks for each worker are handed over, so that none waits for this process."""

_SHORT_S: Final = 0.25
"""Blocks that take less than this become larger, in seconds."""

_LONG_S: Final = 2.0
"""Blocks that take more than this become smaller, in seconds."""

_MOST_GROWTH: Final = 8
"""At most so many times larger is the next block."""

_MOST_RUNS: Final = 2**20
"""The most runs of a block: each takes up to 10 bytes."""

_LOOK_S: Final = 0.1
"""How often limits and the user are looked at while a block is awaited, in seconds."""

_MODELS_KEPT: Final = 4
"""So many models are kept by each thread of a worker."""

_ADVICE: Final = "start the cluster again, or ask without it"


@dataclass(frozen=True, slots=True)
class Job:
    """A query whose runs are wanted.

    Attributes:
        version: The ntagen that must make them (`ntagen.cluster.identity`).
        text: The model.
        overflow: What happens where results of integer arithmetic do not fit.
        query: The query.
        strategy: The name and the file of the strategy under which it is asked; None without one.
        options: How it is answered; without what belongs to a process.
    """

    version: str
    text: str
    overflow: OverflowRule
    query: str
    strategy: tuple[str, bytes] | None
    options: Options


_KEPT: Final = threading.local()
"""The models that a thread of a worker has loaded: a model answers one question at a time."""


def make_block(job: Job, first: int, count: int) -> tuple[bytes, float]:
    """Makes runs: what a worker does.

    Args:
        job: The query.
        first: The number of the first run.
        count: How many runs; for a comparison of probabilities, how many pairs.

    Returns:
        Their results as the engine reads them, and the seconds that they took.

    Raises:
        InputError: This is another version of ntagen.
    """
    require_same_version(job.version)
    model = _loaded(job)
    start = time.perf_counter()
    options = replace(job.options, progress=_giving_up())
    try:
        block = model.block_of_runs(job.query, first, count, options)
    except KeyboardInterrupt:
        raise NtagenError(f"runs {first} to {first + count - 1} are not wanted any more") from None
    return block, time.perf_counter() - start


def _loaded(job: Job) -> Model:
    """The model of a job, with its strategy."""
    models: dict[object, Model] = _KEPT.__dict__.setdefault("models", {})
    key = (job.text, job.overflow, job.strategy)
    if key not in models:
        while len(models) >= _MODELS_KEPT:
            del models[next(iter(models))]
        model = load(job.text)
        model.overflow = job.overflow
        if job.strategy is not None:
            name, data = job.strategy
            model.read_strategy(data).keep(name)
        models[key] = model
    return models[key]


def _giving_up() -> Callable[[int, int, int, int], None]:
    """What ends the runs of this task when the scheduler says that nobody wants them any more."""
    try:
        worker = distributed().get_worker()
        key = worker.get_current_task()
    except ValueError:  # this is no task of a worker
        return lambda *_: None

    def look(*_: int) -> None:
        task = worker.state.tasks.get(key)
        if task is None or task.state == "cancelled":
            raise NtagenError(f"{key} is not wanted any more")

    return look


class DaskRuns:
    """Answers statistical queries with runs that the workers of a Dask cluster make.

    The answer is the same as without a cluster, but for its times::

        with DaskRuns("tcp://head:8786") as cluster:
            answer = cluster.check(model, "Pr[<=100](<> Gate.Open)", epsilon=0.001)

    Args:
        address: The address of the scheduler, as ``tcp://host:8786``.

    Raises:
        InputError: Dask is not installed, the scheduler cannot be reached, or a worker has another
            version of ntagen.
    """

    def __init__(self, address: str) -> None:
        self._workers = Workers(address)
        self._numbers = itertools.count()

    def __enter__(self) -> DaskRuns:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leaves the cluster."""
        self._workers.close()

    @property
    def has_workers(self) -> bool:
        """Whether the cluster has workers now; without any, answers wait for them."""
        return bool(self._workers.client.nthreads())

    def check(self, model: Model, query: str | Query, /, **keywords: Any) -> Answer:  # noqa: ANN401
        """Answers a query; the keywords are the fields of `ntagen.checker.Options`.

        Raises:
            InputError: The runs of this query cannot be made elsewhere.
            NtagenError: The cluster failed.
        """
        return self.answer(model, str(query), Options(**keywords))

    def answer(self, model: Model, query: str, options: Options) -> Answer:
        """Answers a query as `check` does, with all options as one value."""
        reason = why_here(query, options) or why_here_under(model, query)
        if reason is not None:
            raise InputError(f"{query.strip()}: {reason}\nhint: ask without a cluster")
        with self.runs_of(model, query, options) as source:
            return model.answer(query, replace(options, run_source=source))

    @contextlib.contextmanager
    def runs_of(
        self, model: Model, query: str, options: Options
    ) -> Iterator[Callable[[int, int | None], bytes]]:
        """Gives the `ntagen.checker.Options.run_source` for a query."""
        own = replace(options, progress=None, run_progress=None, run_source=None, timeout_s=None)
        # Paths and limits of this process count for nothing there.
        own = replace(own, folder=None, allow_write=(), memory_bytes=None, states=None)
        own = replace(own, spill=None, threads=1)
        followed = None
        form = form_of(query)
        if form is not None and form.uses is not None:
            strategy = model.strategy_under(query, options)
            followed = None if strategy is None else (form.uses, strategy.json().encode())
        job = Job(identity(), model.text, model.overflow, query, followed, own)
        blocks = _Blocks(self._workers, job, next(self._numbers))
        try:
            yield blocks
        finally:
            blocks.give_up()


def why_here(query: str, options: Options) -> str | None:
    """Why the runs of a query cannot be made elsewhere; None if they can."""
    form = form_of(query)
    if form is None or form.kind not in ("Pr", "E"):
        return "only the runs of Pr and E are made by a cluster"
    if options.levels is not None:
        return "importance splitting is not done by a cluster"
    return None


def why_here_under(model: Model, query: str) -> str | None:
    """Why the runs under the strategy of a query cannot be made elsewhere; None if they can."""
    form = form_of(query)
    if form is None or form.uses is None or model.has_strategy_of_game(form.uses) is not False:
        return None
    return f"{form.uses} is no strategy of a game, and only these are sent to a cluster"


@dataclass(frozen=True, slots=True)
class _Ahead:
    """A block that was handed over."""

    first: int
    count: int
    future: Any


class _Blocks:
    """Blocks of the runs of a query, in the order of their numbers."""

    def __init__(self, workers: Workers, job: Job, number: int) -> None:
        self._workers = workers
        self._dask = distributed()
        self._name = f"ntagen-runs-{identity()[-12:]}-{id(self)}-{number}"
        self._numbers = itertools.count()
        self._ahead: deque[_Ahead] = deque()
        self._next = 0
        self._count = 1
        # The model goes to each worker once. A task can be done again where its worker is lost.
        key = f"{self._name}-job"
        with as_messages(_ADVICE):
            self._job = workers.client.submit(_same, job, key=key, pure=False)

    def __call__(self, first: int, most: int | None) -> bytes:
        """The results of runs from `first` on; empty if they are not there yet."""
        with as_messages(_ADVICE):
            if not self._ahead or self._ahead[0].first != first:
                self._begin(first)
            self._hand_over(most)
            head = self._ahead[0]
            try:
                with self._workers.client.as_current():
                    self._dask.wait([head.future], timeout=_LOOK_S)
            except TimeoutError:
                return b""
            try:
                block, seconds = head.future.result()
            except self._dask.KilledWorker as error:
                raise NtagenError(
                    f"workers of the Dask cluster died when they made runs {head.first} to "
                    f"{head.first + head.count - 1}: {' '.join(str(error).split())}\n"
                    "hint: see the logs of the workers; they may need more memory"
                ) from error
            self._ahead.popleft()
            self._adapt(head.count, seconds)
            return bytes(block)

    def give_up(self) -> None:
        """Takes back all blocks; workers end those that they have begun."""
        with contextlib.suppress(Exception):
            self._workers.client.cancel([one.future for one in self._ahead], force=True)
        self._ahead.clear()
        self._job = None

    def _begin(self, first: int) -> None:
        """Begins with this run, and forgets blocks that begin elsewhere."""
        if self._ahead:
            self._workers.client.cancel([one.future for one in self._ahead], force=True)
            self._ahead.clear()
        self._next = first

    def _hand_over(self, most: int | None) -> None:
        """Hands blocks over until all workers have enough, or no more runs are needed."""
        size = self._workers.size
        while len(self._ahead) < _BLOCKS_AHEAD * size:
            count = self._count
            if most is not None:
                # What is left is shared by all.
                count = min(count, -(-(most - self._next) // size))
            if count <= 0:
                return
            key = f"{self._name}-{next(self._numbers)}"
            future = self._workers.client.submit(
                make_block, self._job, self._next, count, key=key, pure=False
            )
            self._ahead.append(_Ahead(self._next, count, future))
            self._next += count

    def _adapt(self, count: int, seconds: float) -> None:
        """Chooses the size of the next blocks by the time that one took."""
        if seconds < _SHORT_S:
            factor = min(_MOST_GROWTH, int(_SHORT_S / max(seconds, 1e-9)))
            self._count = max(self._count, min(max(2, factor) * count, _MOST_RUNS))
        elif seconds > _LONG_S:
            self._count = max(1, min(self._count, count // 2))


def _same(job: Job) -> Job:
    return job
