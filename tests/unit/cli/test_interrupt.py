"""Ctrl-C during a search: the counters so far, and the exit code."""

from __future__ import annotations

import re
import signal
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
    old = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 1.0)
    try:
        code = main(["check", str(path), "--query", "A[] a + b < 60000", "--memory", "4GiB"])
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, old)
    assert code == 130
    said = capsys.readouterr().err
    assert re.search(
        r"A\[\] a \+ b < 60000\n  [\d,]+ states explored \([\d,]+/s\), [\d,]+ stored", said
    )
    assert said.endswith("interrupted\n")
