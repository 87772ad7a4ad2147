"""The conversation with a controller: one line at a time, and real-time bytes at any time.

Rules that are kept here and nowhere else:

* Whoever talks to the controller holds the link, so one thread owns the port. A line is sent when
  the line before it was acknowledged; so no motion is sent while another one is unanswered.
* Real-time bytes (`!`, `?`, 0x85, 0x18) pass by all that: they are written at once, by any thread,
  without a lock.
* After anything that is not as it should be, the link moves nothing any more: a broken connection,
  silence, noise, an alarm, or a reset that nobody asked for. It never unlocks an alarm by itself.
* All status reports of a controller have the same form. One that has another position, or positions
  of fewer axes, has lost a part of itself on the wire: it is noise.
* grblHAL goes on refusing G-code after an error until it gets an empty line; so every refused line
  is followed by one.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from typing import Final

from ntagen.errors import DeviceError
from ntagen.grbl.names import CRITICAL_ALARMS
from ntagen.grbl.port import Port
from ntagen.grbl.protocol import (
    MAX_LINE_BYTES,
    MAX_REPLY_BYTES,
    RESET,
    STATUS,
    Alarm,
    Banner,
    Ok,
    ProtocolError,
    Refusal,
    Reply,
    Status,
    nonsense,
    parse,
)

ANSWER_S: Final = 3.0
"""A controller that has not answered a line after this time is taken for dead."""

STATUS_S: Final = 0.5
"""The same for a status report: three in a row may be missing."""

MISSING_REPORTS: Final = 3

_SLICE_S: Final = 0.005
"""How long a read waits at most before `watch` is asked again."""

_START_S: Final = 3.0
"""An Arduino resets when its port is opened, and its boot loader waits up to two seconds."""

_MARKS: Final = ("!", "~", "?")

Watch = Callable[[], None]


class RefusedError(DeviceError):
    """The controller refused a line; the link still works. `code` is the number of the error."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code


