"""How the axes of a GRBL controller move: trapezoids of speed along straight blocks.

Blocks follow each other with the junction speeds of GRBL 1.1 (its file ``planner.c``). GRBL
computes speeds ahead: its stepper interrupt has a buffer of segments, about 50 ms of motion, which
nothing changes any more. So a hold takes effect that much later, and reported speeds run ahead of
reported positions by it. Here this is `lead_s`.

Lengths are in the controller's units: mm, and degrees on a rotary axis. Times are in seconds.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

_STRAIGHT: Final = 0.999_999
_TINY: Final = 1e-9
_NEAR: Final = 1e-7
"""So close to its end, a block is done."""

_SHORTEST: Final = 1e-6
"""Shorter blocks are less than a step of any axis, and move nothing."""

Position = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Limits:
    """What the axes can do: each axis has a greatest speed and an acceleration."""

    speeds: Position
    accelerations: Position
    junction_deviation: float


@dataclass(frozen=True, slots=True)
class Block:
    """A straight motion, and the speed with which it may be entered."""

    start: Position
    unit: Position
    length: float
    speed: float
    acceleration: float
    entry: float

    def at(self, s: float) -> Position:
        """The position after a way along the block."""
        return tuple(p + s * u for p, u in zip(self.start, self.unit, strict=True))


@dataclass(frozen=True, slots=True)
class _Phase:
    """A time of constant acceleration along a block."""

    start_s: float
    duration_s: float
    block: Block
    s: float
    v: float
    a: float

    @property
    def end_s(self) -> float:
        return self.start_s + self.duration_s

    def way(self, time_s: float) -> float:
        t = min(max(time_s - self.start_s, 0.0), self.duration_s)
        return self.s + self.v * t + 0.5 * self.a * t * t

    def speed(self, time_s: float) -> float:
        return max(0.0, self.v + self.a * (time_s - self.start_s))


class Planner:
    """Moves the axes along the blocks that it is given.

    Args:
        position: Where the axes stand.
        lead_s: How long the motion that is already computed goes on after a hold.
    """

    def __init__(self, position: Position, lead_s: float) -> None:
        self._position = position
        self._lead_s = lead_s
        self._now_s = 0.0
        self._blocks: deque[Block] = deque()
        self._phases: deque[_Phase] = deque()
        self._is_held = False

    @property
    def now_s(self) -> float:
        """The time until which the axes have moved."""
        return self._now_s

    @property
    def position(self) -> Position:
        """Where the axes are now."""
        return self._position

    @property
    def target(self) -> Position:
        """Where the last block ends; without one, where the axes are."""
        if not self._blocks:
            return self._position
        last = self._blocks[-1]
        return last.at(last.length)

    @property
    def is_moving(self) -> bool:
        """Whether the axes move."""
        return bool(self._phases)

    @property
    def block_count(self) -> int:
        """How many blocks are not done."""
        return len(self._blocks)

    @property
    def end_s(self) -> float:
        """When the motion ends that is planned; infinite if nothing moves."""
        return self._phases[-1].end_s if self._phases else math.inf

    def speed(self) -> float:
        """The speed that the controller reports: that of the last segment it has computed."""
        time_s = self._now_s + self._lead_s
        for phase in self._phases:
            if time_s < phase.end_s:
                return phase.speed(time_s)
        return 0.0

    def add(self, target: Sequence[float], speed: float, limits: Limits) -> None:
        """Adds a straight motion from the last target; nothing if it has no length."""
        start = self.target
        way = tuple(b - a for a, b in zip(start, target, strict=True))
        length = math.hypot(*way)
        if length < _SHORTEST:
            return
        unit = tuple(w / length for w in way)
        acceleration = _along(unit, limits.accelerations)
        before = self._blocks[-1] if self._blocks else None
        self._blocks.append(
            Block(
                start=start,
                unit=unit,
                length=length,
                speed=min(speed, _along(unit, limits.speeds)),
                acceleration=acceleration,
                entry=_junction_speed(before, unit, acceleration, limits),
            )
        )
        if not self._is_held:
            self._plan()

    def hold(self) -> None:
        """Slows down to a stop. The blocks stay."""
        if self._is_held:
            return
        self._is_held = True
        start_s, s, v = self._cut()
        blocks = iter(self._ahead())
        block = next(blocks, None)
        while block is not None and v > _TINY:
            needed = v * v / (2.0 * block.acceleration)
            rest = block.length - s
            v_end = 0.0 if needed <= rest else math.sqrt(v * v - 2.0 * block.acceleration * rest)
            duration_s = (v - v_end) / block.acceleration
            self._append(_Phase(start_s, duration_s, block, s, v, -block.acceleration))
            start_s += duration_s
            block, s, v = next(blocks, None), 0.0, v_end

    def resume(self) -> None:
        """Goes on with the blocks after a hold."""
        if self._is_held:
            self._is_held = False
            self._plan()

    def move_to(self, position: Position) -> None:
        """Stops at a position at once, and forgets all blocks: something else moved the axes."""
        self._blocks.clear()
        self._phases.clear()
        self._is_held = False
        self._position = position

    def advance(self, time_s: float) -> None:
        """Moves the axes until a time."""
        self._now_s = max(self._now_s, time_s)
        while self._phases:
            phase = self._phases[0]
            self._position = phase.block.at(phase.way(self._now_s))
            if phase.end_s > self._now_s + _TINY:
                return
            self._phases.popleft()
            if phase.way(phase.end_s) >= phase.block.length - _NEAR:
                self._position = phase.block.at(phase.block.length)
                self._blocks.popleft()

    def _ahead(self) -> list[Block]:
        """The blocks that are not yet completed by the phases that stay."""
        blocks = list(self._blocks)
        done = sum(p.way(p.end_s) >= p.block.length - _NEAR for p in self._phases)
        return blocks[done:]

    def _cut(self) -> tuple[float, float, float]:
        """Forgets the plan beyond what is computed; time, way in its block and speed there."""
        limit_s = self._now_s + self._lead_s
        while self._phases and self._phases[-1].start_s >= limit_s:
            self._phases.pop()
        if not self._phases:
            return self._now_s, self._way_in_first(), 0.0
        last = self._phases.pop()
        cut_s = min(limit_s, last.end_s)
        self._append(_Phase(last.start_s, cut_s - last.start_s, last.block, last.s, last.v, last.a))
        s, v = last.way(cut_s), last.speed(cut_s)
        return cut_s, (0.0 if s >= last.block.length - _NEAR else s), v

    def _way_in_first(self) -> float:
        """How far the standing axes are along the first block."""
        if not self._blocks:
            return 0.0
        return math.dist(self._blocks[0].start, self._position)

    def _append(self, phase: _Phase) -> None:
        if phase.duration_s > 0.0:
            self._phases.append(phase)

    def _plan(self) -> None:
        """Plans all blocks from where the computed motion ends."""
        start_s, s, v = self._cut()
        blocks = self._ahead()
        exits = [0.0] * len(blocks)
        for index, (_, block) in reversed(list(enumerate(pairwise(blocks)))):
            after = exits[index + 1]
            reach = math.sqrt(after * after + 2.0 * block.acceleration * block.length)
            exits[index] = min(block.entry, blocks[index].speed, block.speed, reach)
        for block, wanted in zip(blocks, exits, strict=True):
            start_s, v = self._trapezoid(block, start_s, s, v, wanted)
            s = 0.0

    def _trapezoid(
        self, block: Block, start_s: float, s: float, v: float, wanted: float
    ) -> tuple[float, float]:
        """Plans a block from a way and a speed; returns when and with what speed it ends."""
        a, rest = block.acceleration, block.length - s
        out = min(wanted, math.sqrt(v * v + 2.0 * a * rest))
        peak = min(max(block.speed, v), math.sqrt((2.0 * a * rest + v * v + out * out) / 2.0))
        rise, fall = (peak * peak - v * v) / (2.0 * a), (peak * peak - out * out) / (2.0 * a)
        if rise < 0.0:
            # A block that was shortened cannot be left in time: it brakes harder, as GRBL does.
            a, rise, fall, peak = (v * v - out * out) / (2.0 * rest), 0.0, rest, v
        for length, speed, change in (
            (rise, v, a),
            (max(0.0, rest - rise - fall), peak, 0.0),
            (fall, peak, -a),
        ):
            if length <= _TINY:
                continue
            last = math.sqrt(max(0.0, speed * speed + 2.0 * change * length))
            duration_s = 2.0 * length / (speed + last)
            self._append(_Phase(start_s, duration_s, block, s, speed, change))
            start_s += duration_s
            s += length
        return start_s, out


def _along(unit: Position, values: Position) -> float:
    """The greatest value along a direction with which no axis exceeds its own."""
    return min(v / abs(u) for u, v in zip(unit, values, strict=True) if abs(u) > _TINY)


def _junction_speed(
    before: Block | None, unit: Position, acceleration: float, limits: Limits
) -> float:
    """The speed at which a corner may be passed, from the deviation that is allowed there."""
    if before is None:
        return 0.0
    cosine = -sum(a * b for a, b in zip(before.unit, unit, strict=True))
    if cosine > _STRAIGHT:
        return 0.0
    if cosine < -_STRAIGHT:
        return math.inf
    half_sine = math.sqrt((1.0 - cosine) / 2.0)
    slowest = min(acceleration, before.acceleration)
    return math.sqrt(slowest * limits.junction_deviation * half_sine / (1.0 - half_sine))
