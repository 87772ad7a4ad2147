"""From the description of a needle-steering task to a verified strategy and a steered needle.

These are the names for scripts and notebooks::

    import ntagen

    model = ntagen.load("train-gate.xml")
    model.check("A[] not deadlock").verdict      # "satisfied"
    model.template("Gate")                       # in a notebook: its picture
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ntagen import build as build
    from ntagen import gymnasium as gymnasium
    from ntagen.checker import Answer, Model, RejectedError
    from ntagen.checker.strategy import Strategy
    from ntagen.drive.reading import read_log
    from ntagen.errors import InputError, ModelError, NtagenError, UndecidedError
    from ntagen.experiment.scripting import campaign
    from ntagen.loading import load, load_strategy
    from ntagen.nsl import Task
    from ntagen.plot.face import animate, view
    from ntagen.traces.face import match

__all__ = [
    "Answer",
    "InputError",
    "Model",
    "ModelError",
    "NtagenError",
    "RejectedError",
    "Strategy",
    "Task",
    "UndecidedError",
    "animate",
    "campaign",
    "load",
    "load_strategy",
    "match",
    "read_log",
    "view",
]

_HOMES = {
    name: home
    for home, names in {
        "ntagen.build": ("build",),
        "ntagen.checker": ("Answer", "Model", "RejectedError"),
        "ntagen.checker.strategy": ("Strategy",),
        "ntagen.drive.reading": ("read_log",),
        "ntagen.gymnasium": ("gymnasium",),
        "ntagen.errors": ("InputError", "ModelError", "NtagenError", "UndecidedError"),
        "ntagen.experiment.scripting": ("campaign",),
        "ntagen.loading": ("load", "load_strategy"),
        "ntagen.nsl": ("Task",),
        "ntagen.plot.face": ("animate", "view"),
        "ntagen.traces.face": ("match",),
    }.items()
    for name in names
}
"""The modules of the public names. A name is imported on first use: the command line imports this
package for every command, and `ntagen --help` must not wait for the engine."""


def __getattr__(name: str) -> object:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    import importlib

    module = importlib.import_module(home)
    return module if home == f"{__name__}.{name}" else getattr(module, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
