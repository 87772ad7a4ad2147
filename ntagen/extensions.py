"""Finds what other packages add to ntagen: devices and trackers, by entry points.

A package offers a factory under a name in its ``pyproject.toml``::

    [project.entry-points."ntagen.devices"]
    mystage = "mystage:open_stage"

Whatever such a package does wrong becomes one message with the name of the plugin.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final

from ntagen.errors import DeviceError, Halted, InputError, NtagenError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

DEVICES: Final = "ntagen.devices"
"""The group of what moves a needle."""

TRACKERS: Final = "ntagen.trackers"
"""The group of what measures one."""


def _entry_points(group: str) -> list[EntryPoint]:
    """All plugins of a group. What reads the metadata of packages takes long to import."""
    from importlib.metadata import entry_points

    return list(entry_points(group=group))


def names(group: str) -> tuple[str, ...]:
    """The names of all plugins of a group, sorted."""
    return tuple(sorted({point.name for point in _entry_points(group)}))


def described(group: str) -> str:
    """All plugins of a group with their packages, for messages."""
    points = sorted(_entry_points(group), key=lambda point: point.name)
    return ", ".join(f"{point.name} ({package(point)})" for point in points) or "none"


def package(point: EntryPoint) -> str:
    """The package of a plugin, with its version."""
    return f"{point.dist.name} {point.dist.version}" if point.dist else "an unknown package"


def find(group: str, name: str) -> EntryPoint:
    """The plugin of a name.

    Raises:
        InputError: There is none, or there are several.
    """
    named = {point.value: point for point in _entry_points(group) if point.name == name}
    found = list(named.values())
    if not found:
        raise InputError(
            f"no plugin '{name}' is installed\nhint: installed are: {described(group)}"
        )
    if len(found) > 1:
        packages = " and ".join(package(point) for point in found)
        raise InputError(f"several plugins are called '{name}': {packages}\nhint: uninstall one")
    return found[0]


def load(group: str, name: str) -> Callable[..., Any]:
    """The factory of a plugin.

    Raises:
        InputError: There is no plugin of this name, or there are several.
        DeviceError: It cannot be imported, or is no factory.
    """
    point = find(group, name)
    with guarded(name, "be imported"):
        factory = point.load()
    if not callable(factory):
        raise DeviceError(
            f"the plugin '{name}' ({package(point)}): {point.value} is no factory\n"
            "hint: tell its author; docs/plugins.md says what a plugin must be"
        )
    made: Callable[..., Any] = factory
    return made


@contextlib.contextmanager
def guarded(name: str, does: str) -> Iterator[None]:
    """Turns whatever a plugin raises in the block into one message with its name.

    An interruption by the user, and `Halted`, go on as they are.

    Args:
        name: The name of the plugin.
        does: What it should do.

    Raises:
        DeviceError: The plugin raised something.
    """
    try:
        yield
    except (Halted, KeyboardInterrupt, GeneratorExit):
        raise
    except NtagenError as error:
        raise DeviceError(f"the plugin '{name}': {error}") from error
    # Also what would end the program: a plugin may not do that.
    except BaseException as error:
        said = " ".join(str(error).split())
        raise DeviceError(
            f"the plugin '{name}' failed to {does}: {type(error).__name__}"
            f"{f': {said}' if said else ''}\n"
            "hint: `ntagen device test` checks a plugin; tell its author what it says"
        ) from error


@contextlib.contextmanager
def opened(name: str, factory: Callable[[], Any], needs: tuple[str, ...]) -> Iterator[Any]:
    """What a factory opens, until the end of the block.

    Args:
        name: The name of the plugin.
        factory: Makes the context manager.
        needs: The methods and attributes that what it opens must have.

    Raises:
        DeviceError: The factory fails, makes no context manager, or opens something else.
    """
    with guarded(name, "be opened"):
        manager = factory()
    if not hasattr(manager, "__enter__") or not hasattr(manager, "__exit__"):
        raise DeviceError(
            f"the plugin '{name}' gives {type(manager).__name__}, which is no context manager\n"
            "hint: tell its author; docs/plugins.md says what a plugin must be"
        )
    with guarded(name, "be opened"):
        inner = manager.__enter__()
    try:
        missing = [need for need in needs if not hasattr(inner, need)]
        if missing:
            raise DeviceError(
                f"the plugin '{name}' has no {', '.join(missing)}\n"
                "hint: tell its author; docs/plugins.md says what a plugin must be"
            )
        yield inner
    except BaseException as error:
        # What went wrong first is what the user must know.
        with contextlib.suppress(DeviceError), guarded(name, "be closed"):
            manager.__exit__(type(error), error, error.__traceback__)
        raise
    with guarded(name, "be closed"):
        manager.__exit__(None, None, None)
