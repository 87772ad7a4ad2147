"""Which version of the package is installed."""

from __future__ import annotations


def installed_version() -> str:
    """The version of the installed package, or `(not installed)`."""
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("ntagen")
    except PackageNotFoundError:
        return "(not installed)"
