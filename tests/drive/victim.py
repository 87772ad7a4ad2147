"""A drive that is to be killed: says on standard output how many records are acknowledged.

Run as ``python -m tests.drive.victim RUN.mcap``.
"""

from __future__ import annotations

import sys
from pathlib import Path

from ntagen.drive.log import Log, metadata_of
from ntagen.drive.records import Journals, Record
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Scene
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import PAPER


class _Counter:
    """Comes after the log among the journals, so that what it counts is acknowledged."""

    def __init__(self) -> None:
        self._count = 0

    def record(self, record: Record) -> None:
        self._count += 1
        sys.stdout.write(f"{self._count}\n")
        sys.stdout.flush()

    def started(self, scene: Scene) -> None:
        pass

    def synthesised(self, number: int, synthesis: Synthesis) -> None:
        pass


def main() -> None:
    """Drives, and after the end waits for death with the log still open."""
    log = Log(Path(sys.argv[1]), metadata_of({"settings": Settings().to_json()}), {})
    simulate(PAPER, oracle_synthesis, Settings(), Journals(log, _Counter()))
    sys.stdin.read()


if __name__ == "__main__":
    main()
