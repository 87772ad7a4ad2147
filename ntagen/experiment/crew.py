"""Who makes the blocks: this process, processes of this machine, or a cluster."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from ntagen.experiment.making import Block, make_block
from ntagen.experiment.record import Run


@dataclass(frozen=True, slots=True)
class Done:
    """A block that is over.

    Attributes:
        block: The block.
        runs: All its runs; None if its worker died.
    """

    block: Block
    runs: list[Run] | None


class Crew(Protocol):
    """Makes blocks."""

    @property
    def size(self) -> int:
        """The number of workers."""

    @property
    def has_room(self) -> bool:
        """Whether another block should be handed over."""

    def start(self, block: Block) -> None:
        """Hands a block over."""

    def wait(self) -> list[Done]:
        """Waits until at least one of the blocks is over; none if none was handed over.

        Raises:
            InputError: A worker cannot work, or cannot write.
        """

    def close(self) -> None:
        """Ends all workers at once, also in the middle of a run."""


class Here:
    """This process: for tests, and for looking into a run with a debugger."""

    size = 1

    def __init__(self) -> None:
        self._blocks: list[Block] = []

    @property
    def has_room(self) -> bool:
        """Whether no block is waiting."""
        return not self._blocks

    def start(self, block: Block) -> None:
        """Keeps the block for `wait`."""
        self._blocks.append(block)

    def wait(self) -> list[Done]:
        """Makes the blocks."""
        blocks, self._blocks = self._blocks, []
        return [Done(block, make_block(block)) for block in blocks]

    def close(self) -> None:
        """Does nothing."""
