"""Symbolic traces as XML, in the form of ``verifyta -X``.

The elements refer to each other by ids: a node (a symbolic state) to its location vector, variable
vector and matrix, a transition to two nodes and to edges. Matrices are complete.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Final
from xml.sax.saxutils import escape, quoteattr

from ntagen.verifyta.trace import Edge, Network, Process, Trace, as_assigned, numbered

if TYPE_CHECKING:
    from ntagen.checker import Answer, Model

_GLOBAL: Final = "sys"


def _trace_xml(network: Network, trace: Trace) -> Iterator[str]:
    """The file in pieces."""
    yield '<?xml version="1.0" encoding="UTF-8"?>\n'
    yield '<trace initial_node="State1" trace_options="symbolic">'
    yield from _system(network)
    numbered = list(enumerate(trace.states, start=1))
    for number, state in numbered:
        places = _words(
            _location_id(process, place)
            for process, place in zip(network.processes, state.locations, strict=True)
        )
        yield f'<location_vector id="LocVec{number}" locations={quoteattr(places)}/>'
    for number, state in numbered:
        yield f'<variable_vector id="varvec.{number}">'
        for variable, value in zip(network.variables, state.values, strict=True):
            name = quoteattr(_global_id(variable.name, network))
            yield f'<variable_state variable={name} value="{value}"/>'
        yield "</variable_vector>"
    for number, _ in numbered:
        yield (
            f'<node id="State{number}" location_vector="LocVec{number}" '
            f'dbm_instance="DBM{number} " variable_vector="varvec.{number}"/>'
        )
    clocks = [quoteattr(one) for one in _clock_ids(network)]
    for number, state in numbered:
        yield f'<dbm_instance id="DBM{number}">'
        for left, row in zip(clocks, state.zone, strict=True):
            for right, bound in zip(clocks, row, strict=True):
                limit = "inf" if bound is None else bound[0]
                relation = "&lt;" if bound is None or bound[1] else "&lt;="
                yield (
                    f'<clockbound clock1={left} clock2={right} bound="{limit}" comp="{relation}"/>'
                )
        yield "</dbm_instance>"
    for number, transition in enumerate(trace.transitions, start=1):
        edges = _words(_edge_id(network.processes[one.process], one.edge) for one in transition)
        yield (
            f'<transition from="State{number}" to="State{number + 1}" edges={quoteattr(edges)}/>'
        )
    yield "</trace>\n"


def trace_xml_text(model: Model, answer: Answer) -> str | None:
    """The first trace of an answer as the text of a file; ``None`` if it has none."""
    found = numbered(model, answer)
    return None if found is None else "".join(_trace_xml(*found))


def _words(words: Iterable[str]) -> str:
    return "".join(f"{word} " for word in words)


def _system(network: Network) -> Iterator[str]:
    clocks = list(zip(_clock_ids(network), network.clocks, strict=True))
    variables = [(_global_id(one.name, network), one.name) for one in network.variables]
    prefix = f"{_GLOBAL}."
    yield "<system>"
    yield from _named("clock", clocks, prefix)
    yield from _named("variable", variables, prefix)
    for process in network.processes:
        name = quoteattr(process.name)
        yield f"<process id={name} name={name}>"
        yield from _named("clock", clocks, f"{process.name}.")
        yield from _named("variable", variables, f"{process.name}.")
        for number, location in enumerate(process.locations):
            place = quoteattr(_location_id(process, number))
            invariant = location.invariant.replace("]]>", "]]]]><![CDATA[>")
            yield (
                f"<location id={place} name={quoteattr(location.name)}>"
                f"<![CDATA[{invariant}]]></location>"
            )
        for number, edge in enumerate(process.edges):
            yield _edge(process, number, edge)
        yield "</process>"
    yield "</system>"


def _named(element: str, entries: Iterable[tuple[str, str]], prefix: str) -> Iterator[str]:
    """Those clocks or variables whose ids begin with the owner's name, by their names in it."""
    for identity, _ in entries:
        if identity.startswith(prefix):
            name = quoteattr(identity.removeprefix(prefix))
            yield f"<{element} name={name} id={quoteattr(identity)}/>"


def _edge(process: Process, number: int, edge: Edge) -> str:
    start = quoteattr(_location_id(process, edge.source))
    end = quoteattr(_location_id(process, edge.target))
    return (
        f"<edge id={quoteattr(_edge_id(process, number))} from={start} to={end}>"
        f"<guard>{escape(edge.guard) or '1'}</guard>"
        f"<sync>{escape(edge.sync) or 'tau'}</sync>"
        f"<update>{escape(as_assigned(edge.update)) or '1'}</update></edge>"
    )


def _location_id(process: Process, location: int) -> str:
    return f"{process.name}.{process.locations[location].name}"


def _edge_id(process: Process, edge: int) -> str:
    return f"{process.name}.Edge{edge + 1}"


def _clock_ids(network: Network) -> list[str]:
    return [f"{_GLOBAL}.#{network.clocks[0]}"] + [
        _global_id(clock, network) for clock in network.clocks[1:]
    ]


def _global_id(name: str, network: Network) -> str:
    """The id of a clock or variable: its name, or below ``sys`` if no process owns it."""
    owner = name.partition(".")[0]
    return name if owner in network.process_numbers else f"{_GLOBAL}.{name}"
