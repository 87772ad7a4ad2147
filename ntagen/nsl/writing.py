"""Writes a task as the text of an environment file, and checks it by the rules for such a text.

Invariants: a text that is given out was loaded again, and says the same as the task. What the
language cannot say is refused, never left out. Numbers are written with all their digits, in units
that keep them; a direction or a turn may change in its last digits, since files say these otherwise
than values do.

The argument of each line is noted, so that a diagnostic names the part of the value it is about.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Final

from ntagen.errors import InputError
from ntagen.nsl import Task, format_text, loads_task
from ntagen.nsl.diagnostics import Diagnostic, SourceError
from ntagen.nsl.tokens import RESERVED
from ntagen.nsl.writing_shapes import CannotSayError, angle, number, region_text, vector
from ntagen.parameters import MEASURES, Given
from ntagen.scene import Region, Scene, Vector
from ntagen.units import deg_from_rad

_NAME: Final = re.compile(r"([^\W\d]\w*)(?:\[-?\d+\])*")

_TOLERANCE: Final = 1e-9
"""Numbers that differ by this part are the same one: only turns and directions differ at all."""

_Line = tuple[str, str]
"""A line of the text, and the argument that it is made of."""


def write(task: Task) -> tuple[str, Task]:
    """The text of a task in the standard layout, and the task that the text describes.

    Raises:
        SourceError: The task breaks rules of the language; the error has all mistakes.
        InputError: The language cannot say something of the task.
    """
    mistakes = [
        f"{place} is {endless}\nhint: give it a number that is finite"
        for part, path in ((task.scene, ""), (task.device, "device"), (task.given, "given"))
        for place, endless in _endless(part, path)
    ]
    lines = [] if mistakes else list(_lines(task, mistakes))
    if mistakes:
        raise InputError("\n".join(mistakes))
    text = "".join(f"{line}\n" for line, _ in lines)
    name = f"environment {task.scene.name}"
    try:
        text = format_text(text, name)
        loaded = loads_task(text, name)
    except SourceError as error:
        raise SourceError(_noted(one, lines) for one in error.diagnostics) from None
    difference = next(_differences(task, loaded), None)
    if difference is not None:
        raise InputError(difference)
    warnings = tuple(_noted(one, lines) for one in loaded.warnings)
    return text, replace(loaded, warnings=warnings)


def _noted(diagnostic: Diagnostic, lines: list[_Line]) -> Diagnostic:
    """The diagnostic with the argument that its line is made of. The layout keeps all lines."""
    if not 1 <= diagnostic.line <= len(lines) or not lines[diagnostic.line - 1][1]:
        return diagnostic
    note = f"this line is made of `{lines[diagnostic.line - 1][1]}`"
    return replace(diagnostic, notes=(note, *diagnostic.notes))


# -------------------------------------------------------------------------------------- the text


def _lines(task: Task, mistakes: list[str]) -> Iterator[_Line]:
    """The lines of the text; what has no words is added to the mistakes."""
    scene = task.scene
    _check_name(scene.name, "name", mistakes)
    yield f"environment {scene.name} {{", ""
    yield from _needle(scene)
    yield from _motion(scene, mistakes)
    criticals = {region.name: region for region in scene.criticals}
    kinds = ("targets", "criticals", "detections", "unexplored", "safe")
    for kind in kinds:
        regions: tuple[Region, ...] = getattr(scene, kind)
        for index, region in enumerate(regions):
            place = f"{kind}[{index}]"
            _check_name(region.name, f"{place}.name", mistakes)
            try:
                yield region_text(region, criticals.get(region.around or "")), place
            except CannotSayError as error:
                mistakes.append(f"{place}: `{region.name}` {error}")
    tissue = scene.tissue
    bounds = (
        f" curvature {number(tissue.curvature_ratio)} roll {angle(tissue.roll_rad)}"
        f" tip {number(tissue.tip_mm)} mm"
    )
    # Without its spreads, a stochastic tissue has those that were measured.
    is_bounded = tissue.kind != "static" or any(
        (tissue.curvature_ratio, tissue.roll_rad, tissue.tip_mm)
    )
    yield f"tissue {tissue.kind}{bounds if is_bounded else ''}", "tissue"
    if scene.resolution_per_mm is not None:
        yield f"resolution {number(scene.resolution_per_mm)} per mm", "resolution_per_mm"
    yield f"safety {scene.safety}", "safety"
    for index, query in enumerate(scene.queries):
        place = f"queries[{index}]"
        _check_name(query.name, f"{place}.name", mistakes)
        if "\n" in query.text or "//" in query.text or "/*" in query.text:
            mistakes.append(
                f"{place}: the text of `{query.name}` has a line break or a comment, and a query "
                "ends there\nhint: write it on one line, without a comment"
            )
        yield f"query {query.name} = {query.text}", place
    yield from _driver(task, mistakes)
    yield "}", ""


def _check_name(name: str, place: str, mistakes: list[str]) -> None:
    match = _NAME.fullmatch(name)
    if match is None:
        mistakes.append(
            f"{place}: `{name}` cannot be a name in an environment\n"
            "hint: write letters, digits and _, and perhaps a number as in `Post[3]`"
        )
    elif match[1] in RESERVED:
        mistakes.append(
            f"{place}: `{name}` is a word of the language\nhint: write for example `{name}_1`"
        )


def _needle(scene: Scene) -> Iterator[_Line]:
    needle = scene.needle
    tip = needle.tip
    bevel = "free" if scene.limits.free_bevel else _direction(tip.bevel)
    yield "needle {", "needle"
    yield f"tip {vector(tip.position_mm)} mm", "needle.tip.position_mm"
    yield f"heading {_direction(tip.heading)}", "needle.tip.heading"
    yield f"bevel {bevel}", "needle.tip.bevel"
    yield f"radius {number(needle.radius_mm)} mm", "needle.radius_mm"
    yield f"speed {number(needle.speed_mm_per_s)} mm/s", "needle.speed_mm_per_s"
    yield f"length {number(needle.length_mm)} mm", "needle.length_mm"
    yield "}", ""


def _direction(direction: Vector) -> str:
    """A direction, by the letter of an axis if it lies along one."""
    for index, letter in enumerate("xyz"):
        others = [value for place, value in enumerate(direction) if place != index]
        if abs(direction[index]) == 1.0 and not any(others):
            return ("+" if direction[index] > 0.0 else "-") + letter
    return vector(direction)


def _motion(scene: Scene, mistakes: list[str]) -> Iterator[_Line]:
    limits, breath = scene.limits, scene.breath
    if not limits.roll_angles_rad:
        mistakes.append(
            "limits.roll_angles_rad: there is no roll\n"
            "hint: give one, and max_rolls=0 if the needle must not roll"
        )
    degrees = ", ".join(str(round(deg_from_rad(one))) for one in limits.roll_angles_rad)
    yield "motion {", "limits"
    yield f"step {number(limits.step_s)} s", "limits.step_s"
    yield (
        (
            f"roll by {degrees} deg at most {number(limits.max_rolls)} times "
            f"at least {number(limits.min_roll_distance_mm)} mm apart"
        ),
        "limits",
    )
    if limits.spins:
        yield f"spin {', '.join(map(number, limits.spins))}", "limits.spins"
    if breath is not None:
        yield (
            (f"wait {number(breath.wait_s)} s at most {number(breath.max_pauses)} times"),
            "breath",
        )
        if breath.gate is not None:
            first, last = angle(breath.gate.from_rad), angle(breath.gate.to_rad)
            yield f"push only while phase between {first} and {last}", "breath.gate"
    yield "}", ""


def _driver(task: Task, mistakes: list[str]) -> Iterator[_Line]:
    if task.given:
        yield "drive {", "given"
        for index, given in enumerate(task.given):
            yield f"{given.parameter.words} {_value(given)}", f"given[{index}]"
        yield "}", ""
    if task.device is not None:
        insert, roll = task.device.insert, task.device.roll
        yield f"device grbl {_quoted(task.device.port, 'device.port', mistakes)} {{", "device"
        yield f"insert {insert.letter} {number(insert.steps_per_unit)} steps/mm", "device.insert"
        yield f"roll {roll.letter} {number(roll.steps_per_unit)} steps/deg", "device.roll"
        yield "}", ""
    if task.tracker is not None:
        tracker = task.tracker
        host = f"[{tracker.host}]" if ":" in tracker.host else tracker.host
        name = "" if not tracker.name else " " + _quoted(tracker.name, "tracker.name", mistakes)
        address = _quoted(f"{host}:{tracker.port}", "tracker", mistakes)
        yield f"tracker openigtlink {address}{name}", "tracker"


def _value(given: Given) -> str:
    """The value of a setting in its usual unit, or in the base unit if that keeps its digits."""
    value, measure = given.value, MEASURES[given.parameter.kind]
    if isinstance(value, bool | tuple) or given.parameter.kind == "count":
        return given.parameter.shown(value) if isinstance(value, bool | tuple) else number(value)
    usual = given.parameter.in_usual_unit(value)
    if usual * measure.units.get(measure.unit, 1.0) == value:
        return f"{number(usual)} {measure.unit}".rstrip()
    base = next((unit for unit, factor in measure.units.items() if factor == 1.0), "")
    return f"{number(value)} {base}".rstrip()


def _quoted(text: str, place: str, mistakes: list[str]) -> str:
    if '"' in text or "\n" in text:
        mistakes.append(
            f"{place}: a text in an environment has no quotation marks and line breaks\n"
            "hint: choose another name"
        )
    return f'"{text}"'


# ------------------------------------------------------------------------------------ what is lost

_WAYS_OUT: Final = {
    "detections": "with `around` it has the shape of that critical region, grown by a margin, and "
    "moves with it; leave `around` out if it does not",
    "axis": "a file has no axis of its own: it is the heading of the tip",
    "needle.tip.bevel": "with `free_bevel` the language chooses the bevel: give the second one",
    "breath.clock_s": "plans of a file begin at 0 s of the breath",
    "shaft_mm": "a file describes the needle before its entry: leave `shaft_mm` out",
}


def _differences(task: Task, loaded: Task) -> Iterator[str]:
    """What the text says otherwise than the task, as messages."""
    pairs: list[tuple[str, object, object]] = [
        ("", task.scene, loaded.scene),
        ("device", task.device, loaded.device),
        ("tracker", task.tracker, loaded.tracker),
        ("given", _settings(task), _settings(loaded)),
    ]
    for path, own, other in pairs:
        for place, first, second in _unequal(own, other, path):
            hint = _WAYS_OUT.get(re.sub(r"\[.*", "", place), "give it a value that a file can have")
            yield (
                f"{place} is {_short(first)}, but the language can only say {_short(second)}\n"
                f"hint: {hint}"
            )


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _settings(task: Task) -> tuple[tuple[str, object], ...]:
    return tuple((given.parameter.words, given.value) for given in task.given)


def _endless(value: object, path: str) -> Iterator[tuple[str, float]]:
    """The places of numbers that are none, or infinite."""
    if isinstance(value, float) and not math.isfinite(value):
        yield path, value
    elif isinstance(value, tuple):
        for index, one in enumerate(value):
            yield from _endless(one, f"{path}[{index}]")
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from _endless(getattr(value, field.name), f"{path}.{field.name}".lstrip("."))


def _unequal(own: object, other: object, path: str) -> Iterator[tuple[str, object, object]]:
    """The places at which two values differ by more than the last digits."""
    if own == other:
        return
    if dataclasses.is_dataclass(own) and type(own) is type(other):
        for field in dataclasses.fields(own):
            inner = f"{path}.{field.name}".lstrip(".")
            yield from _unequal(getattr(own, field.name), getattr(other, field.name), inner)
    elif isinstance(own, tuple) and isinstance(other, tuple) and len(own) == len(other):
        for index, (first, second) in enumerate(zip(own, other, strict=True)):
            yield from _unequal(first, second, f"{path}[{index}]")
    elif not (
        isinstance(own, float | int)
        and isinstance(other, float | int)
        and math.isclose(own, other, rel_tol=_TOLERANCE, abs_tol=_TOLERANCE)
    ):
        yield path, own, other
