"""The workers of `ntagen serve`: each job is a process of its own, which can be cancelled.

A worker is `ntagen check`, `ntagen info` or `ntagen plot` in a folder of its own, so the page says
what the command line says. It has the limits of the server, which hold in all that it does; a
worker that does not end by itself is killed. Where the system can, a worker may not take much more
address space, nor write large files.
"""

from __future__ import annotations

import contextlib
import json
import secrets
import shutil
import subprocess
import tempfile
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from ntagen.serve.loopback import Refusal
from ntagen.serve.processes import Limits, ended, started

MODELS: Final = (".xml", ".xta", ".ta")
ENDINGS: Final = (*MODELS, ".nsl", ".mcap")

PICTURES: Final = {
    "gantt": "svg",
    "sequence": "svg",
    "zones": "svg",
    "templates": "svg",
    "states": "svg",
    "discrete": "svg",
    "scene": "html",
}
"""The pictures, each with the kind of its file."""

_LATE_S: Final = 3.0
_LATE: Final = 0.1
"""A worker ends by itself when its time is over. One that has not even then is killed this much
later, in seconds or in parts of its time, whichever is more."""

_TEXT_BYTES: Final = 4 << 20
"""So much of what a worker says is passed on."""

_JOBS_KEPT: Final = 50
_NAME_CHARACTERS: Final = 80


class File:
    """A file that was dropped.

    Attributes:
        name: Its name.
        path: Where it is.
        kind: ``model``, ``environment`` or ``run``.
        origin: The user's own file of which this is a copy; ``None`` if it was dropped.
    """

    def __init__(self, name: str, path: Path, origin: Path | None = None) -> None:
        self.name = name
        self.path = path
        self.origin = origin
        ending = path.suffix.lower()
        self.kind = {".nsl": "environment", ".mcap": "run"}.get(ending, "model")


class Job:
    """A worker, running or ended."""

    def __init__(self, arguments: Sequence[str], folder: Path, limits: Limits) -> None:
        self._folder = folder
        self._started = time.monotonic()
        self._ended: float | None = None
        self._is_cancelled = False
        self._is_late = False
        with (folder / "out").open("wb") as out, (folder / "err").open("wb") as err:
            self._process = started(arguments, folder, limits, subprocess.DEVNULL, out, err)
        late_s = max(_LATE_S, _LATE * limits.timeout_s)
        self._timer = threading.Timer(limits.timeout_s + late_s, self._kill_late)
        self._timer.daemon = True
        self._timer.start()

    @property
    def is_running(self) -> bool:
        """Whether the worker has not ended."""
        if self._process.poll() is None:
            return True
        if self._ended is None:
            self._ended = time.monotonic()
            self._timer.cancel()
        return False

    def cancel(self) -> None:
        """Ends the worker, if it runs."""
        if self.is_running:
            self._is_cancelled = True
            ended(self._process)

    def report(self) -> dict[str, Any]:
        """How far it is, and what it found."""
        state = "running" if self.is_running else "cancelled" if self._is_cancelled else "done"
        end = time.monotonic() if self._ended is None else self._ended
        found: dict[str, Any] = {"state": state, "seconds": round(end - self._started, 2)}
        if state != "done":
            return found
        code = self._process.returncode
        message = self._said("err")
        if self._is_late:
            message = "the worker did not end within its time, and was killed"
        elif code < 0:
            message = f"{message}the worker was ended by signal {-code}; it may lack memory\n"
        found |= {"exit": code, "message": message.strip(), "answers": self._answers()}
        for name, file in (("trace", "trace"), ("strategy", "strategy"), ("steps", "trace.json")):
            if (self._folder / file).is_file():
                found[name] = self._said(file)
        found["picture"] = self.picture() is not None
        return found

    def picture(self) -> Path | None:
        """The picture that it has drawn."""
        return next((one for one in self._folder.glob("picture.*") if not self.is_running), None)

    def _answers(self) -> list[Any]:
        """The objects that it has printed, one on each line."""
        answers = []
        for line in self._said("out").splitlines():
            with contextlib.suppress(ValueError):
                answers.append(json.loads(line))
        return answers

    def _said(self, name: str) -> str:
        with (self._folder / name).open("rb") as file:
            return file.read(_TEXT_BYTES).decode("utf-8", "replace")

    def _kill_late(self) -> None:
        if self.is_running:
            self._is_late = True
            ended(self._process)


