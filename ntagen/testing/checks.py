"""A list of checks, each of which passes or says what is wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Check:
    """What came out of one check.

    Attributes:
        name: What must hold, as a sentence.
        problem: What is wrong; empty if it holds.
    """

    name: str
    problem: str = ""


class Wrong(Exception):  # noqa: N818  it is found, not raised by mistake
    """Something does not hold; the text says what was found."""


def run(name: str, check: Callable[[], None]) -> Check:
    """Makes one check; whatever it raises is its problem, except an interruption by the user."""
    try:
        check()
    except Wrong as wrong:
        return Check(name, str(wrong))
    except KeyboardInterrupt:
        raise
    # Also what would end the program.
    except BaseException as error:
        return Check(name, f"{type(error).__name__}: {error}")
    return Check(name)


def need(holds: bool, found: str) -> None:
    """Says that something must hold.

    Raises:
        Wrong: It does not.
    """
    if not holds:
        raise Wrong(found)


def require(checks: Iterable[Check]) -> None:
    """Raises an `AssertionError` that lists all problems, if there are any; for use in tests."""
    problems = [f"{check.name}: {check.problem}" for check in checks if check.problem]
    if problems:
        raise AssertionError("\n".join(problems))
