"""The compiled form (``.if``) that readers of ``.xtr`` traces need.

It has the sections that such readers use: names, initial values and ranges (``layout``), processes,
locations, edges and the texts of expressions. The section ``instructions`` is empty: nobody runs
the model from this file. Expressions are numbered in the order in which they stand.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from ntagen.verifyta.network import Network

if TYPE_CHECKING:
    from ntagen.checker import Model

_ALWAYS: Final = "1"
_NO_SYNC: Final = "0"

_LAYOUT_COLUMNS: Final = """\
layout
#index:clock:nr:name
#index:var:min:max:init:nr:name
#index:meta:min:max:init:nr:name
#index:location:flags:name
"""


class _Expressions:
    """The texts of expressions, each with its address."""

    def __init__(self) -> None:
        self.texts: list[str] = []

    def add(self, text: str, default: str) -> int:
        """The address of a label, or of what stands for an empty one."""
        self.texts.append(" ".join(text.split()) or default)
        return len(self.texts) - 1


def compiled_form(network: Network) -> Iterator[str]:
    """The file in pieces; lines end with line feeds only."""
    yield _LAYOUT_COLUMNS
    index = 0
    for number, clock in enumerate(network.clocks):
        yield f"{index}:clock:{number}:{clock}\n"
        index += 1
    for number, variable in enumerate(network.variables):
        kind = "meta" if variable.meta else "var"
        bounds = f"{variable.low}:{variable.high}:{variable.initial}"
        yield f"{index}:{kind}:{bounds}:{number}:{variable.name}\n"
        index += 1
    first_locations = []
    for process in network.processes:
        first_locations.append(index)
        for location in process.locations:
            flags = "" if location.kind == "normal" else location.kind
            yield f"{index}:location:{flags}:{location.name}\n"
            index += 1
    yield "\ninstructions\n#address: opcode\n\nprocesses\n#index:initial:name\n"
    for number, (process, first) in enumerate(zip(network.processes, first_locations, strict=True)):
        yield f"{number}:{first + process.initial}:{process.name}\n"
    expressions = _Expressions()
    yield "\nlocations\n#index:process:invariant\n"
    for number, (process, first) in enumerate(zip(network.processes, first_locations, strict=True)):
        for offset, location in enumerate(process.locations):
            invariant = expressions.add(location.invariant, _ALWAYS)
            yield f"{first + offset}:{number}:{invariant}\n"
    yield "\nedges\n#process:source:target:guard:sync:update\n"
    for number, (process, first) in enumerate(zip(network.processes, first_locations, strict=True)):
        for edge in process.edges:
            guard = expressions.add(edge.guard, _ALWAYS)
            sync = expressions.add(edge.sync, _NO_SYNC)
            update = expressions.add(edge.update, _ALWAYS)
            ends = f"{first + edge.source}:{first + edge.target}"
            yield f"{number}:{ends}:{guard}:{sync}:{update}\n"
    yield "\nexpressions\n#address:reads:writes:text\n"
    for address, text in enumerate(expressions.texts):
        yield f"{address}:::{text}\n"


def compiled_text(model: Model) -> str:
    """The compiled form of a model as one text."""
    from ntagen.verifyta.network import network_of

    return "".join(compiled_form(network_of(model)))