class Workshop:
    """The files and jobs of a server. `close` ends all workers and removes all files."""

    def __init__(self, limits: Limits) -> None:
        self.limits = limits
        self._folder = tempfile.TemporaryDirectory(prefix="ntagen-serve-")
        self._files: dict[str, File] = {}
        self._jobs: dict[str, Job] = {}
        self._lock = threading.Lock()

    def close(self) -> None:
        """Ends all workers, and removes all files."""
        with self._lock:
            for job in self._jobs.values():
                job.cancel()
            self._folder.cleanup()

    def add(self, name: str, data: bytes, origin: Path | None = None) -> str:
        """Keeps a file, of which `origin` may be the original; returns its id.

        Raises:
            Refusal: It is empty, or of no kind that is known.
        """
        # Only the last part of a name counts, whatever the browser's system puts between parts.
        last = name.replace("\\", "/").rpartition("/")[2].strip()[-_NAME_CHARACTERS:]
        safe = "".join(one if one.isalnum() or one in "._- ()" else "_" for one in last)
        ending = Path(safe).suffix.lower()
        if ending not in ENDINGS:
            raise Refusal(
                415,
                f"{last or 'a file without a name'} is of no kind that is known\n"
                f"hint: drop a file that ends in {', '.join(ENDINGS)}",
            )
        if not data:
            raise Refusal(400, f"{last} is empty")
        with self._lock:
            while len(self._files) >= self.limits.files:
                self._files.pop(next(iter(self._files)))
            number = secrets.token_hex(8)
            folder = self._made(f"file-{number}")
            path = folder / (safe.lstrip(".-") if Path(safe).stem.strip(".- ") else f"file{ending}")
            path.write_bytes(data)
            self._files[number] = File(path.name, path, origin)
        return number

    def file(self, number: str) -> File:
        """A file by its id.

        Raises:
            Refusal: There is none.
        """
        found = self._files.get(number)
        if found is None:
            raise Refusal(404, "this file is not kept any more\nhint: drop it again")
        return found

    def start(self, number: str, wish: dict[str, Any]) -> str:
        """Starts a job on a file; returns its id.

        Raises:
            Refusal: The wish is wrong, or too many workers run.
        """
        file = self.file(number)
        arguments = arguments_for(file, wish, self.limits)
        with self._lock:
            if sum(job.is_running for job in self._jobs.values()) >= self.limits.jobs:
                raise Refusal(
                    429,
                    f"{self.limits.jobs} checks run already\nhint: wait for one, or cancel it",
                )
            for old in list(self._jobs)[: max(0, len(self._jobs) - _JOBS_KEPT)]:
                if not self._jobs[old].is_running:
                    self._jobs.pop(old)
                    shutil.rmtree(Path(self._folder.name) / f"job-{old}", ignore_errors=True)
            identity = secrets.token_hex(8)
            folder = self._made(f"job-{identity}")
            self._jobs[identity] = Job(arguments, folder, self.limits)
        return identity

    def job(self, identity: str) -> Job:
        """A job by its id.

        Raises:
            Refusal: There is none.
        """
        found = self._jobs.get(identity)
        if found is None:
            raise Refusal(404, "there is no such job")
        return found

    def _made(self, name: str) -> Path:
        folder = Path(self._folder.name) / name
        folder.mkdir()
        return folder


def arguments_for(file: File, wish: dict[str, Any], limits: Limits) -> list[str]:
    """The command line of a worker.

    Raises:
        Refusal: The wish is wrong.
    """
    action, query = wish.get("action"), wish.get("query")
    if query is not None and (not isinstance(query, str) or not query.strip() or "\0" in query):
        raise Refusal(400, "the query is no text")
    asked = [] if query is None else [f"--query={query}"]
    limited = [f"--timeout={limits.timeout_s}s", f"--memory={limits.memory_bytes}B"]
    path = str(file.path)
    if action == "info" and file.kind != "run":
        return ["info", path, "--json", *limited]
    if action == "check" and file.kind != "run":
        evidence = []
        if query is not None:
            is_game = "control" in query and "E<> control:" not in query
            # Steps are for the simulator.
            trace = "trace.json" if wish.get("steps") else "trace"
            evidence = ["--strategy", "strategy"] if is_game else ["--trace", trace]
        return ["check", path, "--format", "json", *asked, *limited, *evidence]
    if action == "plot":
        picture = wish.get("picture")
        if isinstance(picture, str) and picture in PICTURES and _can_be(picture, file):
            output = ["-o", f"picture.{PICTURES[picture]}"]
            if picture == "scene":
                return ["plot", path, *output, *limited]
            at = wish.get("at")
            place = [f"--at={at}"] if picture == "zones" and isinstance(at, str) and at else []
            asked = [] if picture in ("templates", "states", "discrete") else asked
            return ["plot", path, "--as", picture, *asked, *place, *limited, *output]
    raise Refusal(400, f"{file.name} has no such answer or picture")


def _can_be(picture: str, file: File) -> bool:
    """Whether there is such a picture of a file."""
    if picture == "scene":
        return file.kind != "model"
    return file.kind != "run"
