"""Synthetic traces for tests, from the script that made the example."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ntagen import nsl
from ntagen.scene import Scene
from ntagen.traces.chain import Array
from ntagen.traces.face import samples_of
from ntagen.traces.trace import Trace, trace_of

FOLDER = Path(__file__).parents[1] / "examples" / "traces"


def _script() -> Any:  # noqa: ANN401  a module
    spec = importlib.util.spec_from_file_location("make_trace", FOLDER / "make_trace.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["make_trace"] = module
    spec.loader.exec_module(module)
    return module


MAKE = _script()
BENCH: Scene = nsl.load(FOLDER / "bench.nsl")


def points_of(kind: str, seed: int = 1, **how: float) -> Array:
    """The positions of a synthetic trace."""
    return np.array(MAKE.make(kind, seed, **how).points)


def trace(points: Array) -> Trace:
    """Positions as a trace."""
    return trace_of(samples_of(points))
