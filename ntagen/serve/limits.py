"""What `ntagen serve` allows, and how it says that something is not allowed."""

from __future__ import annotations

from ntagen.values import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """What one server allows.

    Attributes:
        timeout_s: A worker ends after this time; one that does not is killed a little later.
        memory_bytes: A worker ends when it takes this much.
        upload_bytes: The greatest size of a file.
        jobs: At most so many workers at a time.
        files: At most so many files are kept; the oldest goes first.
    """

    timeout_s: float = 60.0
    memory_bytes: int = 1 << 30
    upload_bytes: int = 32 << 20
    jobs: int = 2
    files: int = 20


class Refusal(Exception):  # noqa: N818  it is an answer, not an error of the server
    """A request that is refused.

    Attributes:
        status: The status of HTTP.
        message: What is wrong, and the way out.
    """

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status
        self.message = message
