"""The wire to a controller: a serial port, or a network socket that stands for one.

A port has one reader at a time. Writing a real-time byte needs no lock and no other thread: it goes
to the operating system at once, also while another thread waits for an answer.
"""

from __future__ import annotations

import errno
import io
import select
import time
from typing import Final, Protocol

import serial

from ntagen.errors import DeviceError
from ntagen.grbl.protocol import BAUD_RATE

_WRITE_TIMEOUT_S: Final = 0.5
"""A line has at most 80 bytes: so much is always sent in this time, or the wire is blocked."""

_LOOK_S: Final = 0.001
"""How long to sleep before looking again at a port that cannot be waited for."""


class Port(Protocol):
    """Bytes to and from a controller, and the clock on which its motions take time."""

    @property
    def name(self) -> str:
        """What users call it."""

    def now_s(self) -> float:
        """The time, which never goes back."""

    def read(self, timeout_s: float) -> bytes:
        """What has come; waits for it if nothing has, and returns nothing after the time.

        Raises:
            DeviceError: The port is gone.
        """

    def write(self, data: bytes) -> None:
        """Sends bytes; also from a thread that does not read.

        Raises:
            DeviceError: The port is gone, or takes no bytes.
        """

    def close(self) -> None:
        """Gives the port back."""


class SerialPort:
    """A serial port, for this process alone.

    Args:
        name: The device, for example ``/dev/ttyACM0``, or an address that pyserial understands,
            for example ``socket://host:23``. ``,baud=9600`` behind it says how fast it is, if not
            as fast as `BAUD_RATE`.

    Raises:
        DeviceError: It cannot be opened.
    """

    def __init__(self, name: str) -> None:
        self._name, _, baud_rate = name.partition(",baud=")
        self._opened_s = time.monotonic()
        try:
            self._serial = serial.serial_for_url(
                self._name,
                baudrate=int(baud_rate or BAUD_RATE),
                timeout=0,
                write_timeout=_WRITE_TIMEOUT_S,
                exclusive=True,
            )
        except (serial.SerialException, OSError, ValueError) as error:
            raise _cannot_open(name, error) from None

    @property
    def name(self) -> str:
        """What users call it."""
        return self._name

    def now_s(self) -> float:
        """Seconds since the port was opened, on the monotonic clock of the computer."""
        return time.monotonic() - self._opened_s

    def read(self, timeout_s: float) -> bytes:
        """See `Port.read`."""
        try:
            is_ready = self._wait(max(0.0, timeout_s))
            return bytes(self._serial.read(max(1, self._serial.in_waiting))) if is_ready else b""
        # A port that is closed or pulled out gives any of these.
        except (serial.SerialException, OSError, TypeError, ValueError) as error:
            raise self._gone(error) from None

    def _wait(self, timeout_s: float) -> bool:
        """Waits until something has come; returns whether it has."""
        try:
            number = self._serial.fileno()
        except io.UnsupportedOperation:
            # A serial port of Windows is no file, so it is looked at again and again.
            end_s = time.monotonic() + timeout_s
            while not self._serial.in_waiting and time.monotonic() < end_s:
                time.sleep(_LOOK_S)
            return bool(self._serial.in_waiting)
        ready, _, _ = select.select([number], [], [], timeout_s)
        return bool(ready)

    def write(self, data: bytes) -> None:
        """See `Port.write`."""
        try:
            self._serial.write(data)
        except (serial.SerialException, OSError, TypeError, ValueError) as error:
            raise self._gone(error) from None

    def close(self) -> None:
        """Gives the port back."""
        self._serial.close()

    def _gone(self, error: Exception) -> DeviceError:
        return DeviceError(
            f"{self._name}: the connection to the controller is broken ({_reason(error)})\n"
            "hint: check cable and power; measure where the needle is before you go on"
        )


def _cannot_open(name: str, error: Exception) -> DeviceError:
    """Why a port cannot be opened, and what to do."""
    number = getattr(error, "errno", None)
    said = str(error)
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        cause, hint = "there is no such port", "is the cable plugged in? `ls /dev/tty*` lists ports"
    elif number in (errno.EACCES, errno.EPERM):
        cause = "you may not use this port"
        hint = "add yourself to the group that owns it, often `dialout`, and log in again"
    elif number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in said:
        cause, hint = "another program uses this port", "close it; one program drives a device"
    elif number == errno.ENOTTY or number == errno.EINVAL or "configure port" in said:
        cause, hint = "this is no serial port", "give the device of the controller"
    else:
        cause, hint = _reason(error), "give a device or `socket://HOST:PORT`"
    return DeviceError(f"{name}: cannot open the port: {cause}\nhint: {hint}")


def _reason(error: Exception) -> str:
    """The reason in the words of the operating system, if it gave one."""
    if isinstance(error, io.UnsupportedOperation):
        return "it cannot be waited for"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    return " ".join(str(error).split()) or type(error).__name__
