"""The version of this package."""

from typing import Final

VERSION: Final = "0.1.0"
"""As in `checker/Cargo.toml`, which gives the wheel its version; a test compares the two.

Asking Python for the version of an installed package takes half of the time of `ntagen --version`.
"""
