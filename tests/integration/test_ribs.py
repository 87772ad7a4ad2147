"""The example of a rib cage: it is what its script makes, and has a plan that holds."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from ntagen import nsl
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import synthesiser_for

RIBS = Path(__file__).parents[2] / "examples" / "ribs"


def test_the_script_makes_the_task() -> None:
    made = subprocess.run(
        [sys.executable, RIBS / "make_ribs.py"], capture_output=True, text=True, check=True
    )
    assert nsl.format_text(made.stdout) == (RIBS / "ribs.nsl").read_text("utf-8")


@pytest.mark.slow
def test_there_is_a_plan_that_waits_and_holds() -> None:
    scene = nsl.load(RIBS / "ribs.nsl")
    best = synthesiser_for(Settings())(scene).best
    assert best is not None
    assert best.plan.waits_s > 0.0
    assert best.certificate.keeps_gate
    assert best.certificate.critical_clearance_mm > 0.0
