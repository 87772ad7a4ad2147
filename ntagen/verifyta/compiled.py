"""The compiled form (``.if``) that readers of ``.xtr`` traces need.

It has the sections that such readers use: names, initial values and ranges (``layout``), processes,
locations, edges and the texts of expressions. The section ``instructions`` is empty: nobody runs
the model from this file. Expressions are numbered in the order in which they stand.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from ntagen.verifyta.trace import Network, network_of

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


def compiled_text(model: Model) -> str:
    """The compiled form of a model as one text; lines end with line feeds only."""
    return "".join(_pieces(network_of(model)))


def _pieces(network: Network) -> Iterator[str]:
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
    numbered = list(enumerate(zip(network.processes, first_locations, strict=True)))
    for number, (process, first) in numbered:
        yield f"{number}:{first + process.initial}:{process.name}\n"
    texts: list[str] = []

    def address(label: str, default: str) -> int:
        """That of a label, or of what stands for an empty one."""
        texts.append(" ".join(label.split()) or default)
        return len(texts) - 1

    yield "\nlocations\n#index:process:invariant\n"
    for number, (process, first) in numbered:
        for offset, location in enumerate(process.locations):
            invariant = address(location.invariant, _ALWAYS)
            yield f"{first + offset}:{number}:{invariant}\n"
    yield "\nedges\n#process:source:target:guard:sync:update\n"
    for number, (process, first) in numbered:
        for edge in process.edges:
            guard = address(edge.guard, _ALWAYS)
            sync = address(edge.sync, _NO_SYNC)
            update = address(edge.update, _ALWAYS)
            ends = f"{first + edge.source}:{first + edge.target}"
            yield f"{number}:{ends}:{guard}:{sync}:{update}\n"
    yield "\nexpressions\n#address:reads:writes:text\n"
    for number, text in enumerate(texts):
        yield f"{number}:::{text}\n"
