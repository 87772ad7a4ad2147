"""Reads UPPAAL's XML into the parts of a model.

It reads what the engine reads (`checker/src/syntax/xml.rs`), in the same way: the order of elements
is free, a missing text is an empty one, and what has no meaning is kept in `extra` and
`attributes`. Of two elements of which only one counts, the engine takes the first; the second is
kept as `extra`. What these parts cannot hold is refused with its line.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final, NoReturn
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

from ntagen.build.model import Model, Outcome, Query
from ntagen.build.parts import (
    EDGE_LABELS,
    LOCATION_LABELS,
    BranchPoint,
    Edge,
    LabelKind,
    Location,
    Node,
    Point,
)
from ntagen.build.template import Template
from ntagen.errors import InputError
from ntagen.files import MODEL_BYTES, read_file

_LATIN_1: Final = re.compile(
    rb"""<\?xml[^>]*encoding\s*=\s*["'](?:iso-?8859-1|latin-?1|windows-1252|cp1252)["']""",
    re.IGNORECASE,
)
_TAG: Final = re.compile(rb"""<(?:[^"'>]|"[^"]*"|'[^']*')*>""")

_WAYS_OUT: Final = {
    "not well-formed (invalid token)": "write &lt; for <, and &amp; for &",
    "undefined entity": "write &amp; for &, and characters instead of entities such as &nbsp;",
    "mismatched tag": "close each element before the one around it",
    "no element found": "the file ends too early; copy it again",
    "unclosed token": "the file ends too early; copy it again",
}


def read(path: str | Path) -> Model:
    """Reads a model from a file of UPPAAL (XML).

    Raises:
        InputError: The file is not XML, or something in it cannot be kept.
        OSError: The file cannot be read.
    """
    return _parsed(_decoded(read_file(path, MODEL_BYTES)), str(path))


def parse(text: str) -> Model:
    """Reads a model from the text of such a file.

    Raises:
        InputError: The text is not XML, or something in it cannot be kept.
    """
    return _parsed(text, "the text")


