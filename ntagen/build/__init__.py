"""Models as values: made or read in Python, edited, and written as UPPAAL's XML.

::

    from ntagen import build

    m = build.Model(declarations="chan go;")
    t = m.template("Lamp", declarations="clock x;")
    off = t.location("Off", initial=True)
    on = t.location("On", invariant="x <= 20")
    t.edge(off, on, sync="go?", update="x = 0")
    m.system = "system Lamp;"
    m.write("lamp.xml")
    m.load().check("E<> Lamp.On")

The parts are dataclasses whose texts are those of UPPAAL's language. Here only the structure is
checked: whether edges join locations of their own template, whether names are used once, whether
each template has an initial location. What the texts mean, the engine alone decides (`Model.load`).

Invariant: reading what was written gives an equal model, and the engine loads the same network from
a file and from the file written again.
"""

from ntagen.build.model import Model, Outcome, Query, outcome_of
from ntagen.build.parts import BranchPoint, Edge, Location, Point
from ntagen.build.reading import parse, read
from ntagen.build.template import Template

__all__ = [
    "BranchPoint",
    "Edge",
    "Location",
    "Model",
    "Outcome",
    "Point",
    "Query",
    "Template",
    "outcome_of",
    "parse",
    "read",
]
