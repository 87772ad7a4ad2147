"""Tests written by a template of the user's (Jinja).

A template sees ``suite``, ``model`` (the model's file) and ``tests``; if it writes a file for each
test, also ``test``. A test has the attributes of `Case`, and ``steps`` with test code; numbers are
fractions: the filter ``number`` writes them as decimals where that is exact, ``identifier`` makes a
name of any text, and ``python`` writes a value for Python.

Templates run in Jinja's sandbox: they cannot reach Python behind the values.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from ntagen.errors import InputError
from ntagen.suites.suite import Case, Suite
from ntagen.suites.testcode import Harness

if TYPE_CHECKING:
    from jinja2.sandbox import SandboxedEnvironment


class ShownCase:
    """A test as a template sees it: its attributes, and steps with test code."""

    def __init__(self, case: Case, harness: Harness) -> None:
        self.name, self.goal = case.name, case.goal
        self.initial, self.wait, self.duration = case.initial, case.wait, case.duration
        self.codes = harness.entered(case.initial)
        self.steps = harness.with_codes(case)


def rendered(
    suite: Suite, harness: Harness, template: str, name: str, file_name: str
) -> dict[str, str]:
    """Files of tests.

    Args:
        suite: The suite.
        harness: The test code of the model.
        template: The text of the template.
        name: The name of the template, for messages.
        file_name: The name of the file; with ``{}`` in it there is a file for each test, which has
            the name of the test there.

    Returns:
        The texts by name of file.

    Raises:
        InputError: The template is wrong, or fails.
    """
    import jinja2

    environment = _environment()
    tests = [ShownCase(case, harness) for case in suite.tests]
    known: dict[str, Any] = {
        "suite": suite,
        "model": suite.model,
        "tests": tests,
        "prefix": harness.prefix,
        "postfix": harness.postfix,
    }
    try:
        parsed = environment.from_string(template)
        if "{}" not in file_name:
            return {file_name: parsed.render(known)}
        return {
            file_name.replace("{}", test.name): parsed.render({**known, "test": test})
            for test in tests
        }
    except jinja2.TemplateSyntaxError as error:
        raise InputError(f"{name}:{error.lineno}: {error.message}") from error
    except jinja2.UndefinedError as error:
        raise InputError(
            f"{name}: {error.message}\nhint: what templates know stands in docs/testing.md"
        ) from error
    except (jinja2.TemplateError, ArithmeticError, LookupError, TypeError, ValueError) as error:
        raise InputError(f"{name}: {error}") from error


def _environment() -> SandboxedEnvironment:
    from jinja2 import StrictUndefined
    from jinja2.sandbox import ImmutableSandboxedEnvironment

    environment = ImmutableSandboxedEnvironment(
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        # Tests are programs, and not pages.
        autoescape=False,
    )
    environment.filters |= {"number": number, "identifier": identifier, "python": python}
    return environment


def number(value: Fraction | int) -> str:
    """A number as text: decimal where that is exact, else as a fraction such as ``1/3``."""
    exact = Fraction(value)
    decimal = f"{float(exact):.12f}".rstrip("0").rstrip(".")
    return decimal if Fraction(decimal) == exact else str(exact)


def identifier(text: str) -> str:
    """A text as a name: letters, digits and underscores."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_")
    return f"_{name}" if not name or name[0].isdigit() else name


def python(value: Any) -> str:  # noqa: ANN401  any value of a template
    """A value as an expression of Python; fractions are ``Fraction(3, 2)``."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{python(k)}: {python(v)}' for k, v in value.items())}}}"
    return repr(value)
