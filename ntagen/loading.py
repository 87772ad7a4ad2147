"""From a file or a text to a model that the engine has accepted, whatever language it is in.

Environments (``.nsl``) become models on the way; UPPAAL's XML and XTA go to the engine as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ntagen import checker
from ntagen.checker import Model, OverflowRule
from ntagen.checker.strategy import Strategy
from ntagen.scene import Scene


@dataclass(frozen=True, slots=True)
class Loaded:
    """A model with what it was made of.

    Attributes:
        model: The model.
        scene: What an environment describes; ``None`` for a UPPAAL model.
        warnings: What the user should know about the environment, one text a warning; the
            model's own are `Model.warnings`.
    """

    model: Model
    scene: Scene | None = None
    warnings: tuple[str, ...] = ()


def load(
    source: str | Path,
    *,
    include: Sequence[str | Path] = (),
    overflow: OverflowRule = "wrap",
) -> Model:
    """Loads a model.

    Args:
        source: A path to a file (UPPAAL XML or XTA, or an environment ``.nsl``), or the text of a
            UPPAAL model. A string is a text if it holds a line break, a ``;`` or a ``<``.
        include: Folders below which the files may lie that an environment includes, beside its own.
        overflow: What happens where the result of integer arithmetic does not fit into 32 bits:
            `Model.overflow`.

    Returns:
        The model: `Model.check` answers queries, its attributes say what is in it.

    Raises:
        InputError: The file or text is wrong; for UPPAAL models it is a
            `ntagen.checker.RejectedError`, which has the diagnostics.
        OSError: The file cannot be read.
    """
    if isinstance(source, str) and any(sign in source for sign in "\n;<"):
        model = checker.load(source)
    else:
        model = load_file(Path(source), include=include).model
    model.overflow = overflow
    return model


def load_strategy(path: str | Path, model: Model) -> Strategy:
    """Reads a strategy that was saved for this model: see `Model.load_strategy`.

    Raises:
        InputError: It is no strategy, or does not fit the model.
        OSError: The file cannot be read.
    """
    return model.load_strategy(path)


def load_file(path: Path, *, include: Sequence[str | Path] = ()) -> Loaded:
    """Loads the model of a file, and the scene if it is an environment; `include` as of `load`.

    Raises:
        InputError: The file is wrong.
        OSError: The file cannot be read.
    """
    if path.suffix.lower() != ".nsl":
        return Loaded(checker.load_file(path))
    from ntagen.nsl import load_with_warnings
    from ntagen.render import render

    scene, warnings = load_with_warnings(path, include=include)
    text = render(scene, source=path.name)
    model = checker.load(text, path=str(path.with_suffix(".xml")))
    return Loaded(model, scene, tuple(warning.render() for warning in warnings))
