"""Looks at texts in a second process, which can be stopped at any moment.

A check of an environment with large meshes can take a minute: the distances around them depend on
the needle, too, so each key that changes a number there asks for new ones. The server goes on
answering meanwhile, and a text that is out of date is not worked on any longer. A model takes some
hundredths of a second, less than another process takes to start: work that nobody waits for any
more has a moment left in which it may end.

Invariants: there is at most one process, and it works on at most one text; after a check that was
given up it is gone, and the next check starts another one.
"""

from __future__ import annotations

import asyncio
import multiprocessing
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from ntagen.checker.survey import Texts, survey_json
from ntagen.editor import language
from ntagen.nsl import Diagnostic


class CheckEndedError(Exception):
    """The process ended before it had an answer; what it said about it is on standard error."""


class Checks:
    """Asks the second process, one text after the other."""

    def __init__(self, patience_s: float = 0.0) -> None:
        """Begins with no process.

        Args:
            patience_s: So long work may go on that nobody waits for any more.
        """
        self._patience_s = patience_s
        self._one_at_a_time = asyncio.Lock()
        self._worker: tuple[BaseProcess, Connection] | None = None

    async def mistakes(self, text: str, path: str) -> tuple[Diagnostic, ...]:
        """As `language.mistakes`. If the task that waits for it is cancelled, the work stops, too.

        Raises:
            CheckEndedError: The process ended before it had an answer.
        """
        found: tuple[Diagnostic, ...] = await self._ask(language.mistakes, text, path)
        return found

    async def survey(self, texts: Texts, allow_external: tuple[str, ...]) -> str:
        """As `survey_json`, in the same way."""
        found: str = await self._ask(survey_json, texts, allow_external)
        return found

    async def _ask(self, work: Callable[..., Any], *arguments: object) -> Any:  # noqa: ANN401
        async with self._one_at_a_time:
            if self._worker is None:
                self._worker = _started()
            _, pipe = self._worker
            is_done = False
            try:
                pipe.send((work, arguments))
                answer = asyncio.ensure_future(asyncio.to_thread(pipe.recv))
                try:
                    found = await asyncio.shield(answer)
                except asyncio.CancelledError:
                    done, _ = await asyncio.wait({answer}, timeout=self._patience_s)
                    is_done = bool(done) and answer.exception() is None
                    raise
                is_done = True
            except (EOFError, OSError) as error:
                raise CheckEndedError from error
            finally:
                if not is_done:
                    self.stop()
        return found

    def stop(self) -> None:
        """Ends the process; whoever still reads from it meets the end of the pipe."""
        if self._worker is not None:
            process, _ = self._worker
            process.kill()
            process.join()
            self._worker = None


def _started() -> tuple[BaseProcess, Connection]:
    """A process that answers, and the pipe to it."""
    context = multiprocessing.get_context("spawn")
    ours, its = context.Pipe()
    # A daemon does not outlive the server.
    process = context.Process(target=_answer, args=(its,), daemon=True)
    process.start()
    # Else the end of the process would not be the end of the pipe.
    its.close()
    return process, ours


def _answer(pipe: Connection) -> None:
    """Answers until the server is gone."""
    while True:
        try:
            work, arguments = pipe.recv()
        except (EOFError, KeyboardInterrupt):
            return
        pipe.send(work(*arguments))