class Link:
    """A conversation with a controller.

    Args:
        port: The wire.
    """

    def __init__(self, port: Port) -> None:
        self._port = port
        self._buffer = bytearray()
        self._replies: list[Reply] = []
        self._failure: str | None = None
        self._turn = threading.RLock()
        self._expects_banner = False
        self._awaits_reset = False
        self._noise: ProtocolError | None = None
        self._form: tuple[bool, int, bool] | None = None

    @property
    def name(self) -> str:
        """The port's name."""
        return self._port.name

    @property
    def failure(self) -> str | None:
        """Why nothing is moved any more; `None` while all is well."""
        return self._failure

    @property
    def awaits_reset(self) -> bool:
        """Whether the last alarm is one after which the controller obeys nothing but a reset."""
        return self._awaits_reset

    @property
    def turn(self) -> threading.RLock:
        """Held by the thread that talks to the controller."""
        return self._turn

    def now_s(self) -> float:
        """The time on the port's clock."""
        return self._port.now_s()

    def close(self) -> None:
        """Gives the port back."""
        self._port.close()

    def realtime(self, data: bytes) -> None:
        """Writes real-time bytes now: without a lock, from any thread, whatever happened before.

        Raises:
            DeviceError: The port is gone.
        """
        self._port.write(data)

    def command(
        self, line: str, timeout_s: float = ANSWER_S, watch: Watch | None = None
    ) -> list[Reply]:
        """Sends a line and waits until it is acknowledged.

        Args:
            line: The line, without its end.
            timeout_s: How long to wait.
            watch: Is called again and again while this waits; it may raise to end it.

        Returns:
            What the controller said before it acknowledged the line.

        Raises:
            RefusedError: The controller refused the line; it works on.
            DeviceError: The controller does not work, and moves nothing any more.
        """
        data = line.encode("ascii") + b"\n"
        if len(data) > MAX_LINE_BYTES or any(mark in line for mark in _MARKS):
            raise ValueError(f"no line for a controller: {line!r}")
        with self._turn:
            self.require_whole()
            self._drain()
            self._write(data)
            said = self._until((Ok, Refusal), timeout_s, f"'{line}'", watch)
            answer = said.pop()
            if isinstance(answer, Refusal):
                self._unlatch()
                message = (
                    f"{self.name}: the controller refused '{line}': {answer}\n"
                    "hint: `ntagen device check` shows its settings and limits"
                )
                raise RefusedError(message, answer.code)
            return said

    def status(self, watch: Watch | None = None) -> Status:
        """Asks for a status report.

        Raises:
            DeviceError: The controller does not answer, or says that something is wrong.
        """
        with self._turn:
            self.require_whole()
            return self._ask(watch)

    def pause(self, seconds: float, watch: Watch = lambda: None) -> None:
        """Lets time pass, and looks at what the controller says meanwhile.

        Raises:
            DeviceError: It says that something is wrong; after a failure that is not looked at.
        """
        with self._turn:
            end_s = self.now_s() + seconds
            while (left_s := end_s - self.now_s()) > 0.0:
                watch()
                self._next(min(left_s, _SLICE_S), forgiving=self._failure is not None)

    def look(self) -> Status:
        """Asks for a status report, also after a failure: to see whether the axes stand.

        Raises:
            DeviceError: The controller does not answer.
        """
        with self._turn:
            failure, self._failure = self._failure, None
            try:
                return self._ask(None, forgiving=True)
            finally:
                self._failure = failure or self._failure

    def reset(self, timeout_s: float = _START_S) -> Banner:
        """Resets the controller and waits until it has started again.

        Raises:
            DeviceError: It does not start, or is locked by an alarm.
        """
        with self._turn:
            self.require_whole()
            self._drain()
            self._expects_banner = True
            try:
                self._write(RESET)
                banner = self._until((Banner,), timeout_s, "a reset", None).pop()
            finally:
                self._expects_banner = False
            assert isinstance(banner, Banner)  # noqa: S101  _until returns only such
            return banner

    def start(self, timeout_s: float = _START_S) -> Status:
        """Waits until a controller that may be starting gives its first status report.

        Raises:
            DeviceError: Nothing answers, or what answers is no GRBL.
        """
        with self._turn:
            end_s = self.now_s() + timeout_s
            while self.now_s() < end_s:
                self._write(STATUS)
                status = next(self._reports_until(min(self.now_s() + 0.25, end_s)), None)
                if status is not None:
                    # The last report counts, once the controller is silent.
                    *_, status = status, *self._reports_until(self.now_s() + 0.1)
                    self._form = status.form
                    return status
        if self._buffer and self._noise is None:
            # A wrong baud rate gives bytes without an end of a line.
            self._noise = nonsense(bytes(self._buffer))
        if self._noise is not None:
            raise self.fail(f"{self.name}: {self._noise}")
        raise self.fail(
            f"{self.name}: nothing answers\n"
            "hint: check power and cable, that this is the controller's port, and its baud rate; "
            "GRBL 1.1 that a limit switch has stopped answers when it is reset"
        )

    def require_whole(self) -> None:
        """Raises what is wrong, if anything is.

        Raises:
            DeviceError: The controller has failed before.
        """
        if self._failure is not None:
            raise DeviceError(self._failure)

    def fail(self, message: str) -> DeviceError:
        """Notes that nothing may be moved any more; returns the error to raise."""
        if self._failure is None:
            self._failure = message
        return DeviceError(message)

    # What comes in.

    def _reports_until(self, end_s: float) -> Iterator[Status]:
        """The status reports of a controller that may be starting.

        Noise is no fault yet: a line may have begun before the port was opened.
        """
        while (left_s := end_s - self.now_s()) > 0.0:
            replies, noise = self._pump(left_s)
            self._noise = noise or self._noise
            yield from (reply for reply in replies if isinstance(reply, Status))

    def _ask(self, watch: Watch | None, *, forgiving: bool = False) -> Status:
        # A report that was late must not be taken for the answer.
        self._next(0.0, forgiving=forgiving)
        for _ in range(MISSING_REPORTS):
            self._write(STATUS)
            end_s = self.now_s() + STATUS_S
            while (left_s := end_s - self.now_s()) > 0.0:
                if watch is not None:
                    watch()
                for reply in self._next(min(left_s, _SLICE_S), forgiving=forgiving):
                    if isinstance(reply, Status):
                        return reply
        raise self.fail(
            f"{self.name}: the controller gives no status report\n"
            "hint: stop it by its hardware switch; check cable and power"
        )

    def _until(
        self, kinds: tuple[type, ...], timeout_s: float, what: str, watch: Watch | None
    ) -> list[Reply]:
        """All replies up to the first one of some kinds."""
        said: list[Reply] = []
        end_s = self.now_s() + timeout_s
        while (left_s := end_s - self.now_s()) > 0.0:
            if watch is not None:
                watch()
            replies = self._next(min(left_s, _SLICE_S if watch else left_s))
            for index, reply in enumerate(replies):
                said.append(reply)
                if isinstance(reply, kinds):
                    self._replies = replies[index + 1 :] + self._replies
                    return said
        raise self.fail(
            f"{self.name}: the controller did not answer {what} within {timeout_s:g} s\n"
            "hint: check cable and power; measure where the needle is before you go on"
        )

    def _next(self, timeout_s: float, *, forgiving: bool = False) -> list[Reply]:
        """The next replies; alarms, resets and noise are failures."""
        kept, self._replies = self._replies, []
        replies, noise = (kept, None) if kept else self._pump(timeout_s)
        if not forgiving:
            for reply in replies:
                self._require_peace(reply)
            if noise is not None:
                raise self.fail(f"{self.name}: {noise}")
        return replies

    def _require_peace(self, reply: Reply) -> None:
        """Raises on what a controller says when something has gone wrong."""
        if isinstance(reply, Alarm):
            raise self.fail(
                f"{self.name}: {reply}\n"
                "hint: find the cause, measure where the needle is, then unlock the controller "
                "yourself with $X"
            )
        if isinstance(reply, Banner) and not self._expects_banner:
            raise self.fail(
                f"{self.name}: the controller was reset, so its position is not known any more\n"
                "hint: check power and reset button; measure where the needle is before you go on"
            )

    def _drain(self) -> None:
        """Looks at what came while nobody asked."""
        while replies := self._next(0.0):
            del replies

    def _pump(self, timeout_s: float) -> tuple[list[Reply], ProtocolError | None]:
        """Reads once; the replies that are complete now, and the first noise among them."""
        try:
            data = self._port.read(timeout_s)
        except DeviceError as error:
            raise self.fail(str(error)) from None
        self._buffer += data
        # Some firmwares end a line by a carriage return alone.
        *lines, rest = self._buffer.replace(b"\r", b"\n").split(b"\n")
        self._buffer = rest
        if len(rest) > MAX_REPLY_BYTES:
            lines.append(bytearray(rest))
            self._buffer = bytearray()
        replies: list[Reply] = []
        noise: ProtocolError | None = None
        for line in lines:
            try:
                reply = self._reply(bytes(line))
            except ProtocolError as error:
                noise = noise or error
                continue
            if reply is not None:
                replies.append(reply)
        return replies, noise

    def _reply(self, line: bytes) -> Reply | None:
        """The reply in a line.

        Raises:
            ProtocolError: It is none, or a report of another form than those before it.
        """
        reply = parse(line)
        if isinstance(reply, Status) and self._form not in (None, reply.form):
            raise nonsense(line)
        if isinstance(reply, Alarm):
            self._awaits_reset = reply.code in CRITICAL_ALARMS
        elif isinstance(reply, Banner):
            self._awaits_reset = False
        return reply

    def _write(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except DeviceError as error:
            raise self.fail(str(error)) from None

    def _unlatch(self) -> None:
        """Lets grblHAL take G-code again after a refused line."""
        self._write(b"\n")
        self._until((Ok, Refusal), ANSWER_S, "an empty line", None)
