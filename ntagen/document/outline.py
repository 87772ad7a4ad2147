"""Which elements of a model hold its texts, and by which address each of them is known.

An address is a path such as ``declaration``, ``templates/0/edges/3/guard`` or
``queries/2/formula``. It counts in the order of the file.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from ntagen.document.content import Form, content_of
from ntagen.document.elements import Element, root_of
from ntagen.errors import InputError

WHOLE: Final = "text"
"""The address of the whole text of a file."""

MODEL_TEXTS: Final = ("declaration", "instantiation", "system")
TEMPLATE_TEXTS: Final = ("name", "parameter", "declaration")
QUERY_TEXTS: Final = ("formula", "comment")
LOCATION_LABELS: Final = ("invariant", "exponentialrate", "comments")
EDGE_LABELS: Final = (
    "select",
    "guard",
    "synchronisation",
    "assignment",
    "probability",
    "comments",
)
"""The kinds of labels, as the file calls them."""

LOCATION_KINDS: Final = ("normal", "urgent", "committed")

_TAGS: Final = {"locations": "location", "branch_points": "branchpoint", "edges": "transition"}


class Outline:
    """The elements of a model.

    Attributes:
        data: The text of the file, as UTF-8.
        form: How its characters are written.
        root: Its outermost element.
    """

    def __init__(self, data: bytes, form: Form) -> None:
        """Reads a text.

        Raises:
            InputError: It is no model that can be edited in parts.
        """
        self.data = data
        self.form = form
        self.root = root_of(data)
        if self.root.tag not in ("nta", "project"):
            raise InputError(f"this XML file is not a UPPAAL model: its root is <{self.root.tag}>")
        self.templates = self.root.all("template")
        holder = self.root.first("queries")
        self.queries = [] if holder is None else holder.all("query")

    def part(self, address: str) -> Element:
        """The template, location, branch point, edge or query at an address.

        Raises:
            InputError: There is none.
        """
        names = address.split("/")
        match names:
            case ["templates", number]:
                return _counted(self.templates, number, address)
            case ["queries", number]:
                return _counted(self.queries, number, address)
            case ["templates", number, kind, inner] if kind in _TAGS:
                template = _counted(self.templates, number, address)
                return _counted(template.all(_TAGS[kind]), inner, address)
        raise _unknown(address)

    def template(self, address: str) -> Element:
        """The template at an address.

        Raises:
            InputError: There is none.
        """
        template = self.part(address)
        if template.tag != "template":
            raise InputError("only templates have locations and edges")
        return template

    def owner(self, address: str) -> tuple[Element, str]:
        """The part that a text belongs to, and which of its texts it is.

        Raises:
            InputError: There is no such text.
        """
        around, _, name = address.rpartition("/")
        part = self.part(around) if around else self.root
        if name not in kinds_of(part):
            raise _unknown(address)
        return part, name

    def text_element(self, address: str) -> Element | None:
        """The element of a text; ``None`` if the file has none yet.

        Raises:
            InputError: There can be no such text.
        """
        part, name = self.owner(address)
        return self._text_in(part, name)

    def _text_in(self, part: Element, name: str) -> Element | None:
        if part.tag in ("location", "transition") and name != "name":
            labels = (one for one in part.all("label") if one.attributes.get("kind") == name)
            return next(labels, None)
        found = part.first(name)
        if found is None and part is self.root and name != "declaration":
            # Some generators close the last template only behind the system section.
            found = next((one for each in self.templates if (one := each.first(name))), None)
        return found

    def texts(self) -> Iterator[tuple[str, Element]]:
        """All texts that the file has, with their addresses."""
        for address, part in self.parts():
            before = f"{address}/" if address else ""
            for name in kinds_of(part):
                element = self._text_in(part, name)
                if element is not None:
                    yield before + name, element

    def parts(self) -> Iterator[tuple[str, Element]]:
        """All parts that have texts, with their addresses; that of the model is empty."""
        yield "", self.root
        for number, template in enumerate(self.templates):
            yield f"templates/{number}", template
            for kind in ("locations", "edges"):
                for inner, part in enumerate(template.all(_TAGS[kind])):
                    yield f"templates/{number}/{kind}/{inner}", part
        for number, query in enumerate(self.queries):
            yield f"queries/{number}", query

    def told(self) -> dict[str, Any]:
        """What a page shows of it: texts are ``null`` where the file has none."""
        return {
            **self._texts_of(self.root),
            "templates": [self._template(one) for one in self.templates],
            "queries": [self._texts_of(one) for one in self.queries],
        }

    def _template(self, template: Element) -> dict[str, Any]:
        init = template.first("init")
        initial = "" if init is None else init.attributes.get("ref", "")
        return {
            **self._texts_of(template),
            "locations": [
                {
                    **self._part(one),
                    "initial": one.attributes.get("id") == initial,
                    "kind": kind_of(one),
                }
                for one in template.all("location")
            ],
            "branch_points": [self._part(one) for one in template.all("branchpoint")],
            "edges": [
                {
                    "source": end_of(one, "source"),
                    "target": end_of(one, "target"),
                    "controllable": one.attributes.get("controllable", "true") == "true",
                    "nails": [place_of(nail) for nail in one.all("nail")],
                    "texts": self._texts_of(one),
                }
                for one in template.all("transition")
            ],
        }

    def _part(self, part: Element) -> dict[str, Any]:
        found: dict[str, Any] = {"id": part.attributes.get("id", ""), "place": place_of(part)}
        return found | ({"texts": self._texts_of(part)} if part.tag == "location" else {})

    def _texts_of(self, part: Element) -> dict[str, str | None]:
        found = {name: self._text_in(part, name) for name in kinds_of(part)}
        return {
            name: None if element is None else content_of(self.data, element).text
            for name, element in found.items()
        }


def nodes_of(template: Element) -> list[Element]:
    """All that edges can lead to: the locations, then the branch points."""
    return [*template.all("location"), *template.all("branchpoint")]


def kinds_of(part: Element) -> tuple[str, ...]:
    """The texts that a part can have, and those of other kinds that it has."""
    match part.tag:
        case "template":
            return TEMPLATE_TEXTS
        case "query":
            return QUERY_TEXTS
        case "location":
            return ("name", *_labels(part, LOCATION_LABELS))
        case "transition":
            return _labels(part, EDGE_LABELS)
        case "branchpoint":
            return ()
    return MODEL_TEXTS


def _labels(part: Element, known: tuple[str, ...]) -> tuple[str, ...]:
    kinds = [one.attributes.get("kind", "") for one in part.all("label")]
    return tuple(dict.fromkeys((*known, *(one for one in kinds if one.isidentifier()))))


def kind_of(location: Element) -> str:
    """``committed``, ``urgent`` or ``normal``."""
    tags = {one.tag for one in location.children}
    return "committed" if "committed" in tags else "urgent" if "urgent" in tags else "normal"


def end_of(edge: Element, tag: str) -> str:
    """The id of the location or branch point at an end of an edge."""
    found = edge.first(tag)
    return "" if found is None else found.attributes.get("ref", "").strip()


def place_of(part: Element | None) -> list[int] | None:
    """Where a part is drawn, x and y; ``None`` if the file does not say."""
    if part is None:
        return None
    try:
        return [round(float(part.attributes[name])) for name in ("x", "y")]
    except (KeyError, ValueError, OverflowError):
        return None


def _counted(parts: list[Element], number: str, address: str) -> Element:
    if not number.isdecimal() or len(number) > 9 or int(number) >= len(parts):
        raise _unknown(address)
    return parts[int(number)]


def _unknown(address: str) -> InputError:
    return InputError(f"the model has no {address[:80]}\nhint: reload the page")