def _decoded(data: bytes) -> str:
    """The text of a file, as the engine decodes it: `checker/src/syntax/encoding.rs`."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16", errors="replace")
    if data[:2] in (b"<\0", b"\0<"):
        return data.decode("utf-16-le" if data[0] else "utf-16-be", errors="replace")
    if not data.startswith(b"\xef\xbb\xbf") and _LATIN_1.match(data):
        return data.decode("latin-1")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.removeprefix(b"\xef\xbb\xbf").decode("latin-1")


def _parsed(text: str, path: str) -> Model:
    if not text.lstrip().startswith("<"):
        raise InputError(
            f"{path}: only models in UPPAAL's XML can be edited, and this is none\n"
            "hint: `ntagen convert` makes XML of an XTA model or an environment"
        )
    return _Reader(path, text).model()


class _Reader:
    """Reads one file."""

    def __init__(self, path: str, text: str) -> None:
        self._path = path
        self._lines: dict[Element, int] = {}
        self._spans: dict[Element, tuple[int, int]] = {}
        self._header: list[str] = []
        self._data = text.encode("utf-8", errors="replace")
        self._root = self._tree()

    def model(self) -> Model:
        """The model of the file."""
        root = self._root
        if root.tag not in ("nta", "project"):
            self._refuse(
                root,
                f"this XML file is not a UPPAAL model: its root is <{root.tag}>",
                "a model has the root element <nta>",
            )
        model = Model(attributes=dict(root.attrib), extra=self._header)
        texts: dict[str, list[str]] = {"declaration": [], "instantiation": [], "system": []}
        self._plain(root)
        for child in root:
            if child.tag in texts:
                texts[child.tag].append(self._text(child))
            elif child.tag == "template":
                # Some generators close the last template only behind the system section.
                for inner in [one for one in child if one.tag in ("instantiation", "system")]:
                    texts[inner.tag].append(self._text(inner))
                    child.remove(inner)
                model.templates.append(self._template(child))
            elif child.tag == "queries":
                self._queries(child, model)
            else:
                model.extra.append(self._xml(child))
        model.declarations, model.instantiations, model.system = map("\n".join, texts.values())
        return model

    def _tree(self) -> Element:
        """Reads the elements with their lines and bytes, and the comments before the root."""
        builder = ElementTree.TreeBuilder(insert_comments=True)
        parser = expat.ParserCreate("utf-8")
        parser.buffer_text = True
        data = self._data
        open_elements: list[Element] = []

        def start(tag: str, attributes: dict[str, str]) -> None:
            element = builder.start(tag, attributes)
            self._lines[element] = parser.CurrentLineNumber
            self._spans[element] = (parser.CurrentByteIndex, -1)
            open_elements.append(element)

        def end(tag: str) -> None:
            builder.end(tag)
            element = open_elements.pop()
            first, _ = self._spans[element]
            found = _TAG.match(data, first)
            if found is not None and not found[0].endswith(b"/>"):
                found = _TAG.match(data, parser.CurrentByteIndex)
            self._spans[element] = (first, found.end() if found else first)

        def comment(text: str) -> None:
            if open_elements:
                element = builder.comment(text)
                self._lines[element] = parser.CurrentLineNumber
                at = parser.CurrentByteIndex
                self._spans[element] = (at, data.index(b"-->", at) + 3)
            else:
                self._header.append(f"<!--{text}-->")

        def other(text: str) -> None:
            if text.startswith("&"):
                raise InputError(
                    f"{self._path}:{parser.CurrentLineNumber}: unknown entity {text}\n"
                    f"hint: {_WAYS_OUT['undefined entity']}"
                )

            if text.startswith("<?") and open_elements:
                self._refuse(open_elements[-1], f"{text} cannot be kept", "delete it")

        parser.StartElementHandler = start
        parser.EndElementHandler = end
        parser.CharacterDataHandler = builder.data
        parser.CommentHandler = comment
        parser.DefaultHandlerExpand = other
        try:
            parser.Parse(data, True)
        except expat.ExpatError as error:
            cause = expat.ErrorString(error.code)
            raise InputError(
                f"{self._path}:{error.lineno}: the file is not well-formed XML: {cause}\n"
                f"hint: {_WAYS_OUT.get(cause, 'save the model in UPPAAL again')}"
            ) from None
        return builder.close()

    def _template(self, element: Element) -> Template:
        self._plain(element)
        first = self._first(element, "name", "parameter", "declaration", "init")
        template = Template("", attributes=dict(element.attrib))
        template.name = self._placed_text(first.get("name"), "name", template).strip()
        template.parameters = self._placed_text(first.get("parameter"), "parameters", template)
        template.declarations = self._text(first.get("declaration"))
        nodes: dict[str, Node] = {}
        for child in element:
            if child.tag in ("location", "branchpoint"):
                node = self._node(child)
                if node.id in nodes:
                    self._refuse(child, f"the id {node.id} is used twice", "give it another id")
                nodes[node.id] = node
                if isinstance(node, Location):
                    template.locations.append(node)
                else:
                    template.branch_points.append(node)
        for child in element:
            if child.tag == "transition":
                template.edges.append(self._edge(child, nodes))
            elif child.tag not in ("location", "branchpoint") and child not in first.values():
                template.extra.append(self._xml(child))
        if (init := first.get("init")) is not None:
            template.initial = self._initial(init, nodes)
        return template

    def _initial(self, init: Element, nodes: Mapping[str, Node]) -> Location:
        node = self._referred(init, nodes)
        if not isinstance(node, Location):
            self._refuse(init, "a process cannot start in a branch point", "refer to a location")
        return node

    def _node(self, element: Element) -> Node:
        """A location or branch point."""
        self._plain(element)
        attributes = dict(element.attrib)
        name = attributes.pop("id", "").strip()
        if not name:
            self._refuse(element, f"this {element.tag} has no id", 'write id="…"')
        position, color = self._drawn(element, attributes)
        if element.tag == "branchpoint":
            extra = [self._xml(child) for child in element]
            return BranchPoint(name, position, color, attributes, extra)
        node = Location(id=name, position=position, color=color, attributes=attributes)
        first = self._first(element, "name", "urgent", "committed")
        for tag in first.keys() & {"urgent", "committed"}:
            self._bare(first[tag])
            setattr(node, tag, True)
        node.name = self._placed_text(first.get("name"), "name", node).strip()
        rest = [child for child in element if child not in first.values()]
        node.extra = self._labels(node, rest, LOCATION_LABELS)
        return node

    def _edge(self, element: Element, nodes: Mapping[str, Node]) -> Edge:
        self._plain(element)
        first = self._first(element, "source", "target")
        for tag in ("source", "target"):
            if tag not in first:
                self._refuse(element, f"this edge has no <{tag}>", f'write <{tag} ref="…"/>')
        attributes = dict(element.attrib)
        # As in the engine, every other value makes it the environment's.
        controllable = attributes.pop("controllable", "true") == "true"
        position, color = self._drawn(element, attributes)
        if position is not None:
            attributes |= {"x": element.attrib["x"], "y": element.attrib["y"]}
        edge = Edge(
            self._referred(first["source"], nodes),
            self._referred(first["target"], nodes),
            controllable=controllable,
            color=color,
            attributes=attributes,
        )
        rest = [child for child in element if child not in first.values()]
        for nail in [child for child in rest if child.tag == "nail"]:
            self._bare(nail, "x", "y")
            place = self._place(nail)
            if place is None:
                self._refuse(nail, "this nail has no place", 'write x="…" y="…"')
            edge.nails.append(place)
            rest.remove(nail)
        edge.extra = self._labels(edge, rest, EDGE_LABELS)
        return edge

    def _labels(
        self, part: Location | Edge, children: list[Element], kinds: Mapping[str, LabelKind]
    ) -> list[str]:
        """Reads the labels of a part; returns what else is in it."""
        extra = []
        seen = set()
        for child in children:
            kind = kinds.get(child.get("kind", "")) if child.tag == "label" else None
            if kind is None:
                extra.append(self._xml(child))
                continue
            if kind in seen:
                self._refuse(
                    child, f"a second {child.get('kind')} label", "join the two labels in one"
                )
            seen.add(kind)
            setattr(part, kind, self._placed_text(child, kind, part))
        return extra

    def _queries(self, element: Element, model: Model) -> None:
        self._plain(element)
        self._bare(element, children=True)
        for child in element:
            if child.tag != "query":
                model.query_extra.append(self._xml(child))
                continue
            self._plain(child)
            first = self._first(child, "formula", "comment", "expect", "result")
            model.queries.append(
                Query(
                    self._text(first.get("formula")),
                    self._text(first.get("comment")),
                    self._outcome(first.get("expect")),
                    self._outcome(first.get("result")),
                    dict(child.attrib),
                    [self._xml(one) for one in child if one not in first.values()],
                )
            )

    def _outcome(self, element: Element | None) -> Outcome | None:
        if element is None:
            return None
        self._plain(element)
        attributes = dict(element.attrib)
        outcome, kind, value = (attributes.pop(name, "") for name in ("outcome", "type", "value"))
        return Outcome(outcome, kind, value, attributes, [self._xml(child) for child in element])

    def _first(self, element: Element, *tags: str) -> dict[str, Element]:
        """The first child with each tag, by tag."""
        found: dict[str, Element] = {}
        for child in element:
            if child.tag in tags:
                found.setdefault(child.tag, child)
        return found

    def _referred(self, element: Element, nodes: Mapping[str, Node]) -> Node:
        """The location or branch point that an element refers to."""
        self._bare(element, "ref")
        name = element.get("ref", "").strip()
        if name not in nodes:
            known = ", ".join(nodes) or "none"
            self._refuse(
                element,
                f"no location or branch point has the id {name!r}",
                f"the ids of this template: {known}",
            )
        return nodes[name]

    def _text(self, element: Element | None, *attributes: str) -> str:
        """The text of an element with these attributes at most; none is an empty text."""
        if element is None:
            return ""
        self._bare(element, *attributes)
        return element.text or ""

    def _placed_text(
        self, element: Element | None, kind: LabelKind, part: Template | Location | Edge
    ) -> str:
        """The text of an element; where it is drawn is kept in the labels of its part."""
        if element is not None and (place := self._place(element)) is not None:
            part.labels[kind] = place
        return self._text(element, "kind", "x", "y")

    def _bare(self, element: Element, *attributes: str, children: bool = False) -> None:
        """Refuses attributes and children that the parts have no room for."""
        for name in element.attrib:
            if name not in attributes:
                self._refuse(
                    element,
                    f"the attribute {name} of <{element.tag}> cannot be kept",
                    "delete it: UPPAAL gives it no meaning",
                )
        if not children and len(element):
            what = element[0].tag if isinstance(element[0].tag, str) else "!--"
            self._refuse(
                element,
                f"<{what}> in the text of <{element.tag}> cannot be kept",
                "delete it: UPPAAL gives it no meaning; comments of the language are // and /* */",
            )

    def _plain(self, element: Element) -> None:
        """Refuses text where only elements belong."""
        stray = [element.text, *(child.tail for child in element)]
        if text := next((one.strip() for one in stray if one and one.strip()), ""):
            self._refuse(
                element,
                f"the text {text[:40]!r} directly in <{element.tag}> cannot be kept",
                "delete it: UPPAAL does not read it",
            )

    def _drawn(
        self, element: Element, attributes: dict[str, str]
    ) -> tuple[Point | None, str | None]:
        """The place and the colour of an element, which are taken from its attributes."""
        place = self._place(element)
        for name in ("x", "y"):
            attributes.pop(name, None)
        return place, attributes.pop("color", None)

    def _place(self, element: Element) -> Point | None:
        """The place of an element; ``None`` without coordinates."""
        if "x" not in element.attrib and "y" not in element.attrib:
            return None
        x, y = (_number(element.get(name, "")) for name in ("x", "y"))
        if x is None or y is None:
            self._refuse(
                element,
                f"the place of <{element.tag}> is not two numbers",
                "write x and y as numbers, or leave both out",
            )
        return x, y

    def _xml(self, element: Element) -> str:
        """An element or comment as it stands in the file."""
        start, end = self._spans[element]
        return self._data[start:end].decode()

    def _refuse(self, element: Element, cause: str, way_out: str) -> NoReturn:
        line = self._lines.get(element)
        place = self._path if line is None else f"{self._path}:{line}"
        raise InputError(f"{place}: {cause}\nhint: {way_out}")


def _number(text: str) -> float | None:
    """A coordinate: a whole number where it is one."""
    try:
        value = float(text)
    except ValueError:
        return None
    if not math.isfinite(value):
        return None
    return int(value) if value.is_integer() else value
