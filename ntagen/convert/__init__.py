"""Models in the formats of other tools: TChecker, JANI, Graphviz, and UPPAAL's XML and XTA.

XML, XTA and DOT are made from the model as it is written: templates keep their parameters. TChecker
and JANI know no templates: they get the network that the engine has made of the model
(`ntagen.convert.network`). Every other format holds less than UPPAAL's. What it cannot hold is
refused, with its place and a way out; nothing is dropped without a word.
"""

from ntagen.convert.converting import (
    SOURCES,
    TARGETS,
    Converted,
    Source,
    convert,
    source_of,
    source_of_tck,
)

__all__ = ["SOURCES", "TARGETS", "Converted", "Source", "convert", "source_of", "source_of_tck"]
