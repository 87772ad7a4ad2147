"""Changes of elements. New ones look like those around; removed ones leave no empty line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from ntagen.document.content import Change
from ntagen.document.elements import Element
from ntagen.values import dataclass

ORDER: Final = {
    "declaration": ("imports",),
    "template": ("imports", "declaration", "template"),
    "instantiation": ("imports", "declaration", "template"),
    "system": ("imports", "declaration", "template", "instantiation"),
    "queries": ("imports", "declaration", "template", "instantiation", "system"),
    "name": (),
    "parameter": ("name",),
    "template declaration": ("name", "parameter"),
    "location": ("name", "parameter", "declaration", "location"),
    "branchpoint": ("name", "parameter", "declaration", "location", "branchpoint"),
    "init": ("name", "parameter", "declaration", "location", "branchpoint"),
    "transition": (
        *("name", "parameter", "declaration", "location", "branchpoint", "init"),
        "transition",
    ),
    "label": ("name", "source", "target", "label"),
    "nail": ("source", "target", "label", "nail"),
    "urgent": ("name", "label"),
    "committed": ("name", "label", "urgent"),
    "query": ("query",),
    "formula": (),
    "comment": ("formula",),
}
"""The tags that stand in front of an element, in the order of UPPAAL's document type."""

_UNIT: Final = b"\t"
"""How much deeper an element in another one stands, where the file does not show it."""


@dataclass(frozen=True, slots=True)
class New:
    """An element that is added.

    Attributes:
        tag: What stands in its opening tag.
        text: The bytes in it, escaped; ``None`` closes the opening tag.
        inner: The elements in it.
    """

    tag: str
    text: bytes | None = None
    inner: Sequence[New] = ()

    @classmethod
    def referring(cls, tag: str, identity: str) -> New:
        """An element that refers to a part by its id."""
        return cls(f"{tag} ref={quoted(identity)}")

    def written(self, indent: bytes, unit: bytes) -> bytes:
        """Its bytes.

        Args:
            indent: The line end and the white space in front of it; empty if all is on one line.
            unit: How much deeper an element in it stands.
        """
        opening, name = self.tag.encode(), self.tag.split()[0].encode()
        if self.text is None and not self.inner:
            return b"<" + opening + b"/>"
        deeper = indent + unit if indent else b""
        inner = b"".join(deeper + one.written(deeper, unit) for one in self.inner)
        around = indent if self.inner else b""
        return b"<" + opening + b">" + (self.text or b"") + inner + around + b"</" + name + b">"


def quoted(value: str) -> str:
    """A value as an attribute of XML, with quotes."""
    for one, escape in (("&", "&amp;"), ("<", "&lt;"), ('"', "&quot;"), ("\n", "&#10;")):
        value = value.replace(one, escape)
    return f'"{value}"'


def inserted(data: bytes, parent: Element, new: New, order: str) -> Change:
    """A new child of an element.

    Args:
        data: The text of the file.
        parent: The element.
        new: The child.
        order: Where it stands: a key of `ORDER`.
    """
    after = ORDER[order]
    unit = _unit_of(data, parent)
    before = [one for one in parent.children if one.tag in after]
    if before or parent.children:
        indent = indent_of(data, (before or parent.children)[-1 if before else 0])
        at = before[-1].end if before else parent.open_end
        return Change(at, at, indent + new.written(indent, unit))
    around = indent_of(data, parent)
    indent = around + unit if around else b""
    text = indent + new.written(indent, unit)
    if parent.close == parent.end:
        name = parent.tag.encode()
        return Change(parent.open_end - 2, parent.end, b">" + text + around + b"</" + name + b">")
    is_bare = not data[parent.open_end : parent.close].strip(b" \t")
    return Change(parent.open_end, parent.open_end, text + (around if is_bare else b""))


def removed(data: bytes, element: Element) -> Change:
    """The removal of an element with its line, if it stands alone there."""
    return Change(element.start - len(indent_of(data, element)), element.end, b"")


def attribute_set(data: bytes, element: Element, name: str, value: str) -> Change:
    """An attribute with a value."""
    written = quoted(value).encode()
    found = element.value_range(data, name)
    if found is not None:
        return Change(*found, written[1:-1].replace(b"'", b"&apos;"))
    at = element.open_end - (2 if data[element.open_end - 2 : element.open_end] == b"/>" else 1)
    while data[at - 1 : at].isspace():
        at -= 1
    return Change(at, at, f" {name}=".encode() + written)


def indent_of(data: bytes, element: Element) -> bytes:
    """The line end and the white space in front of an element; empty if other things are there."""
    start = element.start
    while start > 0 and data[start - 1 : start] in (b" ", b"\t"):
        start -= 1
    if data[start - 1 : start] != b"\n" or start == 0:
        return b""
    start -= 2 if data[start - 2 : start] == b"\r\n" else 1
    return data[start : element.start]


def applied(data: bytes, changes: Sequence[Change]) -> tuple[bytes, list[Change]]:
    """A text after changes that do not overlap, and the changes that take them back."""
    pieces: list[bytes] = []
    back: list[Change] = []
    at, length = 0, 0
    for change in sorted(changes, key=lambda one: (one.start, one.end)):
        pieces += (data[at : change.start], change.text)
        length += change.start - at
        back.append(Change(length, length + len(change.text), data[change.start : change.end]))
        length += len(change.text)
        at = change.end
    pieces.append(data[at:])
    return b"".join(pieces), back


def _unit_of(data: bytes, parent: Element) -> bytes:
    """How much deeper the children of an element stand than itself, or those of elements near."""
    near: Element | None = parent
    while near is not None:
        own = indent_of(data, near).strip(b"\r\n")
        for child in near.children:
            indent = indent_of(data, child).strip(b"\r\n")
            if indent.startswith(own) and len(indent) > len(own):
                return indent[len(own) :]
        near = near.parent
    return _UNIT
