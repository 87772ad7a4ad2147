"""The workers of a Dask scheduler, all of which have the same ntagen as this process."""

from __future__ import annotations

import contextlib
import importlib
import re
from collections.abc import Iterator
from typing import Any, Final

from ntagen.cluster.identity import identity
from ntagen.errors import InputError, NtagenError

CONNECT_S: Final = 10.0
"""How long a scheduler may take to answer, in seconds."""

_SAME: Final = "hint: install the same version on all machines, and start the workers again"

_ADDRESS: Final = re.compile(r"([a-z]+://)?[^\s/]+:[0-9]{1,5}")


class Workers:
    """The workers of a scheduler.

    Args:
        address: The address of the scheduler, as ``tcp://host:8786``.

    Attributes:
        client: The client of `distributed`.

    Raises:
        InputError: Dask is not installed, the scheduler cannot be reached, or a worker has another
            version of ntagen.
    """

    def __init__(self, address: str) -> None:
        library = distributed()
        if not _ADDRESS.fullmatch(address):
            raise InputError(
                f"'{address}' is no address of a Dask scheduler\n"
                "hint: write it as tcp://host:8786, as `dask scheduler` prints it"
            )
        try:
            self.client: Any = library.Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, ImportError) as error:
            said = " ".join(str(error).split())
            raise InputError(
                f"there is no Dask scheduler at {address}: {said}\n"
                "hint: start one with `dask scheduler`, and workers with `dask worker ADDRESS "
                "--nthreads 1`"
            ) from error
        try:
            self._require_same_version()
        except BaseException:
            self.close()
            raise

    @property
    def size(self) -> int:
        """How many tasks the workers do at once now; 1 if they are still to come."""
        threads: dict[str, int] = self.client.nthreads()
        return max(1, sum(threads.values()))

    def close(self) -> None:
        """Leaves the scheduler, which then gives up what is still to be done."""
        with contextlib.suppress(Exception):
            self.client.close(timeout=CONNECT_S)

    def _require_same_version(self) -> None:
        """Refuses workers that would make other runs; each task checks it again."""
        try:
            found: dict[str, str] = self.client.run(identity)
        except Exception as error:  # whatever an old ntagen, or none, raises there
            raise InputError(
                f"a worker cannot run ntagen {identity()}: {' '.join(str(error).split())}\n{_SAME}"
            ) from error
        for place, version in found.items():
            if version != identity():
                raise InputError(
                    f"the worker at {place} has another version of ntagen: {version}, and this is "
                    f"{identity()}\n{_SAME}"
                )


def require_same_version(version: str, then: str = "") -> None:
    """Refuses a job for another ntagen: a worker may come, or be updated, in the middle.

    Args:
        version: The ntagen that the job is for.
        then: What to do when the workers have been started again, in words.

    Raises:
        InputError: This is another version.
    """
    if version != identity():
        raise InputError(
            f"a worker has another version of ntagen: {identity()}, and this is {version}\n"
            f"{_SAME}{then}"
        )


@contextlib.contextmanager
def as_messages(advice: str) -> Iterator[None]:
    """Turns the end of a scheduler or of a worker's Python into a message.

    Args:
        advice: What to do then.
    """
    killed = distributed().KilledWorker
    try:
        yield
    except (NtagenError, killed):
        raise
    except Exception as error:
        said = " ".join(f"{type(error).__name__}: {error}".split())
        raise NtagenError(f"the Dask cluster failed: {said}\nhint: {advice}") from error


def distributed() -> Any:  # noqa: ANN401  an optional package
    """The package `distributed`.

    Raises:
        InputError: It is not installed.
    """
    try:
        return importlib.import_module("distributed")
    except ImportError as error:
        raise InputError(
            "a cluster needs the packages dask and distributed, which are not installed\n"
            "hint: pip install 'ntagen[cluster]'"
        ) from error
