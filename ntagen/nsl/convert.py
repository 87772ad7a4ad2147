"""Converts lark's trees to those of `ntagen.nsl.tree`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, cast

from ntagen.nsl import tree
from ntagen.nsl.source import Source, Span

if TYPE_CHECKING:
    import lark

    from ntagen.scene import RegionKind


class TreeBuilder:
    """Converts lark's trees to those of `ntagen.nsl.tree`."""

    def __init__(self, source: Source) -> None:
        self._source = source

    def statement(self, node: lark.Tree[lark.Token], span: Span) -> tree.Statement:
        """A statement of any kind."""
        keyword = node.data
        parts = node.children
        match keyword:
            case "environment":
                return tree.Environment(span, self._identifier(parts[0]), ())
            case "needle" | "motion" | "drive":
                return tree.Section(span, keyword, ())
            case "parameter" | "device" | "axis" | "tracker":
                return self._driving(keyword, parts, span)
            case "loop":
                return tree.Loop(
                    span,
                    self._identifier(parts[0]),
                    self.expression(parts[1]),
                    self.expression(parts[3]),
                    (),
                )
            case "let":
                return tree.Let(span, self._identifier(parts[0]), self.expression(parts[1]))
            case "include":
                return tree.Include(span, self._text(parts[0]))
            case "region":
                return self._region(node, span)
            case "roll" | "spin" | "wait" | "gate":
                return self._moving(keyword, parts, span)
            case "tissue" | "safety":
                return self._behaviour(keyword, parts, span)
            case "resolution" | "transform":
                return self._measured(keyword, parts, span)
            case "tip" | "heading" | "bevel" | "radius" | "speed" | "length" | "step":
                return tree.Setting(span, keyword, self.expression(parts[0]))
        raise AssertionError(f"the grammar has a statement that the tree has not: {keyword}")

    def _measured(
        self, keyword: str, parts: Sequence[object], span: Span
    ) -> tree.Resolution | tree.Transform:
        """The scale of the model, or a matrix in the file, or in another one."""
        if keyword == "resolution":
            return tree.Resolution(span, self.expression(parts[0]), self._identifier(parts[1]))
        direction, space = self._identifier(parts[0]), self._identifier(parts[1])
        if isinstance(parts[2], str):
            return tree.Transform(span, direction, space, self._text(parts[2]), ())
        return tree.Transform(span, direction, space, None, tuple(map(self.expression, parts[2:])))

    def _behaviour(
        self, keyword: str, parts: Sequence[object], span: Span
    ) -> tree.Tissue | tree.Choice:
        """What is safe, or how the tissue behaves, with the bounds of an adversarial one."""
        if keyword == "safety":
            return tree.Choice(span, "safety", self._identifier(parts[0]))
        bounds = tuple(
            tree.TissueBound(self._identifier(word), self.expression(value))
            for word, value in zip(parts[1::2], parts[2::2], strict=True)
        )
        return tree.Tissue(span, self._identifier(parts[0]), bounds)

    def _driving(self, keyword: str, parts: Sequence[object], span: Span) -> tree.Statement:
        """A setting of the driver, a device, its axis, or a tracker."""
        if keyword == "parameter":
            words, *values = parts
            return tree.Parameter(span, str(words), tuple(map(self.expression, values)))
        if keyword == "axis":
            word = cast("Literal['insert', 'roll']", str(parts[0]))
            return tree.Axis(span, word, self._identifier(parts[1]), self.expression(parts[2]))
        kind, text = self._identifier(parts[0]), self._text(parts[1])
        if keyword == "device":
            return tree.Device(span, kind, text, ())
        return tree.Tracker(span, kind, text, self._text(parts[2]) if len(parts) > 2 else None)

    def _region(self, node: lark.Tree[lark.Token], span: Span) -> tree.Region:
        """A region with its shape."""
        kind, name, shape, *rest = node.children
        keyword = cast("RegionKind", str(kind))
        shape = cast("lark.Tree[lark.Token]", shape)
        moves = self._moves(cast("lark.Tree[lark.Token]", rest[0])) if rest else None
        return tree.Region(span, keyword, self._region_name(name), self._shape(shape), moves)

    def _moves(self, node: lark.Tree[lark.Token]) -> tree.Moves:
        """How a region moves."""
        span, parts = self._span(node), node.children
        if node.data == "moves_as":
            period = self.expression(parts[1])
            return tree.Moves(span, period, path=self._text(parts[0]))
        values = tuple(map(self.expression, parts))
        if node.data == "moves_through":
            places = tuple(zip(values[:-1:2], values[1:-1:2], strict=True))
            return tree.Moves(span, values[-1], places=places)
        way, towards, period, *phase = values
        return tree.Moves(span, period, (way, towards), phase[0] if phase else None)

    def _moving(self, keyword: str, parts: Sequence[object], span: Span) -> tree.Statement:
        """How the needle rolls and waits, and when it may be pushed."""
        if keyword == "roll":
            return self._roll(parts, span)
        if keyword == "spin":
            return tree.Spin(span, tuple(map(self.expression, parts)))
        if keyword == "gate":
            return tree.Gate(span, self.expression(parts[0]), self.expression(parts[1]))
        limits = [cast("lark.Tree[lark.Token]", part) for part in parts[1:]]
        at_most = self.expression(limits[0].children[0]) if limits else None
        return tree.Wait(span, self.expression(parts[0]), at_most)

    def _shape(
        self, node: lark.Tree[lark.Token]
    ) -> tree.Sphere | tree.Solid | tree.Image | tree.Around:
        """A shape of any kind."""
        span = self._span(node)
        if node.data in ("mesh", "segmentation", "markups"):
            path, *clauses = node.children
            of_file = cast(tree.ImageForm, node.data)
            return tree.Image(span, of_file, self._text(path), tuple(map(self._clause, clauses)))
        if node.data not in ("sphere", "around"):
            nodes = [cast("lark.Tree[lark.Token]", child) for child in node.children]
            turns = [one for one in nodes if one.data == "turned"]
            measures = tuple(self.expression(one) for one in nodes if one not in turns)
            form = cast(tree.SolidForm, node.data)
            if not turns:
                return tree.Solid(span, form, measures)
            angle, axis = map(self.expression, turns[0].children)
            return tree.Solid(span, form, measures, (angle, axis))
        first, second = node.children
        if node.data == "sphere":
            return tree.Sphere(span, self.expression(first), self.expression(second))
        return tree.Around(span, self._region_name(first), self.expression(second))

    def _clause(self, node: object) -> tree.Clause:
        """A clause of a shape from a file."""
        node = cast("lark.Tree[lark.Token]", node)
        span, parts = self._span(node), node.children
        match node.data:
            case "in_space":
                return tree.Clause(span, "in", tuple(map(self._identifier, parts)))
            case "segment":
                return tree.Clause(span, "segment", (self._text(parts[0]),))
            case "point":
                return tree.Clause(span, "point", (self._text(parts[0]),))
            case "label":
                return tree.Clause(span, "label", (), self.expression(parts[0]))
            case "thick":
                return tree.Clause(span, "radius", (), self.expression(parts[0]))
        return tree.Clause(span, "grid", (), self.expression(parts[0]))

    def _region_name(self, node: object) -> tree.RegionName:
        """A name with its indices."""
        node = cast("lark.Tree[lark.Token]", node)
        name, *indices = node.children
        return tree.RegionName(
            self._span(node), self._identifier(name), tuple(map(self.expression, indices))
        )

    def _roll(self, parts: Sequence[object], span: Span) -> tree.Roll:
        """A roll: the kind of a node tells whether it is an angle or a limit."""
        nodes = [cast("lark.Tree[lark.Token]", part) for part in parts]
        limits: dict[str, list[tree.Expression]] = {"at_most": [], "at_least": []}
        angles: list[tree.Expression] = []
        for node in nodes:
            if node.data in limits:
                limits[node.data].append(self.expression(node.children[0]))
            else:
                angles.append(self.expression(node))
        return tree.Roll(span, tuple(angles), tuple(limits["at_most"]), tuple(limits["at_least"]))

    def expression(self, node: object) -> tree.Expression:
        """An expression; levels of the grammar with a single child are skipped."""
        node = cast("lark.Tree[lark.Token]", node)
        children = node.children
        span = self._span(node)
        match node.data:
            case "sum" | "product":
                return self._chain(children, span)
            case "signed":
                *signs, last = children
                operand = self.expression(last)
                return (
                    tree.Signed(span, operand, sum(sign == "-" for sign in signs) % 2 == 1)
                    if signs
                    else operand
                )
            case "quantity":
                operand = self.expression(children[0])
                if len(children) == 1:
                    return operand
                unit = cast("lark.Tree[lark.Token]", children[1]).children[0]
                return tree.Measured(span, operand, self._identifier(unit))
            case "number":
                return tree.Number(span, float(cast(str, children[0])))
            case "name":
                return tree.Name(span, str(children[0]))
            case "call":
                function, *arguments = children
                return tree.Call(
                    span, self._identifier(function), tuple(map(self.expression, arguments))
                )
            case "vector":
                return tree.Vector(span, tuple(map(self.expression, children)))
            case "parenthesised":
                return self.expression(children[0])
        raise AssertionError(f"the grammar has an expression that the tree has not: {node.data}")

    def _chain(self, children: Sequence[object], span: Span) -> tree.Expression:
        """Operands and the operators between them."""
        first = self.expression(children[0])
        rest = tuple(
            (cast("Literal['+', '-', '*', '/']", str(operator)), self.expression(operand))
            for operator, operand in zip(children[1::2], children[2::2], strict=True)
        )
        return tree.Chain(span, first, rest) if rest else first

    def _identifier(self, token: object) -> tree.Identifier:
        """A token as a name with its place."""
        token = cast("lark.Token", token)
        start = cast(int, token.start_pos)
        return tree.Identifier(self._source.span(start, start + len(token)), str(token))

    def _text(self, token: object) -> tree.Identifier:
        """A text in quotes without them, with its place."""
        quoted = self._identifier(token)
        return tree.Identifier(quoted.span, quoted.text[1:-1])

    def _span(self, node: lark.Tree[lark.Token]) -> Span:
        """The place of a node."""
        return self._source.span(node.meta.start_pos, node.meta.end_pos)
