"""A model for the tests of its editor, laid out unlike any program would write it again."""

from __future__ import annotations

import difflib
from typing import Final

GATE: Final = """<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE nta PUBLIC '-//Uppaal Team//DTD Flat System 1.6//EN'
  'http://www.it.uu.se/research/group/darts/uppaal/flat-1_6.dtd'>
<!-- A gate; kept by hand. -->
<nta>
\t<declaration>// Both templates know these.
chan open, close;
const int LIMIT = 5;
int[0, 9] count = 0;   // how often</declaration>
\t<template colour='blue'>
\t\t<name x="5" y="5">Gate</name>
\t\t<declaration><![CDATA[clock since; bool quick() { return count < 3; }]]></declaration>
\t\t<location y="0" x="0" id="id0">
\t\t\t<name x="-10" y="-34">Shut</name>
\t\t</location>
\t\t<location id="id1" x="204" y="0">
\t\t\t<name x="194" y="-34">Open</name>
\t\t\t<label kind="invariant" x="194" y="17">since &lt;= LIMIT</label>
\t\t</location>
\t\t<init ref="id0"/>
\t\t<transition>
\t\t\t<source ref="id0"/>
\t\t\t<target ref="id1"/>
\t\t\t<label kind="guard" x="60" y="-34">count &lt; 9 &amp;&amp; since &gt;= 1</label>
\t\t\t<label kind="synchronisation" x="60" y="-17">open?</label>
\t\t\t<label kind="assignment" x="60" y="0">since = 0, count++</label>
\t\t</transition>
\t\t<transition><source ref="id1"/><target ref="id0"/>\
<label kind="synchronisation">close?</label><nail x="102" y="68"/></transition>
\t</template>
\t<template>
\t\t<name>User</name>
\t\t<location id="id2" x="0" y="0"/>
\t\t<init ref="id2"/>
\t\t<transition>
\t\t\t<source ref="id2"/>
\t\t\t<target ref="id2"/>
\t\t\t<label kind="synchronisation">open!</label>
\t\t</transition>
\t\t<transition>
\t\t\t<source ref="id2"/>
\t\t\t<target ref="id2"/>
\t\t\t<label kind="synchronisation">close!</label>
\t\t</transition>
\t</template>
\t<system>system Gate, User;</system>
\t<future version="7"><keep/></future>
\t<queries>
\t\t<query>
\t\t\t<formula>E&lt;&gt; Gate.Open</formula>
\t\t\t<comment>It opens.</comment>
\t\t</query>
\t</queries>
</nta>
"""


def hunks(before: bytes, after: bytes) -> int:
    """The number of hunks of ``diff -u`` between two texts."""
    first, second = (text.decode("latin-1").splitlines(keepends=True) for text in (before, after))
    return sum(line.startswith("@@") for line in difflib.unified_diff(first, second))
