"""Changes of parts: what is removed, where processes start, of which kind a part is."""

from __future__ import annotations

from ntagen.document.content import Change
from ntagen.document.markup import New, attribute_set, inserted, removed
from ntagen.document.outline import LOCATION_KINDS, Outline, end_of, kind_of, nodes_of
from ntagen.errors import InputError


def part_removed(outline: Outline, address: str) -> list[Change]:
    """A template, location, branch point, edge or query is removed.

    The edges of a location or a branch point are removed with it. If processes start in it, they
    start in the first other location.

    Raises:
        InputError: There is no such part.
    """
    part = outline.part(address)
    gone, changes = [part], []
    template = part.parent
    if part.tag in ("location", "branchpoint") and template is not None:
        identity = part.attributes.get("id", "").strip()
        gone += [
            edge
            for edge in template.all("transition")
            if identity in (end_of(edge, "source"), end_of(edge, "target"))
        ]
        init = template.first("init")
        if init is not None and init.attributes.get("ref", "").strip() == identity:
            others = [one for one in template.all("location") if one is not part]
            if others:
                first = others[0].attributes.get("id", "")
                changes.append(attribute_set(outline.data, init, "ref", first))
            else:
                gone.append(init)
    return changes + [removed(outline.data, one) for one in gone]


def initial_set(outline: Outline, address: str) -> list[Change]:
    """Processes start in a location.

    Raises:
        InputError: There is no such location.
    """
    part = outline.part(address)
    template = part.parent
    if part.tag != "location" or template is None:
        raise InputError("a process starts in a location")
    identity = part.attributes.get("id", "")
    init = template.first("init")
    if init is None:
        new = New.referring("init", identity)
        return [inserted(outline.data, template, new, "init")]
    if init.attributes.get("ref", "").strip() == identity.strip():
        return []
    return [attribute_set(outline.data, init, "ref", identity)]


def kind_set(outline: Outline, address: str, kind: str) -> list[Change]:
    """A location is normal, urgent or committed.

    Raises:
        InputError: There is no such location or kind.
    """
    part = outline.part(address)
    if part.tag != "location" or kind not in LOCATION_KINDS:
        raise InputError(f"a location is {', '.join(LOCATION_KINDS)}")
    if kind_of(part) == kind:
        return []
    marks = [one for one in part.children if one.tag in LOCATION_KINDS]
    if kind == "normal":
        return [removed(outline.data, one) for one in marks]
    if not marks:
        return [inserted(outline.data, part, New(kind), "urgent")]
    fresh = Change(marks[0].start, marks[0].end, f"<{kind}/>".encode())
    return [fresh, *(removed(outline.data, one) for one in marks[1:])]


def end_set(outline: Outline, address: str, end: str, identity: str) -> list[Change]:
    """An edge leaves (``source``) or enters (``target``) another location or branch point.

    Raises:
        InputError: There is no such edge, end, location or branch point.
    """
    edge = outline.part(address)
    found = edge.first(end) if edge.tag == "transition" and end in ("source", "target") else None
    template = edge.parent
    if found is None or template is None:
        raise InputError("only edges have a source and a target")
    if identity not in {one.attributes.get("id", "").strip() for one in nodes_of(template)}:
        raise InputError(
            f"the template has no location {identity[:80]!r}\nhint: choose another one"
        )
    if end_of(edge, end) == identity:
        return []
    return [attribute_set(outline.data, found, "ref", identity)]


def controllable_set(outline: Outline, address: str, *, controllable: bool) -> list[Change]:
    """An edge is the controller's or the environment's.

    Raises:
        InputError: There is no such edge.
    """
    edge = outline.part(address)
    if edge.tag != "transition":
        raise InputError("only edges are the controller's or the environment's")
    if (edge.attributes.get("controllable", "true") == "true") == controllable:
        return []
    value = "true" if controllable else "false"
    return [attribute_set(outline.data, edge, "controllable", value)]
