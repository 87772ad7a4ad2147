"""Agents that stable-baselines3 has trained, from their files."""

from __future__ import annotations

import importlib
from pathlib import Path

from ntagen.checker.policy import Predicting
from ntagen.errors import InputError

__all__ = ["load_agent"]

_PACKAGES = ("stable_baselines3", "sb3_contrib")


def load_agent(algorithm: str, path: Path) -> Predicting:
    """Loads an agent. Loading runs code that is in the file.

    Args:
        algorithm: The class of the algorithm, such as ``PPO``, in stable-baselines3 or sb3-contrib.
        path: What its ``save`` has written.

    Returns:
        The agent, which `ntagen.Model.follow` takes.

    Raises:
        InputError: There is no such algorithm, or the file has no agent of it.
        OSError: The file cannot be read.
    """
    with path.open("rb"):
        kind = _algorithm(algorithm)
    try:
        agent: Predicting = kind.load(path, device="cpu")  # type: ignore[attr-defined]
    except Exception as error:  # its code may raise anything
        why = " ".join(str(error).split()) or type(error).__name__
        raise InputError(
            f"{path} has no agent of {algorithm} that can be loaded: {why}\n"
            "hint: name the class that has saved it, and load it with the versions of the packages "
            "that it was saved with"
        ) from error
    return agent


def _algorithm(name: str) -> type:
    """The class of an algorithm."""
    found = []
    for package in _PACKAGES:
        try:
            module = importlib.import_module(package)
        except ImportError as error:
            if error.name != package:
                raise InputError(f"{package} cannot be imported: {error}") from error
            continue
        base = importlib.import_module("stable_baselines3.common.base_class").BaseAlgorithm
        classes = {one: kind for one, kind in vars(module).items() if isinstance(kind, type)}
        # A recurrent policy remembers what it has seen; those that are followed do not.
        found += [
            one
            for one, kind in classes.items()
            if issubclass(kind, base) and not one.startswith("Recurrent")
        ]
        if name in found:
            return classes[name]
    if not found:
        raise InputError(
            "agents need the package stable-baselines3, which is not installed\n"
            "hint: pip install stable-baselines3"
        )
    raise InputError(f"{name!r} is no algorithm of stable-baselines3\nhint: {', '.join(found)}")
