"""A Dask cluster on loopback, for tests."""

from __future__ import annotations

import contextlib
import warnings
from collections.abc import Iterator
from typing import Any

import pytest


@contextlib.contextmanager
def local_cluster() -> Iterator[Any]:
    """A cluster with two worker processes; skips the test if Dask is not installed."""
    distributed = pytest.importorskip("distributed", reason="needs ntagen[cluster]")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with distributed.LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            host="127.0.0.1",
            dashboard_address=None,
            worker_dashboard_address=None,
        ) as found:
            yield found
