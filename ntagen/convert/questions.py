"""Asks the engine for values of constants and ranges of types in the templates of a model.

A variable with the constant as its first value, or of the type, is added to the template, and the
model is loaded once more. So the rules of UPPAAL's declarations are nowhere but in the engine.
"""

from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING, Final

from ntagen import checker
from ntagen.convert.network import refuse
from ntagen.convert.xta_writing import written_xta

if TYPE_CHECKING:
    from ntagen import build
    from ntagen.checker.facts import Process

_NAME: Final = "ntagen_asked_"


class Questions:
    """Questions about the templates of a model, and the engine's answers.

    A question is answered for each process of its template. Before it is, it has a placeholder:
    who asks makes a pass over the model, lets `answer` load it, and makes another pass.
    """

    def __init__(self, model: build.Model, path: str) -> None:
        self._model = model
        self._path = path
        self._open: dict[tuple[str, str], Process] = {}
        self._answers: dict[tuple[str, str], tuple[int, int, int]] = {}

    def value(self, process: Process, constant: str) -> int:
        """The value of a constant expression in a process."""
        return self._asked(process, f"= {constant}")[2]

    def range(self, process: Process, type_: str) -> tuple[int, int]:
        """The least and the greatest value of a type in a process."""
        low, high, _ = self._asked(process, f": {type_}")
        return low, high

    def _asked(self, process: Process, question: str) -> tuple[int, int, int]:
        key = process.name, question
        if key in self._answers:
            return self._answers[key]
        self._open[key] = process
        return 0, 0, 0

    def answer(self) -> bool:
        """Lets the engine answer what is open; whether anything was.

        Raises:
            InputError: A constant is no integer.
        """
        if not self._open:
            return False
        probing = copy.deepcopy(self._model)
        number: dict[tuple[str, str], str] = {}
        for (_, question), process in self._open.items():
            asked = process.template, question
            if asked not in number:
                name = number[asked] = f"{_NAME}{len(number)}"
                text = question[2:]
                line = f"int32_t {name} = {text};" if question[0] == "=" else f"{text} {name};"
                probing[process.template].declarations += f"\n{line}"
        try:
            loaded = checker.load(written_xta(probing), self._path)
        except checker.RejectedError as error:
            said = error.diagnostics[0].partition(": ")[2].partition("\n")[0]
            refuse(self._path, f"a constant is no integer: {said}", "use integers in labels")
        found = {one["name"]: one for one in json.loads(loaded.network_json())["variables"]}
        for (name, question), process in self._open.items():
            one = found[f"{name}.{number[process.template, question]}"]
            self._answers[name, question] = one["low"], one["high"], one["initial"]
        self._open.clear()
        return True
