"""Ctrl-C during a search: the counters so far, and the exit code."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from ntagen.cli import main

ENDLESS = """
int[0,30000] a, b;
process P() { state S; init S; trans S -> S { guard a < 30000; assign a = a + 1; }; }
process Q() { state S; init S; trans S -> S { guard b < 30000; assign b = b + 1; }; }
system P, Q;
"""
"""A model of 900 million states."""


def test_interrupt_ends_with_the_counters_so_far(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "endless.xta"
    path.write_text(ENDLESS)
    old = signal.signal(signal.SIGPROF, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_PROF, 0.4)
    try:
        code = main(["check", str(path), "--query", "A[] a + b < 60000", "--memory", "4GiB"])
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, old)
    assert code == 130
    said = capsys.readouterr().err
    assert re.search(
        r"A\[\] a \+ b < 60000\n  [\d,]+ states explored \([\d,]+/s\), [\d,]+ stored", said
    )
    assert said.endswith("interrupted\n")


def test_sigterm_ends_in_order(tmp_path: Path) -> None:
    path = tmp_path / "endless.xta"
    path.write_text(ENDLESS)
    command = [sys.executable, "-m", "ntagen", "check", str(path), "--memory", "4GiB"]
    command += ["--query", "A[] a + b < 60000", "--trace", str(tmp_path / "trace")]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        assert b"loaded in" in process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        said = process.stderr.read()
    assert process.returncode == 143
    assert said.endswith((b"terminated\n", b"interrupted\n"))
    assert list(tmp_path.iterdir()) == [path]
