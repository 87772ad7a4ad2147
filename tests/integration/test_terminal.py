"""A search on a terminal: the line that tells how far it is, and Ctrl-C in the middle of it.

The command runs in a process of its own on a pseudo terminal, which turns the character of Ctrl-C
into the signal as a real one does.
"""

from __future__ import annotations

import os
import re
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pty = pytest.importorskip("pty", reason="pseudo terminals are those of Unix")

PATIENCE_S = 60
"""How long to wait for what comes in a second or two if the machine has time."""

ENDLESS = """
int[0,30000] a, b;
process P() { state S; init S; trans S -> S { guard a < 30000; assign a = a + 1; }; }
process Q() { state S; init S; trans S -> S { guard b < 30000; assign b = b + 1; }; }
system P, Q;
"""
"""A model of 900 million states."""

GAME = """
int[0,30000] a, b; bool c;
process P() {
  state S; init S;
  trans S -u-> S { guard a < 30000; assign a = a + 1; },
        S -u-> S { guard b < 30000; assign b = b + 1; },
        S -> S { assign c = true; };
}
system P;
"""
"""A game that is won only after a look at as many."""

BUSY = """
int[0,1000003] n;
void spin() {
  int[0,99000000] i = 0;
  while (i < 99000000) { n = (n * 31 + i % 5) % 1000003; i++; }
}
process P() { state S; init S; trans S -> S { assign spin(); }; }
system P;
"""
"""Every transition runs a function for a second, interpreted for many."""

CROWD = """
broadcast chan go;
int[0,3] n;
process S() { state S; init S; trans S -> S { sync go!; assign n = (n + 1) % 4; }; }
process R(const int[1,19] me) {
  state A; init A;
  trans A -> A { sync go?; assign n = me % 4; }, A -> A { sync go?; assign n = (n * 3) % 4; };
}
system S, R;
"""
"""Every state has 2^19 broadcasts of 20 processes."""


def _command(model: Path, *options: str) -> list[str]:
    code = "import sys; from ntagen.cli import main; sys.exit(main())"
    return [sys.executable, "-c", code, "check", str(model), *options]


class Terminal:
    """A command on a pseudo terminal."""

    def __init__(self, command: list[str]) -> None:
        self.pid, self.end = pty.fork()
        if self.pid == 0:
            os.execv(command[0], command)
        self.text = ""

    def read_until(self, wanted: str) -> None:
        """Reads what is shown until it has this."""
        end = time.monotonic() + PATIENCE_S
        while wanted not in self.text:
            assert time.monotonic() < end, self.text
            if not self._read():
                break
        assert wanted in self.text, self.text

    def _read(self) -> bool:
        if not select.select([self.end], [], [], 1.0)[0]:
            return True
        try:
            some = os.read(self.end, 4096)
        except OSError:  # the other side is closed
            return False
        self.text += some.decode(errors="replace")
        return bool(some)

    def type(self, text: str) -> None:
        """Types something."""
        os.write(self.end, text.encode())

    def exit_code(self) -> int:
        """Waits for the end; returns the exit code."""
        end = time.monotonic() + PATIENCE_S
        while self._read():
            if time.monotonic() > end:
                os.kill(self.pid, signal.SIGKILL)
        os.close(self.end)
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])


@pytest.mark.parametrize(
    ("text", "query", "options"),
    [
        (ENDLESS, "A[] a + b < 60000", ()),
        (GAME, "control: A[] !(a == 30000 && b == 30000 && c)", ()),
        (BUSY, "A[] n >= 0", ()),
        (BUSY, "A[] n >= 0", ("--engine", "interpreter")),
        (BUSY, "control: A[] n >= 0", ()),
    ],
    ids=["search", "synthesis", "one call", "one interpreted call", "one call in a game"],
)
def test_ctrl_c_ends_what_is_shown_on_a_terminal(
    tmp_path: Path, text: str, query: str, options: tuple[str, ...]
) -> None:
    model = tmp_path / "model.xta"
    model.write_text(text)
    terminal = Terminal(_command(model, "--query", query, "--memory", "4GiB", *options))
    terminal.read_until("states explored")
    terminal.type("\x03")
    assert terminal.exit_code() == 130
    assert re.search(r"[\d,]+ states explored \([\d,]+/s\), [\d,]+ stored", terminal.text)
    assert "interrupted" in terminal.text


@pytest.mark.slow
def test_signal_in_one_call_ends_with_the_counters_so_far(tmp_path: Path) -> None:
    model = tmp_path / "busy.xta"
    model.write_text(BUSY)
    command = _command(model, "--query", "A[] n >= 0")
    with subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        # The search goes on until it is interrupted, however long the start takes.
        while _cpu_seconds(process.pid) < 1.2 and process.poll() is None:
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert re.search(rb"A\[\] n >= 0\n  [\d,]+ states explored", said)
    assert said.endswith(b"interrupted\n")


def _cpu_seconds(pid: int) -> float:
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
