r"""The test code in a model: what UPPAAL's test generator (Yggdrasil) reads and writes.

Locations have labels of the kinds ``testcodeEnter`` and ``testcodeExit``, edges of the kind
``testcode``. Comments in the system declarations frame each test and name its file::

    /** TEST_FILENAME lamp- */
    /** TEST_FILEEXT .py */
    /** TEST_PREFIX
    import lamp
    */
    /** TEST_POSTFIX
    lamp.off()
    */

``$(n)`` and ``$(Lamp.n)`` are replaced by values: on entering a location by those after the step,
in code of an edge and on leaving by those before it. ``\$`` is a dollar sign, ``\\`` a backslash.
Source: "Specifying Test Code" in the manual of UPPAAL 5.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final
from xml.etree import ElementTree

from ntagen.checker.runs import State
from ntagen.errors import InputError
from ntagen.suites.layout import Layout
from ntagen.suites.suite import Case, CaseStep

_TOKEN: Final = re.compile(r"\\([\\$])|\$\(([^)]*)\)")
_LINE_SETTING: Final = re.compile(r"/\*\* ?TEST_(FILENAME|FILEEXT)[ \t]+([^\n]*?)[ \t]*\*/")
_BLOCK_SETTING: Final = re.compile(r"/\*\* ?TEST_(PREFIX|POSTFIX)[^\n]*\n(.*?)\*/", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Harness:
    """The test code of a model.

    Attributes:
        layout: The model.
        prefix: What each test begins with.
        postfix: What each test ends with.
        file_name: What names of files begin with; the number of the test follows.
        ending: What they end with.
        texts: The code of locations (``enter``, ``exit``) and of edges (``edge``), by what it is,
            template and index.
    """

    layout: Layout
    prefix: str
    postfix: str
    file_name: str
    ending: str
    texts: dict[tuple[str, str, int], str]

    def __bool__(self) -> bool:
        return bool(self.texts or self.prefix or self.postfix)

    def files(self, cases: tuple[Case, ...]) -> dict[str, str]:
        """The file of each test, by its name.

        Raises:
            InputError: The code asks for a value that the model does not have.
        """
        return {
            f"{self.file_name}{number}{self.ending}": self._text(case)
            for number, case in enumerate(cases)
        }

    def with_codes(self, case: Case) -> tuple[CaseStep, ...]:
        """The steps of a test with their test code."""
        steps = case.steps
        raw = case.trace["run"]["steps"]
        return tuple(
            replace(
                step,
                edges=tuple(
                    replace(edge, codes=tuple(self._codes(step, one)))
                    for edge, one in zip(step.edges, raw[number]["edges"], strict=True)
                ),
            )
            for number, step in enumerate(steps)
        )

    def entered(self, state: State) -> list[str]:
        """The code of the locations in which a test begins."""
        found = []
        for process, place in state.locations.items():
            text = self.texts.get(("enter", *self.layout.location_index(process, place)))
            if text is not None:
                found.append(_filled(text, state))
        return found

    def _text(self, case: Case) -> str:
        steps = self.with_codes(case)
        # Code of a step comes in the order in which things happen: leave, take, enter.
        lines = self.entered(case.initial)
        for step in steps:
            for moment in range(3):
                lines += [edge.codes[moment] for edge in step.edges if edge.codes[moment]]
        return "".join(f"{part.rstrip()}\n" for part in (self.prefix, *lines, self.postfix) if part)

    def _codes(self, step: CaseStep, raw: dict[str, object]) -> Iterator[str]:
        process = str(raw["process"])
        before, after = step.before, step.after
        for what, place, state in (
            ("exit", self.layout.location_index(process, str(raw["source"])), before),
            ("edge", self.layout.edge_index(raw), before),
            ("enter", self.layout.location_index(process, str(raw["target"])), after),
        ):
            text = self.texts.get((what, *place))
            yield "" if text is None else _filled(text, state)


def harness_of(layout: Layout) -> Harness:
    """The test code of a model; it is false if there is none."""
    texts: dict[tuple[str, str, int], str] = {}
    for template in layout.written.templates:
        for index, location in enumerate(template.locations):
            for kind, text in _labels(location.extra):
                if kind in ("testcodeEnter", "testcodeExit"):
                    what = kind.removeprefix("testcode").lower()
                    texts[what, template.name, index] = text
        for index, edge in enumerate(template.edges):
            for kind, text in _labels(edge.extra):
                if kind == "testcode":
                    texts["edge", template.name, index] = text
    system = layout.written.system
    lines = dict(_LINE_SETTING.findall(system))
    blocks = dict(_BLOCK_SETTING.findall(system))
    return Harness(
        layout,
        blocks.get("PREFIX", ""),
        blocks.get("POSTFIX", ""),
        lines.get("FILENAME", "testcase"),
        lines.get("FILEEXT", ".code"),
        texts,
    )


def _labels(extra: list[str]) -> Iterator[tuple[str, str]]:
    """The kinds and texts of labels that are not empty."""
    for xml in extra:
        if xml.startswith("<label"):
            element = ElementTree.fromstring(xml)
            if text := (element.text or "").strip("\n"):
                yield element.get("kind", ""), text


def _filled(text: str, state: State) -> str:
    """The code with the values of a state."""

    def value(found: re.Match[str]) -> str:
        if found[1]:
            return found[1]
        name = re.sub(r"\s+", "", found[2])
        for known in (state.variables, state.clocks):
            if name in known:
                return str(known[name])
        raise InputError(
            f"the test code {text.strip()!r} asks for $({found[2]}), which is no variable of the "
            "model\nhint: write $(n) for a global variable, and $(Process.n) for one of a process"
        )

    return _TOKEN.sub(value, text)
