"""The draft of an environment: the values in a file, each with its place.

A value with a mistake is None, and the mistake is reported.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Generic, TypeVar

from ntagen.nsl.diagnostics import Reporter
from ntagen.nsl.source import Span
from ntagen.nsl.tree import ImageForm, SolidForm
from ntagen.parameters import Given
from ntagen.rules import Breach
from ntagen.scene import RegionKind, Vector
from ntagen.shapes import Shape
from ntagen.values import dataclass

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Placed(Generic[T]):
    """A value and its place in the file; None is a value with a mistake."""

    value: T | None
    span: Span

    def obeying(
        self, reporter: Reporter, rule: Callable[..., Breach | None], *rest: object
    ) -> T | None:
        """The value if it obeys a rule; if not, that is reported. None after a mistake.

        Args:
            reporter: Collects the mistakes.
            rule: Of the value and the rest.
            rest: What the rule is told besides.
        """
        if self.value is None or not reporter.obeys(rule(self.value, *rest), self.span):
            return None
        return self.value


def kept(
    placed: Placed[T] | None,
    otherwise: T | None,
    reporter: Reporter,
    rule: Callable[..., Breach | None],
    *rest: object,
) -> T | None:
    """`Placed.obeying`; if there is no value, what it is otherwise."""
    return otherwise if placed is None else placed.obeying(reporter, rule, *rest)


@dataclass(frozen=True, slots=True)
class DraftSolid:
    """A shape besides the sphere: its vectors and numbers in the order written, and its turn."""

    form: SolidForm
    vectors: tuple[Placed[Vector], ...]
    numbers: tuple[Placed[float], ...]
    turn: tuple[Placed[float], Placed[Vector]] | None = None


@dataclass
class DraftMoves:
    """How a region moves: on a way, or through the places of a table."""

    span: Span
    period: Placed[float]
    way: Placed[float] | None = None
    towards: Placed[Vector] | None = None
    phase: Placed[float] | None = None
    is_table: bool = False
    table: list[tuple[Placed[float], Placed[Vector]]] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class DraftImage:
    """A shape from a file.

    Attributes:
        form: What the file has.
        path: The file, as it is written.
        space: LPS or RAS.
        unit_mm: How many mm one unit of the file is.
        part: The name of a segment or of a point, or the number of a label.
        matrix: Which matrix of a NIfTI file counts: qform or sform.
        radius_mm: How thick points and lines are.
        grid_mm: How fine the table of distances is.
    """

    form: ImageForm
    path: Placed[str]
    space: Placed[str] | None = None
    unit_mm: Placed[float] | None = None
    part: Placed[str] | Placed[int] | None = None
    matrix: Placed[str] | None = None
    radius_mm: Placed[float] | None = None
    grid_mm: Placed[float] | None = None


@dataclass(frozen=True, slots=True)
class DraftTransform:
    """Where imaging space is: a matrix in a file, or its rows.

    Attributes:
        span: Its words.
        is_from: Whether the matrix leads from imaging space to the frame of the scene.
        space: LPS or RAS.
        file: The file, as it is written.
        rows: The rows of the matrix; the last number of each is in mm.
    """

    span: Span
    is_from: bool
    space: Placed[str]
    file: Placed[str] | None = None
    rows: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class DraftRegion:
    """A region: a sphere, another shape, or a margin around another region.

    A solid has its first place as the centre, and what makes it wide as the radius. A shape from a
    file has neither; `made` is one that was made of a part of such a file.
    """

    kind: RegionKind
    name: str
    name_span: Span
    center: Placed[Vector] | None
    radius: Placed[float]
    around: Placed[str] | None = None
    solid: DraftSolid | None = None
    image: DraftImage | None = None
    made: Shape | None = None
    moves: DraftMoves | None = None

    @property
    def margin(self) -> Placed[float]:
        """The margin of a region that lies around another; it is stored as the radius."""
        return self.radius


@dataclass
class Draft:
    """An environment as a file describes it."""

    span: Span
    name: str
    seen: dict[str, Span] = field(default_factory=dict)
    vectors: dict[str, Placed[Vector]] = field(default_factory=dict)
    numbers: dict[str, Placed[float]] = field(default_factory=dict)
    angles: list[Placed[float]] = field(default_factory=list)
    max_rolls: Placed[int] | None = None
    roll_distance: Placed[float] | None = None
    spins: list[Placed[float]] = field(default_factory=list)
    tissue: dict[str, Placed[float]] = field(default_factory=dict)
    choices: dict[str, str] = field(default_factory=dict)
    is_bevel_free: bool = False
    wait: Placed[float] | None = None
    max_pauses: Placed[int] | None = None
    gate: tuple[Placed[float], Placed[float]] | None = None
    gate_span: Span | None = None
    resolution: Placed[float] | None = None
    regions: dict[str, DraftRegion] = field(default_factory=dict)
    target_count: int = 0
    broken_names: set[str] = field(default_factory=set)
    queries: dict[str, Placed[str]] = field(default_factory=dict)
    has_gaps: bool = False
    transform: DraftTransform | None = None
    folders: tuple[str, ...] = ()
    given: list[Given] = field(default_factory=list)
    devices: dict[str, DraftDevice] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class DraftDevice:
    """A device or a tracker: its address, its name, and its axes with their letters and steps."""

    kind: str
    address: Placed[str]
    name: str = ""
    axes: dict[str, tuple[Placed[str], Placed[float]]] = field(default_factory=dict)
